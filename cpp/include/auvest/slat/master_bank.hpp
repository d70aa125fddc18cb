// What a particle of Slatf keeps of one master: the numbers from `at` on, in a vector's lanes, of
// which the first 27 are always the Gaussian belief that the rest of Slatf reads. This is the bank
// of a master with one process model; imm_slat.hpp has that of an Imm.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/particles/mixture.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

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

  /// Whether the numbers of one particle are those of a bank.
  static bool is_sound(const Scalar* at, const Extent<Scalar>& first) {
    return is_belief<6>(at, first);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
