// The sonar's views: the three bearings, Jacobians against differences, the cut, one place.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>

#include "auvest/math/random.hpp"
#include "auvest/models/sonar.hpp"

namespace {

using auvest::Bearing;
using auvest::Vector;
using Sonar = auvest::Sonar<double>;

Sonar sonar_of(Bearing bearing) {
  Sonar::Params params;
  params.bearing = bearing;
  return Sonar(params);
}

template <int Pose>
Sonar::View<double, Pose> look(Bearing bearing, const Vector<double, Pose>& slave,
                               const Vector<double, 2>& master, const Vector<double, 2>& z) {
  Sonar::View<double, Pose> view;
  sonar_of(bearing).look(slave, master(0), master(1), z, view);
  return view;
}

TEST_CASE("sonar: what the three bearings mean") {
  const Vector<double, 3> slave(1, 2, 0.5);
  const Vector<double, 2> master(4, 6);
  const double direction = std::atan2(4, 3);
  const double pi = auvest::math::pi<double>();
  const Vector<double, 2> zero(0, 0);
  CHECK(look(Bearing::kSlaveToMaster, slave, master, zero).innovation(0) == -5);
  CHECK(look(Bearing::kSlaveToMaster, slave, master, zero).innovation(1) ==
        close_to(-direction, 1e-14));
  CHECK(look(Bearing::kMasterToSlave, slave, master, zero).innovation(1) ==
        close_to(pi - direction, 1e-14));
  CHECK(look(Bearing::kFromHeading, slave, master, zero).innovation(1) ==
        close_to(0.5 - direction, 1e-14));
}

template <int Pose>
void check_jacobians(Bearing bearing) {
  auvest::math::Random random(41);
  const double h = 1e-6;
  for (int trial = 0; trial < 50; ++trial) {
    Vector<double, Pose> slave;
    Vector<double, 2> master;
    Vector<double, 2> z;
    for (int i = 0; i < Pose; ++i) slave(i) = random.normal<double>();
    for (int i = 0; i < 2; ++i) master(i) = 5 * random.normal<double>();
    z(0) = 3;
    z(1) = random.normal<double>();
    const auto view = look(bearing, slave, master, z);
    for (int j = 0; j < Pose + 2; ++j) {
      auto slave_up = slave;
      auto slave_down = slave;
      auto master_up = master;
      auto master_down = master;
      if (j < Pose) {
        slave_up(j) += h;
        slave_down(j) -= h;
      } else {
        master_up(j - Pose) += h;
        master_down(j - Pose) -= h;
      }
      const auto up = look(bearing, slave_up, master_up, z).innovation;
      const auto down = look(bearing, slave_down, master_down, z).innovation;
      for (int i = 0; i < 2; ++i) {
        double difference = down(i) - up(i);  // of the prediction
        if (i == 1) difference = auvest::math::wrap(difference);
        const double found = j < Pose ? view.by_slave(i, j) : view.by_master(i, j - Pose);
        CHECK(std::fabs(found - difference / (2 * h)) < 1e-6);
      }
    }
  }
}

TEST_CASE("sonar: G_S and G_M are the Jacobians") {
  check_jacobians<2>(Bearing::kMasterToSlave);
  check_jacobians<2>(Bearing::kSlaveToMaster);
  check_jacobians<3>(Bearing::kMasterToSlave);
  check_jacobians<3>(Bearing::kFromHeading);
}

TEST_CASE("sonar: the innovation is wrapped across the cut") {
  const double pi = auvest::math::pi<double>();
  // Predicted: just below pi; measured: just above -pi.
  const Vector<double, 2> slave(0, 0);
  const Vector<double, 2> master(-10, 0.01);
  const auto view =
      look(Bearing::kSlaveToMaster, slave, master, Vector<double, 2>(10, -pi + 0.002));
  CHECK(view.innovation(1) == close_to(0.003, 1e-3));
}

TEST_CASE("sonar: slave and master at one place give numbers") {
  const Vector<double, 2> slave(3, 4);
  const auto view = look(Bearing::kMasterToSlave, slave, slave, Vector<double, 2>(1, 1));
  for (int i = 0; i < 2; ++i) {
    CHECK(std::isfinite(view.innovation(i)));
    for (int j = 0; j < 2; ++j) CHECK(view.by_master(i, j) == 0);
  }
}

TEST_CASE("sonar: bad parameters") {
  CHECK(sonar_of(Bearing::kMasterToSlave).check(2) == auvest::Status::kOk);
  CHECK(sonar_of(Bearing::kFromHeading).check(3) == auvest::Status::kOk);
  CHECK(sonar_of(Bearing::kFromHeading).check(2) == auvest::Status::kBadParameter);
  for (const double sigma : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    Sonar::Params params;
    params.sigma_range_m = sigma;
    CHECK(Sonar(params).check(2) == auvest::Status::kBadParameter);
    params = Sonar::Params();
    params.sigma_bearing_rad = sigma;
    CHECK(Sonar(params).check(2) == auvest::Status::kBadParameter);
  }
  // More than 1e-6, as documented.
  for (double Sonar::Params::*sigma :
       {&Sonar::Params::sigma_range_m, &Sonar::Params::sigma_bearing_rad}) {
    Sonar::Params params;
    for (const double too_small : {5e-7, 1e-6}) {
      params.*sigma = too_small;
      CHECK(Sonar(params).check(2) == auvest::Status::kBadParameter);
    }
    params.*sigma = 2e-6;
    CHECK(Sonar(params).check(2) == auvest::Status::kOk);
  }
}

}  // namespace
