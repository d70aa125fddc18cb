// The simulated sensors: what they read, when, and the statistics of their errors.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <initializer_list>
#include <vector>

#include "simulation/vehicle_sensors.hpp"

namespace {

using auvest::Reading;
using auvest::SensorTiming;
using auvest::VehicleSensor;
using auvest::VehicleTruth;
using auvest::math::Random;

constexpr double kDegree = 3.14159265358979323846 / 180;

VehicleTruth truth_at(double time_s) {
  VehicleTruth t;
  t.time_s = time_s;
  const double pose[6] = {30, 40, 5, 0.1, -0.05, 1};
  const double ground[6] = {1.6, 0.1, -0.05, 0.01, 0.02, 0.03};
  const double water[6] = {1.5, -0.1, 0.02, 0.01, 0.02, 0.03};
  for (int i = 0; i < 6; ++i) {
    t.pose[i] = pose[i];
    t.ground[i] = ground[i];
    t.water[i] = water[i];
  }
  t.velocity[0] = 3;
  t.velocity[1] = -4;
  return t;
}

/// Mean and standard deviation of one number of many readings.
template <class Device>
void statistics(const Device& device, int which, double& mean, double& deviation,
                SensorTiming timing = SensorTiming()) {
  VehicleSensor<Device> sensor(device, timing, Random(7, 3));
  double sum = 0, squares = 0;
  int count = 0;
  for (int k = 0; k < 20000; ++k) {
    sensor.ask(truth_at(k));
    Reading<Device::kSize> reading;
    while (sensor.take(1e9, reading)) {
      sum += reading.value[which];
      squares += reading.value[which] * reading.value[which];
      ++count;
    }
  }
  mean = sum / count;
  deviation = std::sqrt(squares / count - mean * mean);
}

TEST_CASE("sensors: white errors have the stated size, five standard errors wide") {
  double mean, deviation;
  auvest::CompassDevice compass;
  compass.bias_rad = 0;
  statistics(compass, 0, mean, deviation);
  CHECK(std::fabs(mean - 1) < 5 * 0.5 * kDegree / std::sqrt(20000.0));
  CHECK(deviation == close_to(0.5 * kDegree, 0.03));
  for (int i = 0; i < 3; ++i) {
    statistics(auvest::GyroDevice(), i, mean, deviation);
    CHECK(std::fabs(mean - 0.01 * (i + 1)) < 5 * 0.1 * kDegree / std::sqrt(20000.0));
    CHECK(deviation == close_to(0.1 * kDegree, 0.03));
    statistics(auvest::DvlDevice(), i, mean, deviation);
    CHECK(std::fabs(mean - truth_at(0).ground[i]) < 5 * 0.006 / std::sqrt(20000.0));
    CHECK(deviation == close_to(0.006, 0.03));
  }
  statistics(auvest::DepthDevice(), 0, mean, deviation);
  CHECK(std::fabs(mean - 5) < 5 * 0.02 / std::sqrt(20000.0));
  CHECK(deviation == close_to(0.02, 0.03));
  for (int i = 0; i < 2; ++i) {
    statistics(auvest::LogDevice(), i, mean, deviation);
    CHECK(std::fabs(mean - truth_at(0).water[i]) < 5 * 0.05 / std::sqrt(20000.0));
    CHECK(deviation == close_to(0.05, 0.03));
  }
  statistics(auvest::UsblDevice(), 0, mean, deviation);
  CHECK(std::fabs(mean - 50) < 5 * 0.3 / std::sqrt(20000.0));
  CHECK(deviation == close_to(0.3, 0.03));
  statistics(auvest::UsblDevice(), 1, mean, deviation);
  CHECK(std::fabs(mean - std::atan2(40, 30)) < 5 * kDegree / std::sqrt(20000.0));
  CHECK(deviation == close_to(kDegree, 0.03));
  statistics(auvest::AcousticRangeDevice(), 0, mean, deviation);
  CHECK(std::fabs(mean - 50) < 5 / std::sqrt(20000.0));
  CHECK(deviation == close_to(1, 0.03));
}

/// The one reading of a device without white noise.
template <class Device>
Reading<Device::kSize> read_once(Device device) {
  VehicleSensor<Device> sensor(device, SensorTiming(), Random(1, 1));
  sensor.ask(truth_at(2));
  Reading<Device::kSize> reading;
  REQUIRE(sensor.take(1e9, reading));
  return reading;
}

TEST_CASE("sensors: systematic errors, one by one") {
  auvest::CompassDevice compass;
  compass.bias_rad = compass.noise_rad = 0;
  compass.hard_iron_rad[0] = 0.01;
  compass.hard_iron_rad[1] = 0.02;
  compass.soft_iron_rad[0] = 0.03;
  compass.soft_iron_rad[1] = 0.04;
  const double iron =
      0.01 * std::sin(1) + 0.02 * std::cos(1) + 0.03 * std::sin(2) + 0.04 * std::cos(2);
  CHECK(read_once(compass).value[0] == close_to(1 + iron, 1e-12));

  auvest::LogDevice log;
  log.noise_m_s = 0;
  log.scale = 0.02;
  CHECK(read_once(log).value[0] == close_to(1.53, 1e-12));

  auvest::DvlDevice dvl;
  dvl.noise_m_s = 0;
  dvl.misalignment_rad = 0.1;
  CHECK(read_once(dvl).value[0] == close_to(1.6 * std::cos(0.1) + 0.1 * std::sin(0.1), 1e-12));
  CHECK(read_once(dvl).value[1] == close_to(0.1 * std::cos(0.1) - 1.6 * std::sin(0.1), 1e-12));
  dvl.misalignment_rad = 0;
  dvl.bottom_track = false;
  CHECK(read_once(dvl).value[0] == 1.5);

  auvest::UsblDevice usbl;
  usbl.noise_m = usbl.noise_rad = 0;
  usbl.relative = true;
  CHECK(read_once(usbl).value[1] == close_to(std::atan2(40, 30) - 1, 1e-12));

  auvest::AcousticRangeDevice range;
  range.noise_m = 0;
  range.sound_scale = 0.01;
  range.exchange_s = 0.75;
  const Reading<1> reading = read_once(range);
  CHECK(reading.value[0] == close_to(50.5, 1e-12));
  CHECK(reading.valid_s == 2);
  CHECK(reading.arrival_s == 2.75);
}

TEST_CASE("sensors: the offset of a run is drawn once, and is another in the next") {
  auvest::CompassDevice compass;
  compass.noise_rad = 0;
  double sum = 0;
  for (std::uint64_t run = 0; run < 2000; ++run) {
    VehicleSensor<auvest::CompassDevice> sensor(compass, SensorTiming(), Random(1, run));
    double first = 0;
    for (int k = 0; k < 3; ++k) {
      sensor.ask(truth_at(k));
      Reading<1> reading;
      REQUIRE(sensor.take(1e9, reading));
      if (k == 0) first = reading.value[0];
      CHECK(reading.value[0] == first);
    }
    sum += (first - 1) * (first - 1);
  }
  CHECK(std::sqrt(sum / 2000) == close_to(kDegree, 0.08));
}

TEST_CASE("sensors: a gyro's bias walks") {
  auvest::GyroDevice gyro;
  gyro.noise_rad_s = 0;
  gyro.walk_rad_s = 1e-4;
  double squares = 0;
  for (std::uint64_t run = 0; run < 500; ++run) {
    VehicleSensor<auvest::GyroDevice> sensor(gyro, SensorTiming(), Random(1, run));
    Reading<3> reading;
    for (int k = 0; k < 100; ++k) {
      sensor.ask(truth_at(k));
      REQUIRE(sensor.take(1e9, reading));
    }
    squares += (reading.value[2] - 0.03) * (reading.value[2] - 0.03);
  }
  CHECK(std::sqrt(squares / 500) == close_to(1e-4 * 10, 0.15));
}

TEST_CASE("sensors: outliers are late, by an exponential, as often as stated") {
  auvest::UsblDevice usbl;
  usbl.noise_m = 0;
  usbl.outliers = 0.05;
  VehicleSensor<auvest::UsblDevice> sensor(usbl, SensorTiming(), Random(5, 5));
  int outliers = 0;
  double sum = 0;
  for (int k = 0; k < 40000; ++k) {
    sensor.ask(truth_at(k));
    Reading<2> reading;
    REQUIRE(sensor.take(1e9, reading));
    const double late = reading.value[0] - 50;
    CHECK(late >= 0);
    if (late > 0) {
      ++outliers;
      sum += late;
    }
  }
  CHECK(outliers == close_to(2000, 0.12));  // five standard deviations
  CHECK(sum / outliers == close_to(20, 0.12));
}

TEST_CASE("sensors: an answer takes its time: valid on its way out, known when it is back") {
  auvest::UsblDevice usbl;
  usbl.noise_m = usbl.noise_rad = 0;
  usbl.sound_m_s = 1500;
  VehicleSensor<auvest::UsblDevice> sensor(usbl, SensorTiming(), Random(1, 1));
  sensor.ask(truth_at(2));
  Reading<2> reading;
  const double delay = 50.0 / 1500;
  CHECK(!sensor.take(2 + 2 * delay - 1e-3, reading));
  REQUIRE(sensor.take(2 + 2 * delay, reading));
  CHECK(reading.valid_s == close_to(2 + delay, 1e-12));
  CHECK(reading.arrival_s == close_to(2 + 2 * delay, 1e-12));
  // Where it then is: at 3 m/s north and 4 m/s west.
  CHECK(reading.value[0] == close_to(std::hypot(30 + 3 * delay, 40 - 4 * delay), 1e-12));
}

TEST_CASE("sensors: clock, latency and order of arrival") {
  auvest::DepthDevice depth;
  SensorTiming timing;
  timing.period_s = 0.5;
  timing.latency_s = 0.7;
  VehicleSensor<auvest::DepthDevice> sensor(depth, timing, Random(1, 1));
  std::vector<double> valid;
  std::vector<double> taken;
  for (int k = 0; k <= 30; ++k) {
    const double now = 0.1 * k;
    sensor.sample(truth_at(now));
    Reading<1> reading;
    while (sensor.take(now, reading)) {
      valid.push_back(reading.valid_s);
      taken.push_back(now);
    }
  }
  REQUIRE(valid.size() == 5);  // of 0, 0.5, 1, 1.5 and 2 s; that of 2.5 s is on its way
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(valid[i] == doctest::Approx(0.5 * static_cast<double>(i)));
    CHECK(taken[i] == doctest::Approx(0.5 * static_cast<double>(i) + 0.7));
  }
}

