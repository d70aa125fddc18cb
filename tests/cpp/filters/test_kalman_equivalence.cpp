// On a linear model every filter is the Kalman filter; on any model the fast paths are the generic
// ones. The reference is a Kalman filter written from the textbook with Eigen.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>

#include "auvest/auvest.hpp"

namespace {

using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

constexpr int kN = 4;
constexpr int kM = 2;
using Process = auvest::LinearProcess<double, kN>;
using Sensor = auvest::LinearMeasurement<double, kN, kM>;
using State = Vector<double, kN>;
using Covariance = Matrix<double, kN, kN>;

/// The same process without any of its structure: sigma points are propagated.
struct OpaqueProcess : auvest::ProcessModel<OpaqueProcess, double, kN> {
  Process inner;
  explicit OpaqueProcess(const Process& p) : inner(p) {}
  State f(const State& x, double dt) const { return inner.f(x, dt); }
  Covariance Phi(const State& x, double dt) const { return inner.Phi(x, dt); }
  Covariance Q(double dt) const { return inner.Q(dt); }
};

struct OpaqueSensor : auvest::MeasurementModel<OpaqueSensor, double, kN, kM> {
  Sensor inner;
  explicit OpaqueSensor(const Sensor& s) : inner(s) {}
  Measurement h(const State& x) const { return inner.h(x); }
  Jacobian H(const State& x) const { return inner.H(x); }
  Noise R() const { return inner.R(); }
};

struct KalmanFilter {
  State x;
  Covariance P;
  double nis;
  void predict(const Process& p) {
    x = p.transition * x;
    P = p.transition * P * p.transition.transpose() + p.noise;
  }
  void update(const Vector<double, kM>& z, const Sensor& s) {
    const Vector<double, kM> r = z - s.matrix * x;
    const Matrix<double, kM, kM> S = s.matrix * P * s.matrix.transpose() + s.noise;
    const Matrix<double, kN, kM> K = P * s.matrix.transpose() * S.inverse();
    const Covariance a = Covariance::Identity() - K * s.matrix;
    x += K * r;
    P = a * P * a.transpose() + K * s.noise * K.transpose();  // Joseph form
    nis = r.dot(S.inverse() * r);
  }
};

// State 3 drives nothing and is never observed; Q > 0 lets its variance grow.
Process process() {
  Covariance phi;
  phi << 1, 0.5, 0, 0, 0, 1, 0.5, 0, 0, -0.1, 0.9, 0, 0, 0, 0, 1;
  Covariance q = 0.02 * Covariance::Identity();
  q(0, 1) = q(1, 0) = 0.005;
  return Process(phi, q);
}

Sensor sensor() {
  Matrix<double, kM, kN> h;
  h << 1, 0, 0.2, 0, 0, 0.5, 1, 0;
  Matrix<double, kM, kM> r;
  r << 0.3, 0.1, 0.1, 0.2;
  return Sensor(h, r);
}

template <class Filter, class AnySensor>
void check_equals_kalman(Filter filter, const AnySensor& any_sensor, double tolerance) {
  KalmanFilter reference;
  reference.x << 1, 2, 3, 4;
  reference.P = Covariance::Identity();
  reference.P(0, 3) = reference.P(3, 0) = 0.3;
  REQUIRE(filter.reset(reference.x, reference.P) == Status::kOk);
  Random random(5);
  for (int k = 0; k < 500; ++k) {
    reference.predict(process());
    REQUIRE(filter.predict(1) == Status::kOk);
    if (k % 7 != 3) {  // every seventh measurement is missing
      Vector<double, kM> z;
      z << 5 * random.normal<double>(), 5 * random.normal<double>();
      reference.update(z, sensor());
      const auto correction = filter.update(z, any_sensor);
      REQUIRE(correction.status == Status::kOk);
      CHECK(std::fabs(correction.nis - reference.nis) < tolerance * (1 + reference.nis));
    }
    CHECK((filter.x() - reference.x).cwiseAbs().maxCoeff() < tolerance);
    CHECK((filter.P() - reference.P).cwiseAbs().maxCoeff() < tolerance);
  }
  CHECK(reference.P(3, 3) > 10);  // the unobserved state was really left alone
}

auvest::SigmaPoints<double>::Params sigma(double alpha, double kappa) {
  auvest::SigmaPoints<double>::Params params;
  params.alpha = alpha;
  params.kappa = kappa;
  return params;
}

TEST_CASE("linear model: EKF, UKF and Kalman filter agree to 1e-10") {
  check_equals_kalman(auvest::Ekf<Process>(process()), sensor(), 1e-10);
  for (const double alpha : {1.0, 1e-3, 1e-6}) {
    check_equals_kalman(auvest::Ukf<Process>(process(), sigma(alpha, -1)), sensor(), 1e-10);
  }
  check_equals_kalman(auvest::Ukf<Process>(process(), sigma(1, 2)), sensor(), 1e-10);
}

TEST_CASE("linear model: the generic path is the Kalman filter too") {
  check_equals_kalman(auvest::Ekf<OpaqueProcess>(OpaqueProcess(process())), OpaqueSensor(sensor()),
                      1e-10);
  check_equals_kalman(auvest::Ukf<OpaqueProcess>(OpaqueProcess(process()), sigma(1, -1)),
                      OpaqueSensor(sensor()), 1e-10);
}

// ---- range and bearing: fast path against generic path ---------------------------------------

using Sonar = auvest::RangeBearing<double, 6>;
using Acceleration = auvest::ExactAcceleration<double>;

struct OpaqueSonar : auvest::MeasurementModel<OpaqueSonar, double, 6, 2> {
  Sonar inner;
  explicit OpaqueSonar(const Sonar& s) : inner(s) {}
  Measurement h(const State& x) const { return inner.h(x); }
  Noise R() const { return inner.R(); }
  Measurement residual(const Measurement& z, const Measurement& predicted) const {
    return inner.residual(z, predicted);
  }
};

struct OpaqueAcceleration : auvest::ProcessModel<OpaqueAcceleration, double, 6> {
  Acceleration inner;
  State f(const State& x, double dt) const { return inner.f(x, dt); }
  Covariance Q(double dt) const { return inner.Q(dt); }
};

TEST_CASE("UKF: two columns in closed form equal all columns by subtraction") {
  Sonar::Params params;
  params.sigma_range_m = 0.5;
  params.sigma_bearing_rad = 0.03;
  const Sonar sonar(params);
  for (const double kappa : {-3.0, 0.0}) {
    auvest::Ukf<Acceleration> fast(Acceleration(), sigma(1, kappa));
    auvest::Ukf<OpaqueAcceleration> generic(OpaqueAcceleration(), sigma(1, kappa));
    Vector<double, 6> x;
    x << -40, 2.5, 1, 0.5, 0, 0;  // close to the bearing's cut at y = 2
    Matrix<double, 6, 6> P = Matrix<double, 6, 6>::Identity();
    P(2, 0) = P(0, 2) = 0.5;
    REQUIRE(fast.reset(x, P) == Status::kOk);
    REQUIRE(generic.reset(x, P) == Status::kOk);
    Random random(9);
    for (int k = 0; k < 200; ++k) {
      const double angle = 3.14 + 0.01 * k;
      Vector<double, 6> truth = Vector<double, 6>::Zero();
      truth(0) = 0.2 + 40 * std::cos(angle);
      truth(1) = 2 + 40 * std::sin(angle);
      Vector<double, 2> z = sonar.h(truth);
      z(0) += 0.5 * random.normal<double>();
      z(1) += 0.03 * random.normal<double>();
      REQUIRE(fast.predict(0.5) == Status::kOk);
      REQUIRE(generic.predict(0.5) == Status::kOk);
      const auto a = fast.update(z, sonar);
      const auto b = generic.update(z, OpaqueSonar(sonar));
      REQUIRE(a.status == Status::kOk);
      REQUIRE(b.status == Status::kOk);
      REQUIRE_FALSE(a.near_field);
      CHECK((fast.x() - generic.x()).cwiseAbs().maxCoeff() < 1e-9);
      CHECK((fast.P() - generic.P()).cwiseAbs().maxCoeff() < 1e-9);
      CHECK(a.nis == close_to(b.nis, 1e-9));
    }
  }
}

TEST_CASE("UKF: a model without closed-form deviations limits alpha") {
  // c = alpha^2 (6 - 3); the limit is c^2 = epsilon: alpha = 7.05e-5 in double.
  Sonar sonar;
  for (const double alpha : {6.9e-5, 7.2e-5}) {
    auvest::Ukf<Acceleration> filter(Acceleration(), sigma(alpha, -3));
    Vector<double, 6> x;
    x << 5, 2, 0, 0, 0, 0;
    REQUIRE(filter.reset(x, 0.01 * Matrix<double, 6, 6>::Identity()) == Status::kOk);
    const Vector<double, 2> z(4.9, 0.01);
    const auto expected = alpha < 7e-5 ? Status::kAlphaTooSmall : Status::kOk;
    CHECK(filter.update(z, OpaqueSonar(sonar)).status == expected);
    auvest::Ukf<OpaqueAcceleration> opaque(OpaqueAcceleration(), sigma(alpha, -3));
    REQUIRE(opaque.reset(x, 0.01 * Matrix<double, 6, 6>::Identity()) == Status::kOk);
    CHECK(opaque.predict(1) == expected);
    if (expected != Status::kOk) CHECK(opaque.x() == x);
    CHECK(filter.update(z, sonar).status == Status::kOk);
  }
}

}  // namespace
