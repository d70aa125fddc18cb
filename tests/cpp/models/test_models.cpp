// One suite for every model: registering a line below gives Jacobian, deviations, wrap-around and
// noiseless convergence checks.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/body_velocity.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"
#include "auvest/models/depth.hpp"
#include "auvest/models/heading_speed.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/linear.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/odometry_constants.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/position.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/range_bearing_elevation.hpp"
#include "auvest/models/scaled_range.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/models/white_acceleration.hpp"

namespace {

using auvest::Belief;
using auvest::Matrix;
using auvest::Vector;
using auvest::math::Random;

template <int N>
Vector<double, N> random_state(Random& random, double scale) {
  Vector<double, N> x;
  for (int i = 0; i < N; ++i) x(i) = scale * random.normal<double>();
  return x;
}

template <class Model>
void check_process(const Model& model, double dt) {
  constexpr int n = Model::kStates;
  Random random(7);
  for (int trial = 0; trial < 20; ++trial) {
    const auto x = random_state<n>(random, 10);
    // Phi is the Jacobian of f: central differences, exact but for rounding where f is linear.
    const auto phi = model.Phi(x, dt);
    const double step = 1e-4;
    for (int j = 0; j < n; ++j) {
      Vector<double, n> up = x;
      Vector<double, n> down = x;
      up(j) += step;
      down(j) -= step;
      const Vector<double, n> slope = (model.f(up, dt) - model.f(down, dt)) / (2 * step);
      for (int i = 0; i < n; ++i) CHECK(std::fabs(phi(i, j) - slope(i)) < 1e-7);
    }
    // propagate is Phi P Phi' + Q, written from the structure of Phi.
    Belief<double, n> belief;
    Matrix<double, n, n> a;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) a(i, j) = random.normal<double>();
    }
    belief.x = x;
    belief.P = a * a.transpose();
    const Matrix<double, n, n> expected = phi * belief.P * phi.transpose() + model.Q(dt);
    const auto next = model.f(x, dt);
    model.propagate(belief, dt);
    for (int i = 0; i < n; ++i) {
      CHECK(std::fabs(belief.x(i) - next(i)) <= 1e-12 * std::fabs(next(i)));
      for (int j = 0; j <= i; ++j) {
        CHECK(std::fabs(belief.P(i, j) - expected(i, j)) < 1e-13 * expected.trace());
      }
    }
    // Q is symmetric and positive semidefinite: v' Q v >= 0.
    const auto q = model.Q(dt);
    const auto v = random_state<n>(random, 1);
    CHECK((q - q.transpose()).cwiseAbs().maxCoeff() == 0);
    CHECK(v.dot(q * v) >= 0);
  }
}

template <class Model>
void check_measurement(const Model& model, double scale) {
  constexpr int n = Model::kStates;
  constexpr int m = Model::kSize;
  constexpr int o = Model::kObserved;
  Random random(11);
  for (int trial = 0; trial < 50; ++trial) {
    const auto x = random_state<n>(random, scale);
    const auto point = model.about(x);
    // The expansion's value is h.
    for (int i = 0; i < m; ++i) CHECK(point.value()(i) == model.h(x)(i));
    // H is the Jacobian of h, residuals taken as the model takes them.
    const auto jacobian = model.H(x);
    const double step = 1e-5 * scale;
    for (int j = 0; j < n; ++j) {
      Vector<double, n> up = x;
      Vector<double, n> down = x;
      up(j) += step;
      down(j) -= step;
      const auto difference = model.residual(model.h(up), model.h(down));
      for (int i = 0; i < m; ++i) {
        const double slope = difference(i) / (2 * step);
        CHECK(std::fabs((j < o ? jacobian(i, j) : 0.0) - slope) < 1e-5);
      }
    }
    // Deviations are those of h, for steps so large that subtraction keeps enough digits.
    for (const double size : {1.0, 0.1, 1e-3}) {
      typename Model::ObservedState e;
      for (int i = 0; i < o; ++i) e(i) = size * scale * 0.1 * random.normal<double>();
      typename Model::Measurement sum;
      typename Model::Measurement difference;
      point.deviations(e, sum, difference);
      typename Model::State plus = x;
      typename Model::State minus = x;
      for (int i = 0; i < o; ++i) {
        plus(i) += e(i);
        minus(i) -= e(i);
      }
      const auto d_plus = model.residual(model.h(plus), model.h(x));
      const auto d_minus = model.residual(model.h(minus), model.h(x));
      for (int i = 0; i < m; ++i) {
        CHECK(std::fabs(sum(i) - (d_plus(i) + d_minus(i))) < 1e-13 * scale + 1e-14);
        CHECK(std::fabs(difference(i) - (d_plus(i) - d_minus(i))) < 1e-13 * scale + 1e-14);
      }
    }
  }
}

/// position_variance is the trace of the position block, of so many axes, that propagate gives.
template <int Axes, class Model>
void check_position_variance(const Model& model) {
  constexpr int n = Model::kStates;
  Random random(5);
  Belief<double, n> belief;
  Matrix<double, n, n> a;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) a(i, j) = random.normal<double>();
  }
  belief.x.setZero();
  belief.P = a * a.transpose();
  const Belief<double, n> before = belief;
  model.propagate(belief, 0.7);
  double trace = 0;
  for (int i = 0; i < Axes; ++i) trace += belief.P(i, i);
  CHECK(model.position_variance(before, 0.7) == close_to(trace, 1e-14));
}

/// A filter fed with noise-free measurements of a target that moves as its process does must end
/// on it, in as many leading states as `offset` has.
template <class Filter, int Axes, class... Models>
void check_convergence(Filter filter, typename Filter::State truth,
                       const Vector<double, Axes>& offset, const Models&... models) {
  typename Filter::State x = truth;
  for (int i = 0; i < Axes; ++i) x(i) += offset(i);
  REQUIRE(filter.reset(x, Filter::Covariance::Identity()) == auvest::Status::kOk);
  for (int k = 0; k < 400; ++k) {
    truth = filter.process().f(truth, 0.5);
    REQUIRE(filter.predict(0.5) == auvest::Status::kOk);
    const bool updated[] = {filter.update(models.h(truth), models).status ==
                            auvest::Status::kOk...};
    for (const bool done : updated) REQUIRE(done);
  }
  for (int i = 0; i < Axes; ++i) CHECK(std::fabs(filter.x()(i) - truth(i)) < 1e-3);
}

/// A linear model's update is the textbook's, K = P H' (H P H' + R)^-1, in any Gaussian filter.
template <template <class> class Filter, class Process, class Model>
void check_textbook(const Process& process, const Model& model, double tolerance) {
  constexpr int n = Model::kStates;
  constexpr int m = Model::kSize;
  Random random(17);
  Matrix<double, n, n> a;
  Vector<double, n> x;
  for (int i = 0; i < n; ++i) {
    x(i) = random.normal<double>();
    for (int j = 0; j < n; ++j) a(i, j) = random.normal<double>();
  }
  const Matrix<double, n, n> P = a * a.transpose() + Matrix<double, n, n>::Identity();
  Vector<double, m> z;
  for (int i = 0; i < m; ++i) z(i) = 2 * random.normal<double>();
  Matrix<double, m, n> H = Matrix<double, m, n>::Zero();
  H.template leftCols<Model::kObserved>() =
      model.H(x.template cast<typename Model::Scalar>()).template cast<double>();
  const Matrix<double, m, m> S = H * P * H.transpose() + model.R().template cast<double>();
  const Matrix<double, n, m> K = P * H.transpose() * S.inverse();
  const Vector<double, m> innovation = z - H * x;

  using Scalar = typename Model::Scalar;
  Filter<Process> filter{process};
  REQUIRE(filter.reset(x.template cast<Scalar>(), P.template cast<Scalar>()) ==
          auvest::Status::kOk);
  const auto correction = filter.update(z.template cast<Scalar>(), model);
  REQUIRE(correction.status == auvest::Status::kOk);
  CHECK((filter.x().template cast<double>() - (x + K * innovation)).norm() < tolerance * x.norm());
  CHECK((filter.P().template cast<double>() - (P - K * S * K.transpose())).norm() <
        tolerance * P.norm());
  CHECK(double(correction.nis) ==
        close_to(innovation.dot(S.inverse() * innovation), 10 * tolerance));
}

