// Many runs of one filter: side by side in the lanes of an instruction set where the models run in
// lanes (lanes.hpp), one after the other where they do not. The same bits either way.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <vector>

#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading.hpp"
#include "desk/arrived.hpp"
#include "desk/filter.hpp"
#include "desk/lanes.hpp"

namespace auvest {
namespace desk {

/// How a record ended: rows done, and what the row behind them was refused with.
struct RunEnd {
  std::size_t rows = 0;
  std::size_t alone = 0;  ///< rows that were not taken in lanes
  Status status = Status::kOk;
};

/// Up to kLanes runs, which begin where a filter is. A row: arguments by dt(), input(), z() and
/// place(), then step(), then feedback().
template <class Scalar, int N>
class SideBySide {
 public:
  using Filter = FilterFor<Scalar, N>;
  using Rows = LaneRows<Scalar>;
  using Sensors = std::vector<std::shared_ptr<const AnySensor<Scalar>>>;

  /// `steps`: null for no lanes.
  SideBySide(const Filter& start, const Sensors& sensors, const LaneSteps<Scalar>* steps)
      : start_(start),
        any_(start),
        twin_(any_.clone()),
        sensors_(sensors),
        steps_(steps),
        kernel_(start.filter().rule().kernel) {
    using Kind = typename AnyLinearisation<Scalar>::Kind;
    const auto& filter = start.filter();
    const auto& rule = filter.rule();
    const auto& how = filter.linearisation();
    lanes_.states = N;
    lanes_.process = process_in_lanes(*filter.process().model, lanes_.process_params);
    lanes_.points = how.kind == Kind::kUkf ? &how.unscented : nullptr;
    lanes_.kernel = kernel_.kind == AnyKernel<Scalar>::Kind::kUnit ? nullptr : &kernel_;
    lanes_.streak = rule.recovery.enabled ? &rule.recovery.streak.params : nullptr;
    lanes_.longest_step_s = filter.longest_step_s();
    possible_ = steps != nullptr && lanes_.process != LaneProcess::kNone && !start.late() &&
                any_.components() == 1 && how.kind != Kind::kCkf &&
                rule.params.residual == Residual::kInnovation;
    for (const auto& sensor : sensors) {
      models_.push_back(sensor_in_lanes(*sensor));
      possible_ = possible_ && models_.back().kind != LaneSensor::kNone;
    }
  }

  /// Whether all this runs in lanes.
  bool possible() const { return possible_; }

  void begin(int runs) {
    for (int lane = 0; lane < kLanes; ++lane) start(lane, start_.filter());
    block_.runs = runs;
  }

  /// Begins a run where this filter is, which differs from the first in nothing else.
  void start(int lane, const typename Filter::Adaptive& filter) {
    put(filter.belief(), filter.rule().recovery.streak, lane);
    policy_[lane] = filter.policy();
    interval_[lane] = filter.interval();
    for (auto& input : block_.input) input[lane] = Scalar(0);
    this->place(lane, nullptr);
    leave(lane);
  }

  void dt(int lane, Scalar seconds) {
    block_.dt[lane] = math::is_nan(seconds) ? interval_[lane] : seconds;
    taken_[lane] = true;
  }
  void input(int lane, const Scalar* numbers) {
    for (int i = 0; i < any_.inputs(); ++i) block_.input[i][lane] = numbers[i];
  }
  /// z: null where it is missing.
  void z(int lane, const Scalar* z, int size) {
    measured_[lane] = z != nullptr;
    for (int m = 0; m < size; ++m) block_.z[m][lane] = z != nullptr ? z[m] : nan();
  }
  /// place: null for where the sensor stands.
  void place(int lane, const Scalar* place) {
    moved_[lane] = place != nullptr;
    for (int i = 0; i < 2; ++i) block_.place[i][lane] = place != nullptr ? place[i] : nan();
  }
  /// The run takes part in no further row.
  void leave(int lane) {
    taken_[lane] = measured_[lane] = moved_[lane] = false;
    block_.dt[lane] = Scalar(0);
    for (auto& z : block_.z) z[lane] = nan();
  }

