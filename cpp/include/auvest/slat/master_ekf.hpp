// The EKF of one master, given the slave's pose: [SLATF 18] to [SLATF 26], in square-root form
// (square_root_update.hpp). In three calls, which Slatf takes apart in time (particles/tiles.hpp):
//
//     ekf.factor(P)                    the master's prediction
//     ekf.innovate(sonar, z, ...)      what an echo says of it
//     ekf.correct(belief)              the master follows
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/twin.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/slat/definite.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Value>
struct MasterEkf {
  Matrix<Value, 2, 2> root;   ///< of the covariance of the master's position
  Matrix<Value, 4, 2> slope;  ///< regression of the other states on the position
  Posterior<Value, 2> posterior;
  math::Mask<Value> valid;

  /// Of P only the lower triangle is read.
  AUVEST_INLINE void factor(const Matrix<Value, 6, 6>& P) {
    valid = math::factor_leading(P, root, slope);
  }

  /// An echo z heard at `pose` of the master at (x, y); beyond a NIS of `gate` it says nothing (0:
  /// no gate). `noise` is R; what it leaves there log_density() needs for [SLATF 31].
  ///
  /// Differs from [SLATF 24]: the gain is not formed; its product with the innovation and its
  /// effect on P are, in the coordinates of the root.
  template <class Scalar, int Pose>
  AUVEST_INLINE void innovate(const Sonar<Scalar>& sonar, const Vector<Scalar, 2>& z,
                              const Vector<Value, Pose>& pose, const Value& x, const Value& y,
                              Scalar gate, Matrix<Value, 2, 2>& noise) {
    typename Sonar<Scalar>::template View<Value, Pose> view;
    sonar.look(pose, x, y, z, view);  // [SLATF 18] [SLATF 20] [SLATF 22]
    Matrix<Value, 2, 2> a;
    project(view.by_master, root, a);
    const math::Mask<Value> finite = potter<!math::is_number<Value>()>(
        a, noise, view.innovation, posterior);  // [SLATF 23] [SLATF 24]
    valid = finite && valid;
    if (gate > Scalar(0)) saturate(Value(gate), posterior);
  }

  /// [SLATF 25] and [SLATF 26]. False where the master cannot follow.
  AUVEST_INLINE math::Mask<Value> correct(Belief<Value, 6>& master) {
    const Vector<Value, 4> before = unseen_variances<2>(master.P);
    // [SLATF 25] [SLATF 26]
    const math::Mask<Value> finite = move_belief(master, root, slope, posterior);
    keep_definite<2>(before, slope, master.P);
    return finite && valid;
  }
};

// The EKF of a group of particles is worked out where it is kept; that of a pair of groups is
// handed out to both, each part as soon as it is known, so that it takes no registers then.

template <class Value>
AUVEST_INLINE MasterEkf<Value>& draft(MasterEkf<Value>&, MasterEkf<Value>* to) {
  return *to;
}
template <class Value>
AUVEST_INLINE MasterEkf<math::Twin<Value>>& draft(MasterEkf<math::Twin<Value>>& both,
                                                  MasterEkf<Value>*) {
  return both;
}

template <class Value>
AUVEST_INLINE void hand_out_factors(const MasterEkf<Value>&, MasterEkf<Value>*) {}
template <class Value>
AUVEST_INLINE void hand_out_factors(const MasterEkf<math::Twin<Value>>& from,
                                    MasterEkf<Value>* to) {
  math::split(from.root, to[0].root, to[1].root);
  math::split(from.slope, to[0].slope, to[1].slope);
}

template <class Value>
AUVEST_INLINE void hand_out_posterior(const MasterEkf<Value>&, MasterEkf<Value>*) {}
template <class Value>
AUVEST_INLINE void hand_out_posterior(const MasterEkf<math::Twin<Value>>& from,
                                      MasterEkf<Value>* to) {
  math::split(from.posterior.y, to[0].posterior.y, to[1].posterior.y);
  math::split(from.posterior.g, to[0].posterior.g, to[1].posterior.g);
  to[0].valid = from.valid.a;
  to[1].valid = from.valid.b;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