template <class Process, class Model>
void check_textbook(const Process& process, const Model& model) {
  const double tolerance = sizeof(typename Model::Scalar) == 4 ? 2e-6 : 1e-12;
  check_textbook<auvest::Ekf>(process, model, tolerance);
  check_textbook<auvest::Ukf>(process, model, tolerance);
}

/// `model` driven: 2 m/s (m) ahead, 0.5 to the side, at 0.7 rad.
template <class Model>
Model driven(Model model) {
  model.input << 2, 0.5, 0.7;
  return model;
}

template <int N>
auvest::LeaderRange<double, N> leader(double x_m, double y_m) {
  typename auvest::LeaderRange<double, N>::Params p;
  p.leader_x_m = x_m;
  p.leader_y_m = y_m;
  p.sigma_range_m = 3;
  p.sigma_leader_m = 4;
  return auvest::LeaderRange<double, N>(p);
}

auvest::RangeBearing<double, 6> sonar() {
  auvest::RangeBearing<double, 6>::Params p;
  p.station_x_m = 0.2;
  p.station_y_m = 2;
  return auvest::RangeBearing<double, 6>(p);
}

template <class Scalar, int Axes>
auvest::WhiteAcceleration<Scalar, Axes> drifting() {
  typename auvest::WhiteAcceleration<Scalar, Axes>::Params p;
  p.velocity = Scalar(0.3);
  p.vertical_velocity = Scalar(0.02);
  return auvest::WhiteAcceleration<Scalar, Axes>(p);
}

/// A fix with errors that are correlated. Only the lower triangle of its covariance is given.
template <class Scalar, int N, int M>
auvest::Position<Scalar, N, M> fix() {
  const double lower[3][3] = {{4, 0, 0}, {-1.5, 2, 0}, {0.5, 0.7, 1}};
  typename auvest::Position<Scalar, N, M>::Params p;
  for (int i = 0; i < M; ++i) {
    for (int j = 0; j < M; ++j) p.covariance_m2(i, j) = Scalar(j > i ? std::nan("") : lower[i][j]);
  }
  return auvest::Position<Scalar, N, M>(p);
}

template <class Scalar, int N>
auvest::Depth<Scalar, N> depth() {
  typename auvest::Depth<Scalar, N>::Params p;
  p.sigma_m = Scalar(0.3);
  return auvest::Depth<Scalar, N>(p);
}

template <class Scalar, int N, int Axes>
auvest::BodyVelocity<Scalar, N, Axes> log_at(double heading_rad) {
  typename auvest::BodyVelocity<Scalar, N, Axes>::Params p;
  p.heading_rad = Scalar(heading_rad);
  p.sigma_forward_m_s = Scalar(0.5);
  p.sigma_sideways_m_s = Scalar(0.8);
  p.sigma_vertical_m_s = Scalar(0.2);
  return auvest::BodyVelocity<Scalar, N, Axes>(p);
}

template <class Scalar>
auvest::RangeBearingElevation<Scalar, 6> usbl(double x_m, double y_m, double z_m) {
  typename auvest::RangeBearingElevation<Scalar, 6>::Params p;
  p.station_x_m = Scalar(x_m);
  p.station_y_m = Scalar(y_m);
  p.station_z_m = Scalar(z_m);
  return auvest::RangeBearingElevation<Scalar, 6>(p);
}

TEST_CASE("process models") {
  check_process(auvest::EulerAcceleration<double>(), 0.5);
  check_process(auvest::PiecewiseAcceleration<double>(), 0.7);
  check_process(auvest::ExactAcceleration<double>(), 0.5);
  check_process(auvest::ExactAcceleration<double>(), 30);
  check_process(auvest::ConstantVelocity<double>(), 0.7);
  auvest::CoordinatedTurn<double>::Params turn;
  turn.slow_m_s = 5;  // the random states turn by up to 2 rad/s
  check_process(auvest::CoordinatedTurn<double>(turn), 0.5);
  check_process(auvest::CoordinatedTurn<double>(turn), 0.01);  // its series
  check_process(driven(auvest::SpeedHeading<double>()), 0.5);
  check_process(driven(auvest::SpeedHeading<double, true>()), 0.5);
  check_process(driven(auvest::SpeedHeading<double, false, true>()), 0.5);
  check_process(driven(auvest::SpeedHeading<double, true, true>()), 0.5);
  check_process(driven(auvest::SpeedHeadingCurrent<double>()), 0.5);
  check_process(driven(auvest::Odometry<double>()), 0.5);
  auvest::OdometryConstants<double>::Params off;
  off.speed_state = 4;
  off.turn_state = 6;
  off.walk_0 = 0.3;
  check_process(driven(auvest::OdometryConstants<double>(off)), 0.5);
  check_process(drifting<double, 2>(), 0.7);
  check_process(drifting<double, 3>(), 0.7);
  Matrix<double, 3, 3> phi;
  phi << 1, 0.5, 0, 0, 1, 0.5, 0.1, 0, 0.9;
  check_process(auvest::LinearProcess<double, 3>(phi, Matrix<double, 3, 3>::Identity()), 1);
}

TEST_CASE("measurement models") {
  check_measurement(sonar(), 100);
  check_measurement(leader<4>(30, -20), 100);
  auvest::ScaledRange<double, 8>::Params off;
  off.leader_x_m = 30;
  off.scale_state = 4;
  off.offset_state = 7;
  check_measurement(auvest::ScaledRange<double, 8>(off), 1);
  check_measurement(fix<double, 2, 2>(), 100);
  check_measurement(fix<double, 6, 3>(), 100);
  check_measurement(depth<double, 3>(), 100);
  check_measurement(auvest::HeadingSpeed<double, 8>(), 1);
  check_measurement(log_at<double, 6, 2>(2.5), 10);
  check_measurement(log_at<double, 6, 3>(-0.7), 10);
  check_measurement(usbl<double>(3, -2, 5), 100);
  Matrix<double, 2, 3> h;
  h << 1, -1, 0.5, 0, 2, 1;
  check_measurement(auvest::LinearMeasurement<double, 5, 2, 3>(h, Matrix<double, 2, 2>::Identity()),
                    10);
}

TEST_CASE("noiseless convergence, also across the bearing's cut") {
  using Process = auvest::ExactAcceleration<double>;
  for (const double y : {-5.0, 2.0, 2.01, 1.99}) {  // y = 2 with x < 0.2: bearing pi
    Vector<double, 6> truth = Vector<double, 6>::Zero();
    truth(0) = -8;
    truth(1) = y;
    const Vector<double, 2> offset(0.3, -0.2);
    check_convergence(auvest::Ekf<Process>(Process()), truth, offset, sonar());
    check_convergence(auvest::Ukf<Process>(Process()), truth, offset, sonar());
  }
}

TEST_CASE("constant acceleration: Eq. (4) has no dt^2/2 term, the exact model has") {
  Vector<double, 6> x;
  x << 1, 2, 3, 4, 5, 6;
  const auto euler = auvest::EulerAcceleration<double>().f(x, 2);
  const auto exact = auvest::ExactAcceleration<double>().f(x, 2);
  const double expected_euler[6] = {7, 10, 13, 16, 5, 6};
  const double expected_exact[6] = {17, 22, 13, 16, 5, 6};
  for (int i = 0; i < 6; ++i) {
    CHECK(euler(i) == expected_euler[i]);
    CHECK(exact(i) == expected_exact[i]);
  }
}

TEST_CASE("constant acceleration: exact steps compose, Euler steps do not") {
  // Two exact steps of 1 s are one of 2 s, in the mean, in Phi P Phi' and in Q
  // (Chapman-Kolmogorov).
  const auvest::ExactAcceleration<double> model;
  Belief<double, 6> twice;
  twice.x << 1, 2, 3, 4, 5, 6;
  twice.P = Matrix<double, 6, 6>::Identity();
  Belief<double, 6> once = twice;
  model.propagate(twice, 1);
  model.propagate(twice, 1);
  model.propagate(once, 2);
  for (int i = 0; i < 6; ++i) {
    CHECK(twice.x(i) == close_to(once.x(i), 1e-14));
    for (int j = 0; j <= i; ++j) {
      CHECK(std::fabs(twice.P(i, j) - once.P(i, j)) <= 1e-13 * std::fabs(once.P(i, j)));
    }
  }
}

