// The record of an outage through a filter of slat/: rows in, a sink out. A row is a reading of the
// odometry that holds for some time, and what the sonar heard in that time; there the interval is
// split, so that every echo meets the filter at its own moment.
//
//     run_record<Row>(filter, [](Row& row) { ... },  // fills the next row; false at the end
//                     sonar, random, [](const Row& row, Status status) { ... });
//
// Time: the type of the times. What the filter is told are differences of them, so that it may be a
// float where every row has a clock of its own that begins with 0; else a double.
#pragma once

#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar, class Time>
struct TimedEcho {
  Time time_s;
  Echo<Scalar> echo;
};

/// Masters: how many may be planned for or heard at one time.
template <class Scalar_, int Masters, class Time_>
struct SlatRow {
  using Scalar = Scalar_;
  using Time = Time_;
  static constexpr int kMasters = Masters;

  Time from_s, to_s;  ///< `u` holds from here to there
  Vector<Scalar, 2> u;
  bool planned = false;                ///< the velocity changes of the masters are known:
  Vector<Scalar, 2> changes[Masters];  ///< in all of that time [m/s]; of masters yet unborn 0
  const TimedEcho<Scalar, Time>* echoes = nullptr;  ///< heard in that time, in their order
  int count = 0;
};

/// Takes the filter through one row; echoes of one time are one update, of the plan each part of
/// the interval gets its share. Stops at the first status that is not kOk: that of the filter;
/// kTimeBackwards for an echo before the row or before the one that it follows; kBadParameter for
/// one behind the row, and for more of one time than masters.
template <class Filter, class Row>
Status run_row(Filter& filter, const Row& row, const Sonar<typename Row::Scalar>& sonar,
               math::Random& random) {
  using Scalar = typename Row::Scalar;
  using Time = typename Row::Time;
  const Time all = row.to_s - row.from_s;
  Time now = row.from_s;
  int heard = 0;
  for (;;) {
    Echo<Scalar> group[Row::kMasters];
    int count = 0;
    for (; heard < row.count && row.echoes[heard].time_s == now; ++heard) {
      if (count == Row::kMasters) return Status::kBadParameter;
      group[count++] = row.echoes[heard].echo;
    }
    Status status = count > 0 ? filter.update(group, count, sonar, random) : Status::kOk;
    if (status != Status::kOk) return status;
    if (now == row.to_s) return heard == row.count ? Status::kOk : Status::kBadParameter;

    const bool stop = heard < row.count && row.echoes[heard].time_s < row.to_s;
    const Time next = stop ? row.echoes[heard].time_s : row.to_s;
    const Time part = next - now;
    const Scalar share = part == all ? Scalar(1) : static_cast<Scalar>(part / all);
    Vector<Scalar, 2> changes[Row::kMasters];
    for (int n = 0; row.planned && n < Row::kMasters; ++n) {
      for (int axis = 0; axis < 2; ++axis) changes[n](axis) = share * row.changes[n](axis);
    }
    status =
        filter.predict(static_cast<Scalar>(part), row.u, random, row.planned ? changes : nullptr);
    if (status != Status::kOk) return status;
    now = next;
  }
}

/// Takes the filter through the rows that `next(row)` fills in until it is false, and hands each to
/// `sink(row, status)`, after it. Stops at the first status that is not kOk and returns it.
template <class Row, class Filter, class Next, class Sink>
Status run_record(Filter& filter, Next&& next, const Sonar<typename Row::Scalar>& sonar,
                  math::Random& random, Sink&& sink) {
  Row row;
  Status status = Status::kOk;
  while (status == Status::kOk && next(row)) {
    status = run_row(filter, row, sonar, random);
    sink(row, status);
  }
  return status;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
