// From a wanted force to thrusts.
#include "auvest/vehicle/allocation.hpp"

#include <Eigen/SVD>
#include <limits>

#include "close.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;
using auvest::Status;
using auvest::Vector;

template <class Scalar>
Vector<Scalar, 6> force(double x, double y, double z, double k, double m, double n) {
  Vector<Scalar, 6> tau;
  tau << Scalar(x), Scalar(y), Scalar(z), Scalar(k), Scalar(m), Scalar(n);
  return tau;
}

TEST_CASE_TEMPLATE("pseudo-inverse: of the least norm, zero for zero, linear", Scalar, float,
                   double) {
  const Rov<Scalar> hull(auvest::bluerov2_heavy<Scalar>());
  const auto& thrusters = hull.vehicle().thrusters;
  const auto& T = thrusters.matrix();
  const auto allocation = auvest::allocation_of(thrusters);
  REQUIRE(allocation.check() == Status::kOk);
  const auto& B = allocation.inverse();
  const double epsilon = double(std::numeric_limits<Scalar>::epsilon());
  const double first[6] = {0.3536, -0.3536, 0, 0, 0, -1.3242};
  const double fifth[6] = {-0.1771, -0.0975, -0.25, -1.1468, 2.0833, 0};
  for (int j = 0; j < 6; ++j) {
    CHECK(std::fabs(double(B(0, j)) - first[j]) <= 0.5001e-4);
    CHECK(std::fabs(double(B(4, j)) - fifth[j]) <= 0.5001e-4);
  }
  const Eigen::MatrixXd t = T.template cast<double>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(t, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const auto& s = svd.singularValues();
  CHECK(s(0) / s(5) == doctest::Approx(8.364).epsilon(1e-4));
  const Eigen::MatrixXd expected =
      svd.matrixV() * s.cwiseInverse().asDiagonal() * svd.matrixU().transpose();
  CHECK((B.template cast<double>() - expected).norm() < 100 * epsilon);

  const auto zero = allocation.allocate(force<Scalar>(0, 0, 0, 0, 0, 0));
  CHECK(!zero.saturated);
  for (int i = 0; i < 8; ++i) CHECK(zero.thrust(i) == Scalar(0));
  Uniform uniform;
  for (int k = 0; k < 200; ++k) {
    Vector<Scalar, 6> a, b;
    for (int i = 0; i < 6; ++i) {
      a(i) = Scalar((i < 3 ? 5 : 1) * uniform());
      b(i) = Scalar((i < 3 ? 5 : 1) * uniform());
    }
    const auto fa = allocation.allocate(a), fb = allocation.allocate(b);
    const Vector<Scalar, 6> sum = a + b;
    const auto fs = allocation.allocate(sum);
    CHECK(!fs.saturated);
    CHECK(((T * fa.thrust - a).template cast<double>()).norm() < 100 * epsilon * 10);
    CHECK((fs.thrust - fa.thrust - fb.thrust).template cast<double>().norm() < 100 * epsilon * 10);
  }
}

TEST_CASE_TEMPLATE("saturation: attitude first, and no demand changes its direction", Scalar, float,
                   double) {
  const Rov<Scalar> hull(auvest::bluerov2_heavy<Scalar>());
  const auto& thrusters = hull.vehicle().thrusters;
  const auto& T = thrusters.matrix();
  const auto allocation = auvest::allocation_of(thrusters);
  const double epsilon = 1000 * double(std::numeric_limits<Scalar>::epsilon());
  const auto result = allocation.allocate(force<Scalar>(300, 100, 10, 1, 2, 5));
  CHECK(result.saturated);
  CHECK(result.scale[0] == Scalar(1));
  CHECK(result.scale[1] == Scalar(1));
  CHECK(double(result.scale[2]) > 0.1);
  CHECK(double(result.scale[2]) < 1);
  const Eigen::Matrix<double, 6, 1> given = (T * result.thrust).template cast<double>();
  const double s = double(result.scale[2]);
  const double expected[6] = {300 * s, 100 * s, 10, 1, 2, 5};
  for (int i = 0; i < 6; ++i) CHECK(std::fabs(given(i) - expected[i]) < 100 * epsilon);
  // As much as there is room for: one thruster is at its limit.
  double largest = 0;
  for (int i = 0; i < 8; ++i) largest = std::max(largest, std::fabs(double(result.thrust(i))));
  CHECK(largest == doctest::Approx(double(thrusters.curve.highest())).epsilon(1e-6));

  // Of one level: one scale for all.
  auto params = allocation.params;
  for (auto& level : params.priority) level = 0;
  const auvest::Allocation<Scalar, 8> level(allocation.inverse(), params);
  const auto together = level.allocate(force<Scalar>(300, 100, 10, 1, 2, 5));
  const double all = double(together.scale[0]);
  CHECK(all < 1);
  const Eigen::Matrix<double, 6, 1> scaled = (T * together.thrust).template cast<double>();
  const double wanted[6] = {300, 100, 10, 1, 2, 5};
  for (int i = 0; i < 6; ++i) CHECK(std::fabs(scaled(i) - all * wanted[i]) < 100 * epsilon);

  // A demand beyond every thruster leaves nothing for those behind it.
  const auto spinning = allocation.allocate(force<Scalar>(10, 0, 0, 0, 0, 1000));
  CHECK(double(spinning.scale[0]) < 0.1);
  CHECK(std::fabs(double((T * spinning.thrust)(5))) > 20);
  for (int i = 0; i < 8; ++i) {
    CHECK(spinning.thrust(i) <= thrusters.curve.highest());
    CHECK(spinning.thrust(i) >= thrusters.curve.lowest());
  }
}

TEST_CASE("saturation: the weaker side of an asymmetric thruster counts") {
  const Rov<double> hull(auvest::bluerov2_heavy<double>());
  const auto allocation = auvest::allocation_of(hull.vehicle().thrusters);
  auto params = allocation.params;
  params.lowest_n = -10;
  params.highest_n = 40;
  const auvest::Allocation<double, 8> weak(allocation.inverse(), params);
  const auto down = weak.allocate(force<double>(0, 0, 80, 0, 0, 0));  // all four push down
  CHECK(down.scale[1] == doctest::Approx(0.5));
  const auto up = weak.allocate(force<double>(0, 0, -80, 0, 0, 0));
  CHECK(up.scale[1] == 1);
  CHECK(!up.saturated);
}

TEST_CASE("redistribution: what saturated thrusters cannot give, others do") {
  const Rov<double> hull(auvest::bluerov2_heavy<double>());
  const auto& T = hull.vehicle().thrusters.matrix();
  const auto allocation = auvest::allocation_of(hull.vehicle().thrusters);
  const double high = 30.62;
  Vector<double, 8> f;
  int found = 0, saturated = 0;
  Uniform uniform;
  for (int k = 0; k < 2000; ++k) {
    // A feasible demand by construction: thrusts within the limits, not of least norm.
    Vector<double, 8> any;
    for (int i = 0; i < 8; ++i) any(i) = high * uniform();
    const Vector<double, 6> tau = T * any;
    if (!allocation.allocate(tau).saturated) continue;
    ++saturated;
    if (!auvest::redistribute(T, tau, -high, high, f)) continue;
    ++found;
    CHECK((T * f - tau).norm() < 1e-10);
    CHECK(f.cwiseAbs().maxCoeff() <= high);
  }
  CHECK(saturated > 50);
  CHECK(found > saturated / 4);  // it is a heuristic: not every feasible demand is found
  // The vertical thrusters have one way to push without effect, (1, -1, -1, 1): of the thrusts that
  // give this demand those of least norm have 33.7 N of the first of them. Held at its limit, it
  // leaves one solution.
  Vector<double, 8> only;
  only << 0, 0, 0, 0, high, 28, 20, 5;
  REQUIRE(auvest::redistribute(T, Vector<double, 6>(T * only), -high, high, f));
  for (int i = 0; i < 8; ++i) CHECK(std::fabs(f(i) - only(i)) < 1e-12);
  Vector<double, 6> beyond = force<double>(500, 0, 0, 0, 0, 0);
  CHECK(!auvest::redistribute(T, beyond, -high, high, f));
}

TEST_CASE_TEMPLATE("weights move thrust to where it is cheap", Scalar, float, double) {
  const Rov<Scalar> hull(auvest::bluerov2_heavy<Scalar>());
  const auto& T = hull.vehicle().thrusters.matrix();
  Vector<Scalar, 8> inverse_weights;
  for (int i = 0; i < 8; ++i) inverse_weights(i) = Scalar(1);
  inverse_weights(4) = Scalar(0.25);
  const auto B = auvest::pseudo_inverse(T, inverse_weights);
  const Vector<Scalar, 6> tau = force<Scalar>(3, 1, -8, 0.1, 0.2, 0.3);
  const Vector<Scalar, 8> f = B * tau;
  CHECK((T * f - tau).template cast<double>().norm() < 1e-4);
  const Eigen::Matrix<double, 6, 8> t = T.template cast<double>();
  const Eigen::Matrix<double, 8, 1> w = inverse_weights.template cast<double>();
  const Eigen::Matrix<double, 6, 6> S = t * w.asDiagonal() * t.transpose();
  const Eigen::Matrix<double, 8, 1> expected =
      w.asDiagonal() * t.transpose() * S.ldlt().solve(tau.template cast<double>());
  for (int i = 0; i < 8; ++i) CHECK(double(f(i)) == close_to(expected(i), 1e-4));
}

TEST_CASE_TEMPLATE("six thrusters: pitch follows surge, and its own demand is given up", Scalar,
                   float, double) {
  using Body = auvest::Hull<auvest::Rov<Scalar, 6>>;
  const Body hull(auvest::bluerov2<Scalar>());
  REQUIRE(hull.check() == Status::kOk);
  const auto& T = hull.vehicle().thrusters.matrix();
  const auto allocation = auvest::allocation_of(hull.vehicle().thrusters);
  const auto result = allocation.allocate(force<Scalar>(10, 2, -5, 0.3, 4, 0.5));
  CHECK(!result.saturated);
  const Eigen::Matrix<double, 6, 1> given = (T * result.thrust).template cast<double>();
  const double expected[6] = {10, 2, -5, 0.3, 0.85, 0.5};  // pitch: 0.085 m times surge
  for (int i = 0; i < 6; ++i) CHECK(std::fabs(given(i) - expected[i]) < 1e-4);
  const auto pitch = allocation.allocate(force<Scalar>(0, 0, 0, 0, 4, 0));
  for (int i = 0; i < 6; ++i) CHECK(pitch.thrust(i) == Scalar(0));
}

TEST_CASE("the horizontal thrusters alone tip the ROV over beyond 15.5 N of surge") {
  const auto p = auvest::bluerov2_heavy<double>();
  CHECK(p.restoring.buoyancy_n * 0.01 / 0.085 == doctest::Approx(15.48).epsilon(1e-3));
  const Rov<double> hull(p);
  const auto still = current<Rov<double>>(0, 0, 0);
  const auto& curve = hull.vehicle().thrusters.curve;
  const auto pitch_after = [&](double surge) {
    Rov<double>::State x = Rov<double>::State::Zero();
    Rov<double>::Command c = Rov<double>::Command::Zero();
    const double each = surge / 4 * std::sqrt(2.0);
    const double sign[4] = {1, 1, -1, -1};
    for (int i = 0; i < 4; ++i) c(i) = curve.input(sign[i] * each);
    double largest = 0;
    for (int k = 0; k < 3000; ++k) {
      if (auvest::advance<auvest::Rk4>(hull, x, c, still, 0.01) != Status::kOk) return 90.0;
      largest = std::max(largest, std::fabs(x(4)) / kDegree);
    }
    return largest;
  };
  CHECK(pitch_after(5) < 45);
  CHECK(pitch_after(16) == 90);
}

TEST_CASE("allocation: bad parameters are reported") {
  const Rov<double> hull(auvest::bluerov2_heavy<double>());
  const auto good = auvest::allocation_of(hull.vehicle().thrusters);
  CHECK(good.check() == Status::kOk);
  const auto changed = [&](void (*change)(auvest::Allocation<double, 8>::Params&)) {
    auto p = good.params;
    change(p);
    return auvest::Allocation<double, 8>(good.inverse(), p).check();
  };
  using P = auvest::Allocation<double, 8>::Params;
  CHECK(changed([](P& p) { p.lowest_n = 0; }) == Status::kBadParameter);
  CHECK(changed([](P& p) { p.highest_n = -1; }) == Status::kBadParameter);
  CHECK(changed([](P& p) { p.priority[3] = 6; }) == Status::kBadParameter);
  auto inverse = good.inverse();
  inverse(7, 5) = std::numeric_limits<double>::quiet_NaN();
  CHECK(auvest::Allocation<double, 8>(inverse, good.params).check() == Status::kBadParameter);
}

}  // namespace