TEST_CASE("position_variance is the trace that propagate would give") {
  check_position_variance<2>(auvest::EulerAcceleration<double>());
  check_position_variance<2>(auvest::ExactAcceleration<double>());
  check_position_variance<2>(drifting<double, 2>());
  check_position_variance<2>(driven(auvest::SpeedHeadingCurrent<double>()));
  check_position_variance<3>(drifting<double, 3>());
}

TEST_CASE("constant velocity: an acceleration has no memory, but where no time passes") {
  const auvest::ConstantVelocity<double> model;
  Belief<double, 6> belief;
  belief.x << 1, 2, 3, 4, 5, 6;
  belief.P = Matrix<double, 6, 6>::Identity();
  belief.P(4, 0) = 0.5;
  const Belief<double, 6> before = belief;
  model.propagate(belief, 0);
  CHECK(belief.x == before.x);
  CHECK(belief.P == before.P);
  model.propagate(belief, 2);
  CHECK(belief.x == (Vector<double, 6>() << 7, 10, 3, 4, 0, 0).finished());
  CHECK(belief.P(4, 0) == 0);
  CHECK(belief.P(4, 4) ==
        model.params.sigma_acceleration_m_s2 * model.params.sigma_acceleration_m_s2);
  // White noise of density q over dt: q dt^3/3, q dt^2/2, q dt (and the motion of P itself).
  CHECK(belief.P(0, 0) == close_to(1 + 4 + 1e-4 * 8 / 3, 1e-14));
  CHECK(belief.P(2, 0) == close_to(2 + 1e-4 * 4 / 2, 1e-14));
  CHECK(belief.P(2, 2) == close_to(1 + 1e-4 * 2, 1e-14));
}

TEST_CASE("nearly constant velocity: z has a density of its own, and steps compose") {
  const auto space = drifting<double, 3>();
  const auto q = space.Q(2);
  for (int i = 0; i < 3; ++i) {
    const double density = i < 2 ? 0.3 : 0.02;
    CHECK(q(i, i) == close_to(density * 8 / 3, 1e-14));
    CHECK(q(i + 3, i) == close_to(density * 4 / 2, 1e-14));
    CHECK(q(i + 3, i + 3) == close_to(density * 2, 1e-14));
    for (int j = 0; j < 6; ++j) {
      if (j % 3 != i) CHECK(q(j, i) == 0);
    }
  }
  // Two steps are one (Chapman-Kolmogorov), and x and y are those of the model in the plane.
  Random random(5);
  Belief<double, 6> once;
  Matrix<double, 6, 6> a;
  for (int i = 0; i < 6; ++i) {
    once.x(i) = random.normal<double>();
    for (int j = 0; j < 6; ++j) a(i, j) = random.normal<double>();
  }
  once.P = a * a.transpose();
  Belief<double, 6> twice = once;
  Belief<double, 4> plane;
  const int where[4] = {0, 1, 3, 4};
  for (int i = 0; i < 4; ++i) {
    plane.x(i) = once.x(where[i]);
    for (int j = 0; j < 4; ++j) plane.P(i, j) = once.P(where[i], where[j]);
  }
  space.propagate(once, 5);
  space.propagate(twice, 2);
  space.propagate(twice, 3);
  drifting<double, 2>().propagate(plane, 5);
  for (int i = 0; i < 6; ++i) {
    CHECK(std::fabs(twice.x(i) - once.x(i)) < 1e-14 * once.x.norm());
    for (int j = 0; j <= i; ++j) {
      CHECK(std::fabs(twice.P(i, j) - once.P(i, j)) < 1e-14 * once.P.trace());
    }
  }
  for (int i = 0; i < 4; ++i) {
    CHECK(plane.x(i) == once.x(where[i]));
    for (int j = 0; j <= i; ++j) CHECK(plane.P(i, j) == once.P(where[i], where[j]));
  }
}

TEST_CASE("dead reckoning in a current: by hand, steps compose, and fixes find the current") {
  auvest::SpeedHeadingCurrent<double> model;
  model.input << 2, 0.5, auvest::math::half_pi<double>();  // east, starboard is south
  Belief<double, 4> once;
  once.x << 10, 20, 0.25, -0.125;
  once.P = Matrix<double, 4, 4>::Identity();
  Belief<double, 4> twice = once;
  model.propagate(once, 4);
  CHECK(once.x(0) == close_to(10 + 4 * (-0.5 + 0.25), 1e-14));
  CHECK(once.x(1) == close_to(20 + 4 * (2 - 0.125), 1e-14));
  CHECK(once.x(2) == 0.25);
  CHECK(once.x(3) == -0.125);
  // Position noise q dt and the walk of the current, q_c (dt^3/3, dt^2/2, dt).
  CHECK(once.P(0, 0) == close_to(1 + 16 + 0.004 * 4 + 1e-5 * 64 / 3, 1e-14));
  CHECK(once.P(2, 0) == close_to(4 + 1e-5 * 16 / 2, 1e-14));
  CHECK(once.P(2, 2) == close_to(1 + 1e-5 * 4, 1e-14));
  model.propagate(twice, 1.5);
  model.propagate(twice, 2.5);
  for (int i = 0; i < 4; ++i) {
    CHECK(twice.x(i) == close_to(once.x(i), 1e-14));
    for (int j = 0; j <= i; ++j) CHECK(std::fabs(twice.P(i, j) - once.P(i, j)) < 1e-13);
  }
  // Noise-free fixes on a vehicle that turns: the current, of which nothing was known.
  using Process = auvest::SpeedHeadingCurrent<double>;
  auvest::Ekf<Process> filter{Process()};
  Vector<double, 4> start(3, -2, 0, 0);
  REQUIRE(filter.reset(start, Matrix<double, 4, 4>::Identity()) == auvest::Status::kOk);
  Vector<double, 4> truth(0, 0, 0.25, -0.125);
  for (int k = 0; k < 600; ++k) {
    model.input << 1.5, 0.1, 0.01 * k;
    truth = model.f(truth, 0.5);
    REQUIRE(filter.predict(0.5, model.input) == auvest::Status::kOk);
    REQUIRE(filter.update(truth.head<2>(), fix<double, 4, 2>()).status == auvest::Status::kOk);
  }
  CHECK((filter.x() - truth).norm() < 1e-3);
}

template <class Scalar>
void check_circle(double tolerance) {
  // 5 m/s on a circle of 20 m about (0, 0), counter-clockwise and clockwise.
  typename auvest::CoordinatedTurn<Scalar>::Params params;
  params.slow_m_s = Scalar(1e-4);
  const auvest::CoordinatedTurn<Scalar> model(params);
  for (const double omega : {0.25, -0.25}) {
    const auto on_circle = [omega](double angle) {
      const double c = 20 * std::cos(angle), s = 20 * std::sin(angle), square = omega * omega;
      return (Vector<Scalar, 6>() << Scalar(c), Scalar(s), Scalar(-omega * s), Scalar(omega * c),
              Scalar(-square * c), Scalar(-square * s))
          .finished();
    };
    for (const double dt : {1e-3, 0.1, 1.0, 7.0, 30.0}) {  // up to 7.5 rad
      const auto found = model.f(on_circle(1), Scalar(dt));
      const auto expected = on_circle(1 + omega * dt);
      for (int i = 0; i < 6; ++i) {
        CHECK(std::fabs(static_cast<double>(found(i) - expected(i))) < tolerance);
      }
    }
  }
}

TEST_CASE("coordinated turn: exact on a circle; straight on it is constant acceleration") {
  check_circle<double>(1e-7);  // the share of v_0: (1e-4 / 5)^2 of the angle
  check_circle<float>(3e-5);
  Vector<double, 6> x;
  x << 1, 2, 3, 4, 0.6, 0.8;  // acceleration along the velocity
  const auto straight = auvest::ExactAcceleration<double>().f(x, 0.7);
  CHECK((auvest::CoordinatedTurn<double>().f(x, 0.7) - straight).norm() < 1e-14);
  x << 1, 2, 0, 0, 0.6, 0.8;  // standing
  const auto start = auvest::ExactAcceleration<double>().f(x, 0.7);
  CHECK((auvest::CoordinatedTurn<double>().f(x, 0.7) - start).norm() < 1e-14);
}

