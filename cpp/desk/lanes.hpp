// Runs side by side: what goes between run_lanes.hpp, which takes many runs through a record, and
// the steps in the lanes of an instruction set, lane_steps.hpp. Plain data, and nothing inline:
// both sides may be compiled for different sets.
//
// A block holds kLanes runs, each field an array of one number per run. A step does the ordinary
// way of a row for all of them and says of each run whether that was its way. Where it was not (a
// refusal, a lost pivot, a belief that rounding has left indefinite), the run takes the row by
// itself, as any filter does. So a step need not know what becomes of such a row, only never to
// call one ordinary.
#pragma once

#include <cstdint>

namespace auvest {
namespace desk {

const int kLanes = 16;  ///< runs in a block: a multiple of every instruction set's lanes

/// The models that run in lanes.
enum class LaneProcess : std::uint8_t { kNone, kEuler, kExact, kSpeedHeading };
enum class LaneSensor : std::uint8_t { kNone, kRangeBearing, kLeaderRange };

/// What all runs of a block have in common. Pointers to objects that may have another name in the
/// code of another instruction set: `arrived()` takes their bytes.
template <class Scalar>
struct LaneFilter {
  int states;
  LaneProcess process;
  const void* process_params;
  const void* points;  ///< SigmaPoints<Scalar>; null: by Jacobians
  const void* kernel;  ///< AnyKernel<Scalar>; null: every residual counts fully
  const void* streak;  ///< RejectionStreak<Scalar>::Params; null: no recovery
  Scalar longest_step_s;
};

/// The sensor of a row.
struct LaneModel {
  LaneSensor kind;
  const void* params;
  bool moved;  ///< to `place` of the block
};

/// What a recovery carries: the members of RejectionStreak.
template <class Scalar>
struct LaneRecovery {
  std::uint8_t count, widened;
  Scalar variance;
  Scalar recent[6];
};

/// A number of each run of a block.
template <class Scalar>
using LaneRow = Scalar[kLanes];

/// The beliefs of a block, and what a row tells of its runs. What an update tells has no meaning
/// where z is missing.
template <class Scalar>
struct LaneRows {
  LaneRow<Scalar> x[6];
  LaneRow<Scalar> P[21];  ///< the lower triangle, row by row
  LaneRow<Scalar> innovation[2];
  LaneRow<Scalar> S[4];
  LaneRow<Scalar> standardised[2];
  LaneRow<Scalar> weight[2];
  LaneRow<Scalar> nis;
  LaneRow<Scalar> near_field;  ///< 1 or 0
  LaneRow<bool> recovered;
};

/// What goes into a step, and what it changes.
template <class Scalar>
struct LaneBlock {
  int runs;  ///< that are there; the lanes behind them are of no account

  LaneRow<Scalar> dt;
  LaneRow<Scalar> input[3];
  LaneRow<Scalar> z[2];      ///< NaN: missing
  LaneRow<Scalar> place[2];  ///< NaN: as the model has it

  LaneRows<Scalar> rows;
  LaneRow<LaneRecovery<Scalar>> recovery;
  LaneRow<Scalar> ordinary;  ///< 1: done; 0: the run must take the row by itself
};

/// The steps of an instruction set: predict() first, then, if a run has measured, update().
template <class Scalar>
struct LaneSteps {
  void (*predict)(const LaneFilter<Scalar>& filter, LaneBlock<Scalar>& block);
  void (*update)(const LaneFilter<Scalar>& filter, const LaneModel& sensor,
                 LaneBlock<Scalar>& block);
};

}  // namespace desk
}  // namespace auvest