TEST_CASE("sensors: lost readings, and no lock of the Doppler log, leave the others as they were") {
  SensorTiming lossy;
  lossy.dropout = 0.3;
  VehicleSensor<auvest::LogDevice> whole(auvest::LogDevice(), SensorTiming(), Random(2, 2));
  VehicleSensor<auvest::LogDevice> torn(auvest::LogDevice(), lossy, Random(2, 2));
  int lost = 0;
  for (int k = 0; k < 10000; ++k) {
    whole.ask(truth_at(k));
    torn.ask(truth_at(k));
    Reading<2> a, b;
    REQUIRE(whole.take(1e9, a));
    if (torn.take(1e9, b)) {
      CHECK(a.value[0] == b.value[0]);
      CHECK(a.value[1] == b.value[1]);
    } else {
      ++lost;
    }
  }
  CHECK(lost == close_to(3000, 0.08));

  for (const double seabed : {5.5, 5.8, 94.0, 96.0}) {  // the vehicle is at 5 m
    auvest::DvlDevice dvl;
    dvl.seabed_m = seabed;
    VehicleSensor<auvest::DvlDevice> sensor(dvl, SensorTiming(), Random(1, 1));
    sensor.ask(truth_at(0));
    Reading<3> reading;
    CHECK(sensor.take(1e9, reading) == (seabed > 5.7 && seabed < 95));
    dvl.bottom_track = false;
    VehicleSensor<auvest::DvlDevice> water(dvl, SensorTiming(), Random(1, 1));
    water.ask(truth_at(0));
    CHECK(water.take(1e9, reading));
  }
}

}  // namespace