TEST_CASE("position: the textbook's update, with every process that begins with x and y") {
  check_textbook(auvest::SpeedHeading<double>(), fix<double, 2, 2>());
  check_textbook(auvest::Odometry<double>(), fix<double, 3, 2>());
  check_textbook(auvest::SpeedHeading<double, true, true>(), fix<double, 4, 2>());
  check_textbook(drifting<double, 2>(), fix<double, 4, 2>());
  check_textbook(auvest::SpeedHeadingCurrent<double>(), fix<double, 4, 2>());
  check_textbook(auvest::ExactAcceleration<double>(), fix<double, 6, 2>());
  check_textbook(auvest::CoordinatedTurn<double>(), fix<double, 6, 2>());
  check_textbook(drifting<double, 3>(), fix<double, 6, 2>());
  check_textbook(drifting<double, 3>(), fix<double, 6, 3>());
  check_textbook(auvest::Odometry<float>(), fix<float, 3, 2>());
  check_textbook(drifting<float, 3>(), fix<float, 6, 3>());
}

TEST_CASE("depth: the textbook's update; what is not correlated with z stays") {
  check_textbook(drifting<double, 3>(), depth<double, 6>());
  check_textbook(drifting<float, 3>(), depth<float, 6>());
  using Process = auvest::WhiteAcceleration<double, 3>;
  auvest::Ekf<Process> filter{Process()};
  Vector<double, 6> x;
  x << 10, -20, 30, 1, 2, 0;
  Matrix<double, 6, 6> P = Matrix<double, 6, 6>::Identity();
  P(1, 0) = P(0, 1) = 0.5;
  P(3, 2) = P(2, 3) = 0.25;  // vx with z
  REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
  // S = 1 + 0.09; K_z = 1 / S, K_vx = 0.25 / S.
  REQUIRE(filter.update(Vector<double, 1>(31.09), depth<double, 6>()).status ==
          auvest::Status::kOk);
  CHECK(filter.x()(2) == close_to(31, 1e-14));
  CHECK(filter.x()(3) == close_to(1.25, 1e-14));
  for (const int i : {0, 1, 4, 5}) {
    CHECK(filter.x()(i) == x(i));
    for (int j = 0; j < 6; ++j) CHECK(std::fabs(filter.P()(i, j) - P(i, j)) < 1e-15);
  }
}

TEST_CASE("body velocity: its axes by hand, and the textbook's update") {
  // Heading along +y, moving along +y and a little along -x, which is 90 degrees further on.
  const double half_pi = auvest::math::half_pi<double>();
  Vector<double, 6> x;
  x << 100, 200, -0.25, 1.5, 0, 0;
  const auto plane = log_at<double, 6, 2>(half_pi).h(x);
  CHECK(plane(0) == close_to(1.5, 1e-15));
  CHECK(plane(1) == close_to(0.25, 1e-15));
  x << 100, 200, 300, -0.25, 1.5, 0.125;
  const auto space = log_at<double, 6, 3>(half_pi).h(x);
  CHECK(space(0) == close_to(1.5, 1e-15));
  CHECK(space(1) == close_to(0.25, 1e-15));
  CHECK(space(2) == 0.125);
  check_textbook(auvest::ExactAcceleration<double>(), log_at<double, 6, 2>(2.5));
  check_textbook(drifting<double, 2>(), log_at<double, 4, 2>(-2.5));
  check_textbook(drifting<double, 3>(), log_at<double, 6, 3>(0.7));
  check_textbook(drifting<float, 3>(), log_at<float, 6, 3>(0.7));
}

TEST_CASE("sensors in space: together they find a moving vehicle") {
  using Process = auvest::WhiteAcceleration<double, 3>;
  const Process process;
  Vector<double, 6> truth;
  truth << 40, -30, 20, 0.7, -0.4, 0.1;
  const Vector<double, 3> offset(0.3, -0.2, 0.5);
  check_convergence(auvest::Ekf<Process>(process), truth, offset, fix<double, 6, 3>());
  check_convergence(auvest::Ukf<Process>(process), truth, offset, fix<double, 6, 2>(),
                    depth<double, 6>(), log_at<double, 6, 3>(2));
  // What is made for a plane sees the first two of its states.
  check_convergence(auvest::Ukf<Process>(process), truth, offset, sonar(), depth<double, 6>());
  auto west = leader<6>(-300, 50);
  auto north = leader<6>(60, 200);
  west.params.sigma_range_m = north.params.sigma_range_m = 0.1;
  west.params.sigma_leader_m = north.params.sigma_leader_m = 0;
  check_convergence(auvest::Ekf<Process>(process), truth, offset, west, north, depth<double, 6>());
}

TEST_CASE("range and bearing: closed second differences against their Taylor series") {
  // The sum d+ + d- is of second order: for small e it must keep its own digits, in float too.
  Random random(13);
  for (int trial = 0; trial < 200; ++trial) {
    auvest::RangeBearing<float, 6>::Params p;
    p.station_x_m = 0;
    p.station_y_m = 0;
    const auvest::RangeBearing<float, 6> model(p);
    Vector<float, 6> x = Vector<float, 6>::Zero();
    x(0) = 500.0f * random.normal<float>();
    x(1) = 500.0f * random.normal<float>();
    Vector<float, 2> e;
    e(0) = 1e-5f * random.normal<float>();
    e(1) = 1e-5f * random.normal<float>();
    Vector<float, 2> sum;
    Vector<float, 2> difference;
    model.about(x).deviations(e, sum, difference);

    // Second-order Taylor terms, right to 1e-14 relative at |e| / |D| of 1e-7.
    const double dx = double(x(0)), dy = double(x(1)), ex = double(e(0)), ey = double(e(1));
    const double r = std::hypot(dx, dy);
    const double along = (dx * ex + dy * ey) / r;
    const double across = (dx * ey - dy * ex) / r;
    const double range_sum = across * across / r;
    const double bearing_sum = -2 * along * across / (r * r);
    // p and q carry the rounding of two products each, relative to |e|; the sums are products of
    // them. 16 ulp of float on the scale of |e|^2 covers that chain of about ten operations.
    const double tolerance = 16 * 6e-8 * (ex * ex + ey * ey);
    CHECK(std::fabs(double(sum(0)) - range_sum) < tolerance / r);
    CHECK(std::fabs(double(sum(1)) - bearing_sum) < 2 * tolerance / (r * r));
    CHECK(std::fabs(double(difference(0)) - 2 * along) < 16 * 6e-8 * std::hypot(ex, ey));
    CHECK(std::fabs(double(difference(1)) - 2 * across / r) < 16 * 6e-8 * std::hypot(ex, ey) / r);
  }
}

TEST_CASE("range and bearing: sigma points beyond the station") {
  // |e| > |D|: the far point lies on the other side of the station (w <= 0).
  auvest::RangeBearing<double, 6>::Params p;
  p.station_x_m = 0;
  p.station_y_m = 0;
  const auvest::RangeBearing<double, 6> model(p);
  Vector<double, 6> x = Vector<double, 6>::Zero();
  x(0) = 1;
  for (const double angle : {0.3, 1.0, 2.0, 3.0, -0.7, -2.9}) {
    Vector<double, 2> e;
    e << 3 * std::cos(angle), 3 * std::sin(angle);
    Vector<double, 2> sum;
    Vector<double, 2> difference;
    model.about(x).deviations(e, sum, difference);
    const double r_plus = std::hypot(1 + e(0), e(1));
    const double r_minus = std::hypot(1 - e(0), e(1));
    const double b_plus = std::atan2(e(1), 1 + e(0));
    const double b_minus = std::atan2(-e(1), 1 - e(0));
    CHECK(sum(0) == close_to(r_plus + r_minus - 2, 1e-14));
    CHECK(difference(0) == close_to(r_plus - r_minus, 1e-14));
    CHECK(sum(1) == close_to(b_plus + b_minus, 1e-13));
    CHECK(difference(1) == close_to(b_plus - b_minus, 1e-13));
  }
}

