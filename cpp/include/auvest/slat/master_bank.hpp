// What a particle of Slatf keeps of one master: the numbers from `at` on, in a vector's lanes, of
// which the first 27 are always the Gaussian belief that the rest of Slatf reads. This is the bank
// of a master with one process model; imm_slat.hpp has that of an Imm.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/select.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/slat/sighting.hpp"
#include "auvest/types.hpp"

namespace auvest {

/// What an update of one Gaussian says.
template <class Value>
struct Echo {
  math::Mask<Value> valid;  ///< the belief has moved and is finite
  Value log_density;        ///< of the innovation, without the constant
};

/// Takes an echo by `ekf` into the belief stored from `at` on, in the lanes of `only` (null: all)
/// where it is valid; gives that belief and returns the logarithm of the echo's density.
template <class Lanes, class Value, class Ekf>
AUVEST_INLINE Value correct_stored(const Ekf& ekf, const math::Mask<Value>* only,
                                   typename Lanes::Scalar* at, Belief<Value, 6>& belief) {
  using math::all;
  load_belief<Lanes>(at, belief);
  const Echo<Value> echo = ekf(belief);
  math::Mask<Value> moved = echo.valid;
  if (only != nullptr) moved = moved && *only;
  store_belief_where<Lanes>(moved, at, belief);
  if (!all(moved)) load_belief<Lanes>(at, belief);
  return echo.log_density;
}

template <class Master, class Lanes>
struct MasterBank {
  using Scalar = typename Lanes::Scalar;
  using Value = typename Lanes::Value;
  using Gaussian = Belief<Value, 6>;
  static constexpr int kModes = 1;
  static constexpr int kNumbers = 6 + triangle_numbers(6);

  static AUVEST_INLINE void begin(const Master&, const Gaussian& belief, Scalar* at) {
    store_belief<Lanes>(at, belief);
  }

  static AUVEST_INLINE void predict(const Master& master, Scalar dt,
                                    const Vector<Scalar, 2>* change, Scalar* at) {
    Gaussian belief;
    load_belief<Lanes>(at, belief);
    master.propagate(belief, dt);  // [SLATF 15] [SLATF 16]
    if (change != nullptr) add_planned_change(*change, dt, belief.x);
    store_belief<Lanes>(at, belief);
  }

  /// Returns the logarithm of the echo's density.
  template <class Ekf>
  static AUVEST_INLINE Value correct(const Ekf& ekf, const math::Mask<Value>* only, Scalar* at) {
    Gaussian belief;
    return correct_stored<Lanes>(ekf, only, at, belief);
  }
};

}  // namespace auvest
