// From what the particles' poses are drawn: all that differs between SLATF 1.0 and 2.0.
//
//     MotionProposal        1.0  p(X | u), [SLATF 12]: blind to the measurement
//     MeasurementProposal   2.0  p(X | u, z), [SLATF 46]: linearised, Gaussian
//
// 2.0 draws no pose before a measurement comes. Between two of them (odometry may be faster than
// the sonar) each particle carries a mean and a covariance P_S of what its pose has gathered since
// it was last drawn. Differs from [SLATF 50]: a drawn pose is a point, so P_S starts again from
// zero, as in FastSLAM 2.0; `carry_covariance` keeps Sigma of [SLATF 57] instead, as it reads.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

struct MotionProposal {
  static constexpr bool kInformed = false;

  template <class Motion, class Value>
  static AUVEST_INLINE void predict(const Motion& motion, const typename Motion::Step& step,
                                    const Value& a, const Value& b,
                                    Belief<Value, Motion::kStates>& pose) {
    motion.sample(step, a, b, pose.x);  // [SLATF 10] [SLATF 12]
  }
};

struct MeasurementProposal {
  static constexpr bool kInformed = true;

  template <class Motion, class Value>
  static AUVEST_INLINE void predict(const Motion& motion, const typename Motion::Step& step,
                                    const Value&, const Value&,
                                    Belief<Value, Motion::kStates>& pose) {
    motion.propagate(step, pose);  // [SLATF 11] [SLATF 50]
  }

  /// Refines the proposal N(pose.x, root root') by an echo, [SLATF 51] of it in `view`, given its
  /// noise R and the root of the covariance of the master's position. Returns the logarithm of the
  /// weight, without the constant. Beyond a NIS of `gate` the echo says nothing. `nis` is that
  /// before the gate.
  ///
  /// Differs from [SLATF 57] and [SLATF 58], which need P_S^-1: with P_S = L L' and in the
  /// coordinates of L the same update needs no inverse, so P_S may be singular (zero speed, a
  /// heading in the state). Differs from [SLATF 65]: the exponent is -1/2, and the caller
  /// multiplies the old weight in.
  template <class View, class Value, int Pose>
  static AUVEST_INLINE Value refine(const View& view, const Matrix<Value, 2, 2>& noise,
                                    const Matrix<Value, 2, 2>& master_root, const Value& gate,
                                    Belief<Value, Pose>& pose, Matrix<Value, Pose, Pose>& root,
                                    Value& nis) {
    using math::all;
    Matrix<Value, 2, 2> by_master;
    Matrix<Value, 2, 2> lambda;
    project(view.by_master, master_root, by_master);
    innovation_covariance(by_master, noise, lambda);  // [SLATF 52]
    math::ldlt(lambda);

    const Belief<Value, Pose> before = pose;
    Matrix<Value, 1, Pose> no_others;
    math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
    const Matrix<Value, Pose, Pose> prior_root = root;
    Matrix<Value, 2, Pose> by_slave;
    project(view.by_slave, root, by_slave);
    Posterior<Value, Pose> posterior;
    // [SLATF 65]: L = G_S P_S G_S' + Lambda, whose determinant stays in lambda
    math::Mask<Value> valid = potter(by_slave, lambda, view.innovation, posterior);
    nis = posterior.nis;
    saturate(gate, posterior);
    valid = valid && move_belief(pose, root, no_others, posterior);  // [SLATF 57] [SLATF 58]
    if (!all(valid)) {
      math::copy_where(!valid, before, pose);
      math::copy_where(!valid, prior_root, root);
    }
    return log_density(valid, posterior, lambda);  // [SLATF 64] [SLATF 65]
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