TEST_CASE("range and bearing: the near field begins where the belief reaches the station") {
  const auto model = sonar();
  Belief<double, 6> belief;
  belief.x.setZero();
  belief.x(0) = 0.2 + 1;  // 1 m from the station
  belief.x(1) = 2;
  belief.P.setIdentity();
  const Vector<double, 2> z(1.1, 0.4);
  Vector<double, 2> innovation;
  Matrix<double, 2, 2> noise;
  belief.P(0, 0) = 0.01;
  belief.P(1, 1) = 0.029;  // sqrt(P_xx + P_yy) = 0.9874 m / 5
  const auto point = model.about(belief.x);
  CHECK_FALSE(model.near_field(point, belief.P, z, innovation, noise));
  belief.P(1, 1) = 0.031;  // 1.0124 m / 5
  REQUIRE(model.near_field(point, belief.P, z, innovation, noise));
  // The measured position minus the believed one.
  CHECK(innovation(0) == close_to(1.1 * std::cos(0.4) - 1, 1e-12));
  CHECK(innovation(1) == close_to(1.1 * std::sin(0.4), 1e-12));

  // Of 0: what lies less than 1e-15 m from the station, which has no bearing.
  auto none = model;
  none.params.near_field = none.params.station_x_m = none.params.station_y_m = 0;
  belief.x.setZero();
  belief.x(0) = 2e-15;
  CHECK_FALSE(none.near_field(none.about(belief.x), belief.P, z, innovation, noise));
  belief.x(0) = 0.5e-15;
  CHECK(none.near_field(none.about(belief.x), belief.P, z, innovation, noise));
}

TEST_CASE("range and bearing: covariance of the position form, by Monte Carlo" *
          doctest::test_suite("statistics")) {
  // Mean square error of the form along and across the measured direction, over 4e5 draws, divided
  // by what R says there. Expected: along, sigma_r^2 + E r^2 (1 - cos v_b)^2 with 3/4 sigma_b^4 as
  // the leading term of the second factor; across, r^2 E sin^2 v_b against (E r_measured^2 +
  // sigma_r^2) sigma_b^2 = (r^2 + 2 sigma_r^2) sigma_b^2. Statistical error of a mean square: 0.3
  // %.
  auvest::RangeBearing<double, 6>::Params p;
  p.station_x_m = 0;
  p.station_y_m = 0;
  struct Case {
    double range, sigma_range, sigma_bearing;
  };
  for (const Case& c : {Case{2, 0.3, 0.2}, Case{2, 0.01, 0.3}, Case{0.1, 0.1, 0.2}}) {
    p.sigma_range_m = c.sigma_range;
    p.sigma_bearing_rad = c.sigma_bearing;
    const auvest::RangeBearing<double, 6> model(p);
    Random random(3);
    const int n = 400000;
    double along = 0, across = 0, r_along = 0, r_across = 0;
    for (int k = 0; k < n; ++k) {
      double v_r = 0, v_b = 0;
      random.normal_pair(v_r, v_b);
      const Vector<double, 2> z(c.range + c.sigma_range * v_r, c.sigma_bearing * v_b);
      Belief<double, 6> belief;
      belief.x.setZero();
      belief.x(0) = c.range;
      belief.P.setIdentity();
      Vector<double, 2> innovation = Vector<double, 2>::Zero();
      Matrix<double, 2, 2> noise = Matrix<double, 2, 2>::Zero();
      REQUIRE(model.near_field(model.about(belief.x), belief.P, z, innovation, noise));
      const double cosine = std::cos(z(1)), sine = std::sin(z(1));
      const double u = cosine * innovation(0) + sine * innovation(1);
      const double v = -sine * innovation(0) + cosine * innovation(1);
      along += u * u / n;
      across += v * v / n;
      r_along += (cosine * cosine * noise(0, 0) + 2 * cosine * sine * noise(1, 0) +
                  sine * sine * noise(1, 1)) /
                 n;
      r_across += (sine * sine * noise(0, 0) - 2 * cosine * sine * noise(1, 0) +
                   cosine * cosine * noise(1, 1)) /
                  n;
    }
    const double r2 = c.range * c.range;
    const double s2 = c.sigma_range * c.sigma_range;
    const double b2 = c.sigma_bearing * c.sigma_bearing;
    // E (1 - cos v)^2 = 3/2 - 2 e^(-b2/2) + e^(-2 b2)/2 and E sin^2 v = (1 - e^(-2 b2)) / 2.
    const double bow = 1.5 - 2 * std::exp(-b2 / 2) + 0.5 * std::exp(-2 * b2);
    CHECK(along == close_to(s2 + r2 * bow, 0.01));
    CHECK(across == close_to(r2 * 0.5 * (1 - std::exp(-2 * b2)), 0.01));
    CHECK(r_along == close_to(s2 + 0.75 * (r2 + s2) * b2 * b2, 0.01));
    CHECK(r_across == close_to((r2 + 2 * s2) * b2, 0.01));
  }
}

/// Range, bearing and elevation from the origin.
Vector<long double, 3> seen(const Vector<long double, 3>& d) {
  const long double level = std::hypot(d(0), d(1));
  return Vector<long double, 3>(std::hypot(level, d(2)), std::atan2(d(1), d(0)),
                                std::atan2(d(2), level));
}

template <class Scalar>
void check_deviations_in_space() {
  // Against differences of long doubles, from deviations far beyond the vertical through the
  // station to small ones, on the scale of the transform: |u| = |e_o| / rho for the bearing and
  // what of the range and the elevation comes with it, |e| / |D| for the rest. 32 ulp cover the
  // chain of about twenty operations; long double itself leaves 1e-18.
  const auto model = usbl<Scalar>(0, 0, 0);
  const long double pi = 3.14159265358979323846L;
  const double ulp = double(std::numeric_limits<Scalar>::epsilon());
  Random random(13);
  for (int trial = 0; trial < 3000; ++trial) {
    const double size = std::pow(10.0, 1 - trial % 6);
    Vector<Scalar, 6> x = Vector<Scalar, 6>::Zero();
    for (int i = 0; i < 3; ++i) x(i) = Scalar(100 * random.normal<double>());
    const double rho = std::hypot(double(x(0)), double(x(1)));
    Vector<Scalar, 3> e;
    for (int i = 0; i < 3; ++i) e(i) = Scalar(size * rho * random.normal<double>());
    Vector<Scalar, 3> sum;
    Vector<Scalar, 3> difference;
    model.about(x).deviations(e, sum, difference);

    const Vector<long double, 3> d = x.template head<3>().template cast<long double>();
    const Vector<long double, 3> step = e.template cast<long double>();
    const Vector<long double, 3> centre = seen(d);
    Vector<long double, 3> plus = seen(d + step) - centre;
    Vector<long double, 3> minus = seen(d - step) - centre;
    for (auto* turned : {&plus, &minus}) {
      if ((*turned)(1) > pi) (*turned)(1) -= 2 * pi;
      if ((*turned)(1) < -pi) (*turned)(1) += 2 * pi;
    }
    const double u = double(step.norm()) / rho;
    const double first = 32 * ulp * std::fmin(u, 1.0);
    const double second = 32 * ulp * std::fmin(u * u, 1.0);
    const double range = double(centre(0));
    const double unit[3] = {range * std::fmax(u, 1.0), 1, 1};  // lengths grow with e, angles do not
    for (int i = 0; i < 3; ++i) {
      const auto sum_error = static_cast<long double>(sum(i)) - (plus(i) + minus(i));
      const auto difference_error = static_cast<long double>(difference(i)) - (plus(i) - minus(i));
      CHECK(std::fabs(double(sum_error)) < (second + 1e-18) * unit[i]);
      CHECK(std::fabs(double(difference_error)) < (first + 1e-18) * unit[i]);
    }
  }
}

TEST_CASE("range, bearing and elevation: closed deviations against long double") {
  check_deviations_in_space<double>();
  check_deviations_in_space<float>();
}

