// What a filter of slat/ is made of at run time, and the instruction sets in whose lanes a SLATF
// can run.
#pragma once

#include "any_slat.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/runtime/any_resampling.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "auvest/slat/slatf_shared.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The models of a master whose manoeuvres nobody announces.
template <class Scalar>
using ThreeModels =
    Imm<ConstantVelocity<Scalar>, ExactAcceleration<Scalar>, CoordinatedTurn<Scalar>>;

/// Masters that an EkfSlat takes here. With an Imm there are 3 to their power hypotheses.
template <class Master>
struct EkfMasters {
  static constexpr int kMost = bindings::kMostMasters;
};
template <class Scalar>
struct EkfMasters<ThreeModels<Scalar>> {
  static constexpr int kMost = 2;
};

template <class Motion_, class Master_ = PiecewiseAcceleration<typename Motion_::Scalar>>
struct SlatfSetup {
  using Motion = Motion_;
  using Master = Master_;
  using Scalar = typename Motion::Scalar;

  Motion motion;
  Master master;
  SlatfParams<Scalar> params;
  AnyResampling resampling;
  int version = 2;  ///< 1 or 2
  int particles = 100;
};

template <class Motion_, class Params>
struct JointSetup {
  using Motion = Motion_;
  using Scalar = typename Motion::Scalar;

  Motion motion;
  PiecewiseAcceleration<Scalar> master;
  Params params;
  AnyResampling resampling;
  int particles = 100;
  int max_masters = 1;  ///< 1, or up to kMostMasters: storage and time grow with the square
};

template <class Motion>
using SlatfJointSetup = JointSetup<Motion, SlatfJointParams<typename Motion::Scalar>>;
template <class Motion>
using SlatfSharedSetup = JointSetup<Motion, SlatfSharedParams<typename Motion::Scalar>>;

template <class Motion>
using SlatfInterface = bindings::SlatInterface<typename Motion::Scalar, Motion::kStates>;

/// Defined in slatf_lanes.hpp, and compiled in one file per instruction set that every processor
/// has; for the others see make_wide_slatf().
template <bindings::InstructionSet set, class Motion, class Master>
SlatfInterface<Motion>* make_slatf(const SlatfSetup<Motion, Master>& setup);

/// Defined and compiled in slatf_joint.cpp.
template <class Motion>
SlatfInterface<Motion>* make_slatf_joint(const SlatfJointSetup<Motion>& setup);

/// Defined and compiled in ekf_slat.cpp.
template <class Motion, class Master>
SlatfInterface<Motion>* make_ekf_slat(const Motion& motion, const Master& master,
                                      const EkfSlatParams<typename Motion::Scalar>& params);
template <class Motion>
SlatfInterface<Motion>* make_dead_reckoning(const Motion& motion,
                                            typename Motion::Scalar longest_step_s);

/// Defined and compiled in slatf_shared.cpp.
template <class Motion>
SlatfInterface<Motion>* make_slatf_shared(const SlatfSharedSetup<Motion>& setup);

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