  /// Takes all runs through a row, which a sensor by this index has measured. What is refused says
  /// so in status().
  void step(std::size_t sensor) {
    LaneModel model = models_[sensor];
    model.moved = false;
    bool measured = false;
    for (int lane = 0; lane < block_.runs; ++lane) {
      model.moved = model.moved || moved_[lane];
      measured = measured || measured_[lane];
    }
    copy_beliefs(block_.rows, before_);
    std::copy_n(block_.recovery, kLanes, before_recovery_);
    steps_->predict(lanes_, block_);
    if (measured) steps_->update(lanes_, model, block_);
    for (int lane = 0; lane < block_.runs; ++lane) {
      status_[lane] = Status::kOk;
      const bool ordinary = block_.ordinary[lane] > Scalar(0);
      if (taken_[lane] && !ordinary) status_[lane] = step_alone(sensor, lane);
    }
  }

  /// As AdaptiveInterval::feedback(), by the position desired, NaN: the estimate.
  Status feedback(int lane, const Scalar* reference) {
    if (policy_[lane].kind == AnyInterval<Scalar>::Kind::kFixed) return Status::kOk;
    const Seen seen{start_.filter().process(), belief(lane)};
    Vector<Scalar, 2> desired;
    for (int i = 0; i < 2; ++i) {
      desired(i) = math::is_nan(reference[i]) ? seen.x()(i) : reference[i];
    }
    if (!math::all_finite(desired)) return Status::kNotFinite;
    interval_[lane] = policy_[lane].next(seen, desired);
    return Status::kOk;
  }

  Status status(int lane) const { return status_[lane]; }
  /// Whether the row was the run's own way and not in lanes.
  bool alone(int lane) const { return !(block_.ordinary[lane] > Scalar(0)); }
  Scalar interval(int lane) const { return interval_[lane]; }
  const AnyInterval<Scalar>& policy(int lane) const { return policy_[lane]; }
  Belief<Scalar, N> belief(int lane) const { return belief(block_.rows, lane); }
  /// What the row has told.
  const Rows& rows() const { return block_.rows; }
  bool measured(int lane) const { return measured_[lane]; }

  static void copy_beliefs(const Rows& from, Rows& to) {
    std::memcpy(to.x, from.x, N * sizeof *to.x);
    std::memcpy(to.P, from.P, N * (N + 1) / 2 * sizeof *to.P);
  }

 private:
  /// A run as an interval policy looks at it.
  struct Seen {
    const RuntimeProcess<Scalar, N>& process_;
    Belief<Scalar, N> belief_;

    const RuntimeProcess<Scalar, N>& process() const { return process_; }
    const Belief<Scalar, N>& belief() const { return belief_; }
    const Vector<Scalar, N>& x() const { return belief_.x; }
  };

  template <class Process>
  static bool is(const ProcessFor<Scalar, N>& process, const void*& params) {
    const auto* own = dynamic_cast<const ProcessOf<Process>*>(&process);
    if (own != nullptr) params = &own->process().params;
    return own != nullptr;
  }
  static LaneProcess process_in_lanes(const ProcessFor<Scalar, N>& process, const void*& params) {
    if constexpr (N == 6) {
      if (is<EulerAcceleration<Scalar>>(process, params)) return LaneProcess::kEuler;
      if (is<ExactAcceleration<Scalar>>(process, params)) return LaneProcess::kExact;
    } else {
      if (is<SpeedHeading<Scalar>>(process, params)) return LaneProcess::kSpeedHeading;
    }
    return LaneProcess::kNone;
  }
  static LaneModel sensor_in_lanes(const AnySensor<Scalar>& sensor) {
    if (const auto* own = dynamic_cast<const SensorOf<RangeBearing<Scalar, N>>*>(&sensor)) {
      return {LaneSensor::kRangeBearing, &own->model().params, false};
    }
    if (const auto* own = dynamic_cast<const SensorOf<LeaderRange<Scalar, N>>*>(&sensor)) {
      return {LaneSensor::kLeaderRange, &own->model().params, false};
    }
    return {LaneSensor::kNone, nullptr, false};
  }