TEST_CASE("range, bearing and elevation: their signs, and across the bearing's cut") {
  Vector<double, 6> x;
  x << 1 + 3, 2 + 4, 3 + 12, 0, 0, 0;
  const auto z = usbl<double>(1, 2, 3).h(x);
  CHECK(z(0) == close_to(13, 1e-15));
  CHECK(z(1) == close_to(std::atan2(4, 3), 1e-15));
  CHECK(z(2) == close_to(std::atan2(12, 5), 1e-15));  // towards +z
  const auto turned = usbl<double>(1, 2, 3).residual({1, 3, 3}, {1, -3, -3});
  CHECK(turned(1) == close_to(6 - 2 * auvest::math::pi<double>(), 1e-14));
  CHECK(turned(2) == close_to(6 - 2 * auvest::math::pi<double>(), 1e-14));

  using Process = auvest::WhiteAcceleration<double, 3>;
  const Vector<double, 3> offset(0.3, -0.2, 0.5);
  for (const double y : {-5.0, 2.0, 2.01, 1.99}) {  // y = 2 with x < 0.2: bearing pi
    Vector<double, 6> truth = Vector<double, 6>::Zero();
    truth(0) = -8;
    truth(1) = y;
    truth(2) = 6;
    check_convergence(auvest::Ekf<Process>(Process()), truth, offset, usbl<double>(0.2, 2, 15));
    check_convergence(auvest::Ukf<Process>(Process()), truth, offset, usbl<double>(0.2, 2, 15));
  }
  // Straight above the station, in the near field.
  Vector<double, 6> above = Vector<double, 6>::Zero();
  above(2) = 20;
  check_convergence(auvest::Ekf<Process>(Process()), above, offset, usbl<double>(0, 0, 5));
  check_convergence(auvest::Ukf<Process>(Process()), above, offset, usbl<double>(0, 0, 5));
}

template <class Filter>
void check_vertical(Filter filter, double height_m, double near_field) {
  using Scalar = typename Filter::Scalar;
  auto model = usbl<Scalar>(0, 0, 0);
  model.params.near_field = Scalar(near_field);
  typename Filter::State x = Filter::State::Zero();
  x(2) = Scalar(height_m);
  REQUIRE(filter.reset(x, Filter::Covariance::Identity()) == auvest::Status::kOk);
  const double elevation = std::atan2(height_m, 0.1);
  const Vector<Scalar, 3> z(Scalar(std::hypot(height_m, 0.1)), Scalar(2), Scalar(elevation));
  const auto correction = filter.update(z, model);
  REQUIRE(correction.status == auvest::Status::kOk);
  CHECK(correction.near_field);
  CHECK(auvest::math::all_finite(filter.belief()));
  // On the way to where it was measured, 0.1 m off in the direction of 2 rad.
  CHECK(filter.x()(0) < Scalar(0));
  CHECK(filter.x()(1) > Scalar(0));
  CHECK(filter.P()(0, 0) < Scalar(1));
  const auto before = filter.belief();
  const Scalar nan = Scalar(std::nan(""));
  CHECK(filter.update({z(0), nan, z(2)}, model).status == auvest::Status::kNotFinite);
  CHECK(filter.x() == before.x);
}

TEST_CASE("range, bearing and elevation: above, below and at the station") {
  using Double = auvest::WhiteAcceleration<double, 3>;
  using Float = auvest::WhiteAcceleration<float, 3>;
  for (const double height : {20.0, -20.0, 0.0}) {
    for (const double near_field : {5.0, 0.0}) {
      check_vertical(auvest::Ekf<Double>(Double()), height, near_field);
      check_vertical(auvest::Ukf<Double>(Double()), height, near_field);
      check_vertical(auvest::Ekf<Float>(Float()), height, near_field);
      check_vertical(auvest::Ukf<Float>(Float()), height, near_field);
    }
  }
}

TEST_CASE("range, bearing and elevation: where the near field begins") {
  const auto model = usbl<double>(0, 0, 0);
  const auto is_near = [&model](const Vector<double, 3>& d, double p_xy, double p_z) {
    Belief<double, 6> belief;
    belief.x.setZero();
    belief.x.head<3>() = d;
    belief.P.setIdentity();
    belief.P(0, 0) = belief.P(1, 1) = p_xy;
    belief.P(2, 2) = p_z;
    Vector<double, 3> innovation;
    Matrix<double, 3, 3> noise;
    return model.near_field(model.about(belief.x), belief.P, {1, 0, 0}, innovation, noise);
  };
  // 1 m from the vertical, 5 sqrt(P_xx + P_yy) = 0.99 and 1.01 m.
  CHECK_FALSE(is_near({0.6, 0.8, 50}, 0.5 * 0.99 * 0.99 / 25, 1));
  CHECK(is_near({0.6, 0.8, 50}, 0.5 * 1.01 * 1.01 / 25, 1));
  // 10 m from the station, 5 sqrt(P_xx + P_yy + P_zz) = 9.9 and 10.1 m.
  CHECK_FALSE(is_near({8, 0, 6}, 0.5, 9.9 * 9.9 / 25 - 1));
  CHECK(is_near({8, 0, 6}, 0.5, 10.1 * 10.1 / 25 - 1));
}

TEST_CASE("range, bearing and elevation: covariance of the position form, by Monte Carlo" *
          doctest::test_suite("statistics")) {
  // Mean square error of the form over the positions that a given measurement may come from, along
  // n, m, b and k.
  struct Case {
    double elevation, sigma_range, sigma_bearing, sigma_elevation;
  };
  for (const Case& c : {Case{0.5, 0.1, 0.2, 0.01}, Case{0.5, 0.1, 0.01, 0.2},
                        Case{-0.5, 0.1, 0.2, 0.2}, Case{1.4, 30, 0.1, 0.1}, Case{0, 1, 0.2, 0.1}}) {
    auto model = usbl<double>(1, 2, 3);
    model.params.sigma_range_m = c.sigma_range;
    model.params.sigma_bearing_rad = c.sigma_bearing;
    model.params.sigma_elevation_rad = c.sigma_elevation;
    const double r = 30, bearing = 2.5;
    const double sb = std::sin(bearing), cb = std::cos(bearing);
    const double se = std::sin(c.elevation), ce = std::cos(c.elevation);
    Belief<double, 6> belief;
    belief.x << 1.5, 2.5, 4, 0, 0, 0;
    belief.P.setIdentity();
    Vector<double, 3> innovation;
    Matrix<double, 3, 3> noise;
    REQUIRE(model.near_field(model.about(belief.x), belief.P, {r, bearing, c.elevation}, innovation,
                             noise));
    const Vector<double, 3> centre(r * ce * cb, r * ce * sb, r * se);
    CHECK((innovation - (centre - Vector<double, 3>(0.5, 0.5, 1))).norm() < 1e-13);
    Matrix<double, 3, 3> square = Matrix<double, 3, 3>::Zero();
    Random random(3);
    const int count = 200000;
    for (int k = 0; k < count; ++k) {
      const double range = r - c.sigma_range * random.normal<double>();
      const double b = bearing - c.sigma_bearing * random.normal<double>();
      const double e = c.elevation - c.sigma_elevation * random.normal<double>();
      const Vector<double, 3> error =
          centre - range * Vector<double, 3>(std::cos(e) * std::cos(b), std::cos(e) * std::sin(b),
                                             std::sin(e));
      square += error * error.transpose() / count;
    }
    // What is left out, of sixth order in the angles, makes the form too wide by up to 2 sigma^2 =
    // 8 %, never too narrow; statistical error: 0.3 to 1 %.
    for (const Vector<double, 3>& direction :
         {Vector<double, 3>(ce * cb, ce * sb, se), Vector<double, 3>(-se * cb, -se * sb, ce),
          Vector<double, 3>(-sb, cb, 0), Vector<double, 3>(cb, sb, 0)}) {
      const double ratio = direction.dot(noise * direction) / direction.dot(square * direction);
      CHECK(ratio > 0.985);
      CHECK(ratio < 1.09);
    }
    CHECK((noise - noise.transpose()).norm() == 0);
    CHECK((noise - square).norm() < 0.08 * square.norm());
  }
}

