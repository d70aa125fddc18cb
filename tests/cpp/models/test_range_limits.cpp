// What a sensor of ranges cannot have measured is refused, and where it cannot stand.
#include <doctest/doctest.h>

#include <cmath>
#include <initializer_list>

#include "auvest/filters/aukf.hpp"
#include "auvest/filters/ckf.hpp"
#include "auvest/filters/robust_ekf.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/range_bearing_elevation.hpp"
#include "auvest/models/white_acceleration.hpp"

namespace {

using namespace auvest;
using Process = WhiteAcceleration<float, 3>;

template <class Filter>
Filter begun(Filter filter) {
  typename Filter::State x = Filter::State::Zero();
  x(0) = 10;
  x(1) = 5;
  typename Filter::Covariance P = Filter::Covariance::Identity();
  REQUIRE(filter.reset(x, P) == Status::kOk);
  return filter;
}

template <class Sensor, class Filter>
void check_limits(Filter filter) {
  const auto x = filter.x();
  const auto P = filter.P();
  Sensor sensor;
  auto z = sensor.h(x);
  const auto status = [&](double range, const Sensor& by) {
    z(0) = float(range);
    Filter copy = filter;
    const auto correction = copy.update(z, by);
    if (correction.status == Status::kOk) return Status::kOk;
    CHECK(copy.x() == x);
    CHECK(copy.P() == P);
    CHECK(correction.nis == 0);
    return correction.status;
  };
  for (const double range : {-1e-30, -1.0, -9999.0}) {
    CHECK(status(range, sensor) == Status::kImpossibleRange);
  }
  CHECK(status(0, sensor) == Status::kOk);
  CHECK(status(9999, sensor) == Status::kOk);
  sensor.params.smallest_range_m = 2;
  sensor.params.largest_range_m = 500;
  REQUIRE(sensor.check() == Status::kOk);
  CHECK(status(1.999, sensor) == Status::kImpossibleRange);
  CHECK(status(500.1, sensor) == Status::kImpossibleRange);
  CHECK(status(9999, sensor) == Status::kImpossibleRange);
  CHECK(status(2, sensor) == Status::kOk);
  CHECK(status(500, sensor) == Status::kOk);
  CHECK(status(std::nan(""), sensor) == Status::kNotFinite);
  sensor.params.smallest_range_m = -3;  // noise that is not cut off at 0
  CHECK(status(-2, sensor) == Status::kOk);
}

template <class Sensor>
void check_in_all_filters() {
  check_limits<Sensor>(begun(Ekf<Process>{Process()}));
  check_limits<Sensor>(begun(Ukf<Process>{Process()}));
  check_limits<Sensor>(begun(Ckf<Process>{Process()}));
  check_limits<Sensor>(begun(RobustEkf<Process>{Ekf<Process>(Process())}));
  check_limits<Sensor>(begun(Aukf<Process>{Ukf<Process>(Process())}));
}

template <class Sensor>
void check_parameters() {
  const auto with = [](float smallest, float largest) {
    Sensor sensor;
    sensor.params.smallest_range_m = smallest;
    sensor.params.largest_range_m = largest;
    return sensor.check();
  };
  CHECK(with(0, HUGE_VALF) == Status::kOk);
  CHECK(with(1, 1.5f) == Status::kOk);
  CHECK(with(1, 1) == Status::kBadParameter);
  CHECK(with(2, 1) == Status::kBadParameter);
  CHECK(with(std::nanf(""), 1) == Status::kBadParameter);
  CHECK(with(0, std::nanf("")) == Status::kBadParameter);
  CHECK(with(-HUGE_VALF, 1) == Status::kBadParameter);
}

}  // namespace

TEST_CASE("ranges below 0 and outside of what the sensor can measure are refused") {
  check_in_all_filters<LeaderRange<float, 6>>();
  check_in_all_filters<RangeBearing<float, 6>>();
  check_in_all_filters<RangeBearingElevation<float, 6>>();
}

TEST_CASE("limits of a range: the smallest is finite and below the largest") {
  check_parameters<LeaderRange<float, 6>>();
  check_parameters<RangeBearing<float, 6>>();
  check_parameters<RangeBearingElevation<float, 6>>();
}

TEST_CASE("stations and leaders so far that the format is coarse against their sigma are refused") {
  const float far = std::ldexp(1.0f, 22);  // half a unit in the last place is 0.25
  LeaderRange<float, 2> leader;
  RangeBearing<float, 2> station;
  station.params.sigma_range_m = 1;
  RangeBearingElevation<float, 6> usbl;
  usbl.params.sigma_range_m = 1;
  for (float* coordinate :
       {&leader.params.leader_x_m, &leader.params.leader_y_m, &station.params.station_x_m,
        &station.params.station_y_m, &usbl.params.station_x_m, &usbl.params.station_y_m,
        &usbl.params.station_z_m}) {
    const auto all = [&] {
      for (const Status status : {leader.check(), station.check(), usbl.check()}) {
        if (status != Status::kOk) return status;
      }
      return Status::kOk;
    };
    CHECK(all() == Status::kOk);
    *coordinate = -far;
    CHECK(all() == Status::kFarFromOrigin);
    *coordinate = far / 4;
    CHECK(all() == Status::kOk);
  }
  leader.params.leader_x_m = far;
  leader.params.sigma_leader_m = 10;  // the leader itself is not known better
  CHECK(leader.check() == Status::kOk);
}