  static Belief<Scalar, N> belief(const Rows& rows, int lane) {
    Belief<Scalar, N> belief;
    for (int i = 0; i < N; ++i) {
      belief.x(i) = rows.x[i][lane];
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = belief.P(j, i) = rows.P[i * (i + 1) / 2 + j][lane];
      }
    }
    return belief;
  }
  void put(const Belief<Scalar, N>& belief, const RejectionStreak<Scalar>& streak, int lane) {
    for (int i = 0; i < N; ++i) {
      block_.rows.x[i][lane] = belief.x(i);
      for (int j = 0; j <= i; ++j) block_.rows.P[i * (i + 1) / 2 + j][lane] = belief.P(i, j);
    }
    put_away(streak, block_.recovery[lane]);
  }

  /// A row that is not ordinary, from before it: as a filter takes it.
  Status step_alone(std::size_t sensor, int lane) {
    auto& twin = static_cast<Filter&>(*twin_);
    RejectionStreak<Scalar> streak = start_.filter().rule().recovery.streak;
    take_up(before_recovery_[lane], streak);
    twin.filter_.put(belief(before_, lane), streak);

    Scalar input[3], z[2], place[2];
    for (int i = 0; i < 3; ++i) input[i] = block_.input[i][lane];
    for (int i = 0; i < 2; ++i) {
      z[i] = block_.z[i][lane];
      place[i] = block_.place[i][lane];
    }
    const Status status = twin_->predict(block_.dt[lane], input);
    if (status != Status::kOk) return status;
    if (measured_[lane]) {
      const Report<Scalar> report =
          twin_->update(z, sensors_[sensor], moved_[lane] ? place : nullptr, Scalar(0));
      if (report.status != Status::kOk) return report.status;
      tell(report, lane);
    }
    put(twin.filter().belief(), twin.filter().rule().recovery.streak, lane);
    return Status::kOk;
  }
  void tell(const Report<Scalar>& report, int lane) {
    Rows& rows = block_.rows;
    for (int i = 0; i < report.size; ++i) {
      rows.innovation[i][lane] = report.innovation[i];
      rows.standardised[i][lane] = report.standardised[i];
      rows.weight[i][lane] = report.weight[i];
    }
    for (int i = 0; i < report.size * report.size; ++i) rows.S[i][lane] = report.S[i];
    rows.nis[lane] = report.nis;
    rows.near_field[lane] = Scalar(report.near_field ? 1 : 0);
    rows.recovered[lane] = report.recovered;
  }

  static Scalar nan() { return std::numeric_limits<Scalar>::quiet_NaN(); }

  const Filter& start_;
  const AnyFilter<Scalar>& any_;             // the same: what its table knows is compiled elsewhere
  std::unique_ptr<AnyFilter<Scalar>> twin_;  // takes the rows that are not ordinary
  const Sensors& sensors_;
  const LaneSteps<Scalar>* steps_;
  AnyKernel<Scalar> kernel_;
  LaneFilter<Scalar> lanes_ = {};
  std::vector<LaneModel> models_;
  bool possible_;
  LaneBlock<Scalar> block_ = {};
  Rows before_;
  LaneRow<LaneRecovery<Scalar>> before_recovery_;
  LaneRow<AnyInterval<Scalar>> policy_;
  LaneRow<Scalar> interval_;
  LaneRow<Status> status_;
  LaneRow<bool> taken_ = {};
  LaneRow<bool> measured_ = {};
  LaneRow<bool> moved_ = {};
};

/// Takes records through runs side by side and writes what they tell.
template <class Scalar, int N>
class RecordsSideBySide {
 public:
  using Runs = SideBySide<Scalar, N>;