template <class Scalar>
Vector<double, 6> tracked_by_usbl() {
  using Process = auvest::WhiteAcceleration<Scalar, 3>;
  auto params = auvest::Ukf<Process>::default_params();
  params.alpha = Scalar(1e-6);  // deviations by subtraction would have no digit left in float
  auvest::Ukf<Process> filter(Process(), params);
  Vector<double, 6> truth;
  truth << 400, -300, 60, 1, 0.5, -0.1;
  Vector<Scalar, 6> x = truth.cast<Scalar>();
  x(0) += Scalar(20);
  REQUIRE(filter.reset(x, 400 * Matrix<Scalar, 6, 6>::Identity()) == auvest::Status::kOk);
  const auto model = usbl<Scalar>(0, 0, 0);
  Random random(9);
  for (int k = 0; k < 100; ++k) {
    truth = auvest::WhiteAcceleration<double, 3>().f(truth, 1);
    REQUIRE(filter.predict(Scalar(1)) == auvest::Status::kOk);
    auto z = usbl<double>(0, 0, 0).h(truth);
    z(0) += 0.5 * random.normal<double>();
    for (int i = 1; i < 3; ++i) z(i) += 0.01 * random.normal<double>();
    REQUIRE(filter.update(z.template cast<Scalar>(), model).status == auvest::Status::kOk);
  }
  CHECK((filter.x().template cast<double>() - truth).template head<3>().norm() < 5);
  return filter.x().template cast<double>();
}

TEST_CASE("range, bearing and elevation: float keeps up with double at the paper's alpha") {
  // 500 m away: an ulp of float is 3e-5 m, and there are a hundred steps.
  CHECK((tracked_by_usbl<float>() - tracked_by_usbl<double>()).head<3>().norm() < 3e-3);
}

TEST_CASE("dead reckoning: Eq. (1) by hand, and what the optional states mean") {
  const double pi = auvest::math::pi<double>();
  // Heading east (pi/2 from north): forward is +y (east), starboard is -x (south).
  auvest::SpeedHeading<double> plain;
  plain.input << 1.5, 0.25, pi / 2;
  const Vector<double, 2> next = plain.f(Vector<double, 2>(10, 20), 2);
  CHECK(next(0) == close_to(10 - 2 * 0.25, 1e-14));
  CHECK(next(1) == close_to(20 + 2 * 1.5, 1e-14));
  // The bias is added to the heading, the scale multiplies the speed: [x, y, bias, scale].
  auvest::SpeedHeading<double, true, true> full;
  full.input << 1.2, 0.2, pi / 2 - 0.3;
  const auto corrected = full.f(Vector<double, 4>(10, 20, 0.3, 0.25), 2);
  CHECK(corrected(0) == close_to(10 - 2 * 0.25, 1e-14));
  CHECK(corrected(1) == close_to(20 + 2 * 1.5, 1e-14));
  CHECK(corrected(2) == 0.3);
  CHECK(corrected(3) == 0.25);
}

TEST_CASE("dead reckoning: Q is the covariance of Eq. (1) with noisy input, by Monte Carlo") {
  auvest::SpeedHeading<double>::Params p;
  p.sigma_forward = 0.1;
  p.sigma_starboard = 0.05;
  p.sigma_heading = 0.02;
  auvest::SpeedHeading<double> model(p);
  const Vector<double, 3> input(2, 0.5, 0.7);
  model.input = input;
  const Matrix<double, 2, 2> q = model.Q(1);
  const Vector<double, 2> mean = model.f(Vector<double, 2>(0, 0), 1);
  Matrix<double, 2, 2> sum = Matrix<double, 2, 2>::Zero();
  Random random(5);
  const int n = 200000;
  for (int k = 0; k < n; ++k) {
    model.input = input;
    model.input(0) += p.sigma_forward * random.normal<double>();
    model.input(1) += p.sigma_starboard * random.normal<double>();
    model.input(2) += p.sigma_heading * random.normal<double>();
    const Vector<double, 2> error = model.f(Vector<double, 2>(0, 0), 1) - mean;
    sum += error * error.transpose() / n;
  }
  // Statistical error of a variance: sqrt(2 / n) = 0.3 %; second order in the heading: 0.04 %.
  CHECK((sum - q).cwiseAbs().maxCoeff() < 0.015 * q.trace());
  CHECK(std::fabs(q(1, 0)) > 0.2 * q.trace());  // the signs are seen
}

TEST_CASE("odometry: increments compose") {
  // A square of four equal steps, each followed by a quarter turn, ends where it began.
  auvest::Odometry<double> model;
  model.input << 3, 1, auvest::math::pi<double>() / 2;
  const Vector<double, 3> start(5, 6, 0.4);
  Vector<double, 3> x = start;
  for (int k = 0; k < 4; ++k) {
    x = model.f(x, 1);
    if (k == 0) {
      CHECK(x(0) == close_to(5 + 3 * std::cos(0.4) - std::sin(0.4), 1e-14));
      CHECK(x(1) == close_to(6 + 3 * std::sin(0.4) + std::cos(0.4), 1e-14));
    }
  }
  CHECK(x(0) == close_to(5, 1e-14));
  CHECK(x(1) == close_to(6, 1e-14));
  CHECK(x(2) == close_to(0.4 + 2 * auvest::math::pi<double>(), 1e-14));
  // 5 % of sqrt(10) m, and 0.1 m/sqrt(s) for 4 s.
  CHECK(model.Q(4)(0, 0) == close_to(0.0025 * 10 + 0.01 * 4, 1e-14));
}

TEST_CASE("odometry: the heading's noise grows with time and, where told, with the turn") {
  auvest::Odometry<double> model;
  model.input << 3, 1, -0.5;
  CHECK(model.Q(4)(2, 2) == close_to(1e-6 * 4, 1e-20));
  model.params.sigma_turned = 0.1;
  // 10 % of half a rad, whichever way, and 0.001 rad/sqrt(s) for 4 s.
  CHECK(model.Q(4)(2, 2) == close_to(0.0025 + 1e-6 * 4, 1e-14));
  CHECK(model.Q(4)(0, 0) == close_to(0.0025 * 10 + 0.01 * 4, 1e-14));
  model.params.sigma_turned = -0.1;
  CHECK(model.check() == auvest::Status::kBadParameter);
}

TEST_CASE("leader range: the leader's uncertainty adds to R; at the leader nothing moves") {
  const auto model = leader<2>(7, 8);
  CHECK(model.R()(0, 0) == 25);
  auvest::Ekf<auvest::SpeedHeading<double>> ekf{auvest::SpeedHeading<double>()};
  const Vector<double, 2> there(7, 8);
  REQUIRE(ekf.reset(there, Matrix<double, 2, 2>::Identity()) == auvest::Status::kOk);
  CHECK(ekf.update(Vector<double, 1>(2.0), model).status == auvest::Status::kOk);
  CHECK(ekf.x() == there);
  CHECK(ekf.P()(0, 0) == 1);
}

TEST_CASE("leader range: second-order terms against Monte Carlo") {
  // 40 m across and 1 m along the line of sight, at 300 m: mean and variance of h(x) - h(mean).
  const auto model = leader<2>(0, 0);
  const double c = std::cos(0.7), s = std::sin(0.7);
  const Vector<double, 2> mean(300 * c, 300 * s);
  Matrix<double, 2, 2> p;
  p << c * c + 1600 * s * s, (1 - 1600) * c * s, (1 - 1600) * c * s, s * s + 1600 * c * c;
  Matrix<double, 2, 2> root;
  Matrix<double, 1, 2> none;
  REQUIRE(auvest::math::factor_leading(p, root, none));
  Vector<double, 1> innovation(0.0);
  Matrix<double, 1, 1> noise(0.0);
  model.second_order(model.about(mean), root, innovation, noise);
  CHECK(innovation(0) == close_to(-1600 / 600.0, 1e-12));
  CHECK(noise(0, 0) == close_to(1600.0 * 1600 / (2 * 300.0 * 300), 1e-12));
  Random random(3);
  const int n = 200000;
  double sum = 0, square = 0;
  for (int k = 0; k < n; ++k) {
    const Vector<double, 2> y(random.normal<double>(), random.normal<double>());
    const double d = model.h(mean + root * y)(0) - 300;
    sum += d / n;
    square += d * d / n;
  }
  // The fourth order takes 3/4 (40 / 300)^2 = 1.3 % off the mean and 5 times that off the variance.
  CHECK(sum == close_to(-innovation(0), 0.025));
  CHECK(square - sum * sum == close_to(noise(0, 0) + 1, 0.1));
}

TEST_CASE("processes with an input: predict takes it, and refuses what is not finite") {
  auvest::Ekf<auvest::SpeedHeading<double>> filter{auvest::SpeedHeading<double>()};
  REQUIRE(filter.reset(Vector<double, 2>(1, 2), Matrix<double, 2, 2>::Identity()) ==
          auvest::Status::kOk);
  const Vector<double, 3> input(2, 0, 0);
  CHECK(filter.predict(0.5, input) == auvest::Status::kOk);
  CHECK(filter.x()(0) == 2);
  CHECK(filter.predict(0.5) == auvest::Status::kOk);  // the input stands
  CHECK(filter.x()(0) == 3);
  const auto before = filter.belief();
  CHECK(filter.predict(0.5, Vector<double, 3>(2, std::nan(""), 0)) == auvest::Status::kNotFinite);
  CHECK(filter.predict(-1, Vector<double, 3>(9, 9, 9)) == auvest::Status::kTimeBackwards);
  CHECK(filter.process().input == input);
  CHECK(filter.x() == before.x);
}

TEST_CASE("models refuse bad parameters") {
  const double nan = std::nan("");
  const auto range_bearing = [](double sx, double sr, double sb, double near) {
    auvest::RangeBearing<double, 6>::Params p;
    p.station_x_m = sx;
    p.sigma_range_m = sr;
    p.sigma_bearing_rad = sb;
    p.near_field = near;
    return auvest::RangeBearing<double, 6>(p).check();
  };
  CHECK(range_bearing(0, 1, 1, 0) == auvest::Status::kOk);
  CHECK(range_bearing(nan, 1, 1, 0) == auvest::Status::kBadParameter);
  CHECK(range_bearing(0, 0, 1, 0) == auvest::Status::kBadParameter);
  CHECK(range_bearing(0, -1, 1, 0) == auvest::Status::kBadParameter);
  CHECK(range_bearing(0, 1, nan, 0) == auvest::Status::kBadParameter);
  CHECK(range_bearing(0, 1, 0, 0) == auvest::Status::kBadParameter);
  CHECK(range_bearing(0, 1, 1, -1) == auvest::Status::kBadParameter);
  for (const double bad : {-1.0, nan}) {
    auvest::SpeedHeading<double>::Params reckoning;
    reckoning.sigma_heading = bad;
    CHECK(auvest::SpeedHeading<double>(reckoning).check() == auvest::Status::kBadParameter);
    auvest::Odometry<double>::Params odometry;
    odometry.sigma_drift = bad;
    CHECK(auvest::Odometry<double>(odometry).check() == auvest::Status::kBadParameter);
    auvest::LeaderRange<double, 2>::Params range;
    range.sigma_leader_m = bad;
    CHECK(auvest::LeaderRange<double, 2>(range).check() == auvest::Status::kBadParameter);
  }
  CHECK(leader<2>(nan, 0).check() == auvest::Status::kBadParameter);
  auvest::AccelerationNoise<double> noise;
  noise.velocity = -1;
  CHECK(auvest::ExactAcceleration<double>(noise).check() == auvest::Status::kBadParameter);
  noise.velocity = nan;
  CHECK(auvest::EulerAcceleration<double>(noise).check() == auvest::Status::kBadParameter);
  auvest::CoordinatedTurn<double>::Params turn;
  turn.noise = noise;
  CHECK(auvest::CoordinatedTurn<double>(turn).check() == auvest::Status::kBadParameter);
  turn.noise = auvest::AccelerationNoise<double>();
  CHECK(auvest::CoordinatedTurn<double>(turn).check() == auvest::Status::kOk);
  turn.slow_m_s = 0;
  CHECK(auvest::CoordinatedTurn<double>(turn).check() == auvest::Status::kBadParameter);
  auvest::ConstantVelocity<double>::Params straight;
  straight.sigma_acceleration_m_s2 = -1;
  CHECK(auvest::ConstantVelocity<double>(straight).check() == auvest::Status::kBadParameter);
  straight = auvest::ConstantVelocity<double>::Params();
  straight.velocity = -1;
  CHECK(auvest::ConstantVelocity<double>(straight).check() == auvest::Status::kBadParameter);
}

template <class Scalar>
void check_refusals() {
  using auvest::Status;
  using Space = auvest::WhiteAcceleration<Scalar, 3>;
  using Log = auvest::BodyVelocity<Scalar, 6, 3>;
  using Gauge = auvest::Depth<Scalar, 6>;
  using Fix = auvest::Position<Scalar, 6, 3>;
  CHECK(Space().check() == Status::kOk);
  CHECK(Log().check() == Status::kOk);
  CHECK(Gauge().check() == Status::kOk);
  CHECK(Fix().check() == Status::kOk);
  CHECK(fix<Scalar, 6, 3>().check() == Status::kOk);
  const Scalar infinity = std::numeric_limits<Scalar>::infinity();
  for (const Scalar bad : {Scalar(-1), Scalar(std::nan("")), infinity}) {
    for (Scalar Space::Params::*member :
         {&Space::Params::velocity, &Space::Params::vertical_velocity}) {
      typename Space::Params p;
      p.*member = bad;
      CHECK(Space(p).check() == Status::kBadParameter);
    }
    for (Scalar Log::Params::*member :
         {&Log::Params::sigma_forward_m_s, &Log::Params::sigma_sideways_m_s,
          &Log::Params::sigma_vertical_m_s}) {
      typename Log::Params p;
      p.*member = bad;
      CHECK(Log(p).check() == Status::kBadParameter);
    }
    typename Gauge::Params gauge;
    gauge.sigma_m = bad;
    CHECK(Gauge(gauge).check() == Status::kBadParameter);
    for (int i = 0; i < 3; ++i) {
      typename Fix::Params p;
      p.covariance_m2(i, i) = bad;
      CHECK(Fix(p).check() == Status::kBadParameter);
    }
    typename Fix::Params p;
    p.covariance_m2(2, 1) = bad;  // -1: a correlation of -1
    CHECK(Fix(p).check() == Status::kBadParameter);
    typename Log::Params log;
    log.heading_rad = bad;
    CHECK(Log(log).check() == (bad < 0 ? Status::kOk : Status::kBadParameter));
  }
  using Usbl = auvest::RangeBearingElevation<Scalar, 6>;
  CHECK(Usbl().check() == Status::kOk);
  for (Scalar Usbl::Params::*member :
       {&Usbl::Params::station_x_m, &Usbl::Params::station_y_m, &Usbl::Params::station_z_m,
        &Usbl::Params::sigma_range_m, &Usbl::Params::sigma_bearing_rad,
        &Usbl::Params::sigma_elevation_rad, &Usbl::Params::near_field}) {
    for (const Scalar bad : {Scalar(std::nan("")), infinity}) {
      typename Usbl::Params p;
      p.*member = bad;
      CHECK(Usbl(p).check() == Status::kBadParameter);
    }
  }
  for (Scalar Usbl::Params::*member :
       {&Usbl::Params::sigma_range_m, &Usbl::Params::sigma_bearing_rad,
        &Usbl::Params::sigma_elevation_rad, &Usbl::Params::near_field}) {
    typename Usbl::Params p;
    p.*member = Scalar(-1);
    CHECK(Usbl(p).check() == Status::kBadParameter);
    p.*member = Scalar(0);  // near_field may be
    CHECK((Usbl(p).check() == Status::kOk) == (member == &Usbl::Params::near_field));
  }
  typename Gauge::Params exact;
  exact.sigma_m = Scalar(0);  // no measurement is
  CHECK(Gauge(exact).check() == Status::kBadParameter);
}

TEST_CASE("models refuse bad parameters: fixes, depth, velocity, and their process") {
  check_refusals<float>();
  check_refusals<double>();
}

}  // namespace