  RecordsSideBySide(Runs& runs, int inputs, bool recovers)
      : runs_(runs), inputs_(inputs), recovers_(recovers), kept_(kKept) {}

  /// Up to kLanes records of as many rows, whose rows have the same sensors.
  void run(const Record<Scalar>* records, const Columns<Scalar>* outs, int count, RunEnd* ends) {
    runs_.begin(count);
    for (int lane = 0; lane < count; ++lane) ends[lane] = RunEnd();
    std::size_t written = 0;
    int left = count;
    for (std::size_t k = 0; k < records[0].rows && left > 0; ++k) {
      const std::size_t sensor =
          records[0].sensor != nullptr ? static_cast<std::size_t>(records[0].sensor[k]) : 0;
      const int size = records[0].sensors[sensor]->size;
      for (int lane = 0; lane < count; ++lane) {
        if (ends[lane].status == Status::kOk) ask(records[lane], k, lane, size);
      }
      runs_.step(sensor);
      for (int lane = 0; lane < count; ++lane) {
        RunEnd& end = ends[lane];
        if (end.status != Status::kOk) continue;
        end.status = runs_.status(lane);
        end.alone += runs_.alone(lane);
        if (end.status == Status::kOk && records[lane].reference != nullptr) {
          end.status = runs_.feedback(lane, records[lane].reference + k * 2);
        }
        if (end.status == Status::kOk) {
          end.rows = k + 1;
        } else {
          runs_.leave(lane);
          --left;
        }
      }
      keep(kept_[k - written], size);
      if (k + 1 - written == kKept || k + 1 == records[0].rows || left == 0) {
        write(records[0].width, outs, count, ends, written);
        written = k + 1;
      }
    }
  }

 private:
  /// Rows are written some at a time: a run's lie one behind the other, those of a block far apart.
  static constexpr std::size_t kKept = 8;
  struct Kept {
    LaneRows<Scalar> rows;
    LaneRow<Scalar> interval;
    LaneRow<bool> measured;
    int size;
  };

  void ask(const Record<Scalar>& record, std::size_t k, int lane, int size) {
    runs_.dt(lane, record.dt[k]);
    runs_.input(lane, record.input_of(k, inputs_));
    runs_.z(lane, record.measured(k) ? record.z + k * record.width : nullptr, size);
    if (record.place != nullptr) runs_.place(lane, record.place_of(k));
  }

  void keep(Kept& kept, int size) const {
    const LaneRows<Scalar>& rows = runs_.rows();
    Runs::copy_beliefs(rows, kept.rows);
    std::memcpy(kept.rows.innovation, rows.innovation,
                sizeof rows - offsetof(LaneRows<Scalar>, innovation));
    kept.size = size;
    for (int lane = 0; lane < kLanes; ++lane) {
      kept.interval[lane] = runs_.interval(lane);
      kept.measured[lane] = runs_.measured(lane);
    }
  }

  /// The rows from `first` on that a run has.
  void write(std::size_t width, const Columns<Scalar>* outs, int count, const RunEnd* ends,
             std::size_t first) const {
    // Column by column: what is read of the rows stays near.
    const auto each = [&](auto&& write_row) {
      for (int lane = 0; lane < count; ++lane) {
        const std::size_t end = std::min(ends[lane].rows, first + kKept);
        for (std::size_t k = first; k < end; ++k) write_row(kept_[k - first], outs[lane], k, lane);
      }
    };
    each([](const Kept& kept, const Columns<Scalar>& out, std::size_t k, int lane) {
      for (int i = 0; i < N; ++i) out.x[k * N + static_cast<std::size_t>(i)] = kept.rows.x[i][lane];
    });
    if (outs[0].P != nullptr) {
      each([](const Kept& kept, const Columns<Scalar>& out, std::size_t k, int lane) {
        Scalar* const p = out.P + k * N * N;
        for (int i = 0; i < N; ++i) {
          for (int j = 0; j <= i; ++j) {
            p[i * N + j] = p[j * N + i] = kept.rows.P[i * (i + 1) / 2 + j][lane];
          }
        }
      });
    }
    each([&](const Kept& kept, const Columns<Scalar>& out, std::size_t k, int lane) {
      write_update(kept, width, out, k, lane);
    });
  }

  void write_update(const Kept& kept, std::size_t width, const Columns<Scalar>& out, std::size_t k,
                    int lane) const {
    constexpr Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
    const std::size_t size = kept.measured[lane] ? static_cast<std::size_t>(kept.size) : 0;
    bool all_full = true;
    bool all_zero = true;
    for (std::size_t i = 0; i < width; ++i) {
      const bool there = i < size;
      const Scalar weight = there ? kept.rows.weight[i][lane] : nan;
      all_full = all_full && !(weight < Scalar(1));
      all_zero = all_zero && !(weight > Scalar(0));
      out.innovation[k * width + i] = there ? kept.rows.innovation[i][lane] : nan;
      out.standardised[k * width + i] = there ? kept.rows.standardised[i][lane] : nan;
      out.weight[k * width + i] = weight;
      for (std::size_t j = 0; out.S != nullptr && j < width; ++j) {
        out.S[(k * width + i) * width + j] =
            there && j < size ? kept.rows.S[i * size + j][lane] : nan;
      }
    }
    const Decision decision = all_full   ? Decision::kAccepted
                              : all_zero ? Decision::kRejected
                                         : Decision::kDownweighted;
    out.nis[k] = size > 0 ? kept.rows.nis[lane] : nan;
    out.interval[k] = kept.interval[lane];
    out.decision[k] = static_cast<std::uint8_t>(decision);
    out.iterations[k] = size > 0;
    out.near_field[k] = size > 0 && kept.rows.near_field[lane] > Scalar(0);
    out.recovered[k] = size > 0 && recovers_ && kept.rows.recovered[lane];
    out.too_late[k] = false;
  }

  Runs& runs_;
  int inputs_;
  bool recovers_;
  std::vector<Kept> kept_;
};

template <class Scalar, int N>
bool run_in_lanes(const AnyFilter<Scalar>& start, const Record<Scalar>* records,
                  const Columns<Scalar>* outs, std::size_t count, const LaneSteps<Scalar>* steps,
                  RunEnd* ends) {
  const auto& filter = static_cast<const FilterFor<Scalar, N>&>(start);
  SideBySide<Scalar, N> runs(filter, records[0].sensors, steps);
  if (!runs.possible()) return false;
  RecordsSideBySide<Scalar, N> block(runs, start.inputs(), filter.filter().rule().recovery.enabled);
  for (std::size_t r = 0; r < count; r += kLanes) {
    const std::size_t some = std::min(count - r, static_cast<std::size_t>(kLanes));
    block.run(records + r, outs + r, static_cast<int>(some), ends + r);
  }
  return true;
}

/// Takes each of `count` records of as many rows, whose rows have the same sensors, through a copy
/// of the filter, as its run() would. `steps`: of an instruction set, or null.
template <class Scalar>
void run_each(const AnyFilter<Scalar>& start, const Record<Scalar>* records,
              const Columns<Scalar>* outs, std::size_t count, const LaneSteps<Scalar>* steps,
              RunEnd* ends) {
  if (count > 1 && start.states() == 2 &&
      run_in_lanes<Scalar, 2>(start, records, outs, count, steps, ends)) {
    return;
  }
  if (count > 1 && start.states() == 6 &&
      run_in_lanes<Scalar, 6>(start, records, outs, count, steps, ends)) {
    return;
  }
  for (std::size_t r = 0; r < count; ++r) {
    const auto one = start.clone();
    Report<Scalar> last;
    ends[r].rows = ends[r].alone = one->run(records[r], outs[r], last, ends[r].status);
  }
}

}  // namespace desk
}  // namespace auvest
