// The way back against the dense joint Gaussian of all states, textbook sums, and the truth.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "auvest/auvest.hpp"
#include "close.hpp"

namespace {

using auvest::BackwardStep;
using auvest::Belief;
using auvest::Matrix;
using auvest::Spread;
using auvest::Status;
using auvest::Vector;

/// What a filter did, as a fixed interval asks for it: the belief after each row, and the steps.
template <class Scalar, int N>
struct Pass {
  std::vector<Belief<Scalar, N>> filtered;  // [0]: the start
  std::vector<BackwardStep<Scalar, N>> steps;

  template <class Filter>
  void start(const Filter& filter) {
    filtered.push_back({filter.x(), filter.P()});
  }

  template <class Filter, class... Input>
  void predict(Filter& filter, Scalar dt, const Input&... input) {
    const Belief<Scalar, N> before = filter.belief();
    REQUIRE(filter.predict(dt, input...) == Status::kOk);
    Spread<Scalar, N> spread;
    REQUIRE(spread_of(filter, before, dt, spread) == Status::kOk);
    BackwardStep<Scalar, N> step;
    REQUIRE(step.make(before.x, filter.belief(), spread) == Status::kOk);
    steps.push_back(step);
  }

  template <class Process>
  std::vector<Belief<Scalar, N>> smoothed(const Process& process) const {
    std::vector<Belief<Scalar, N>> result = filtered;
    for (std::size_t k = steps.size(); k > 0; --k) {
      result[k - 1] = result[k];
      steps[k - 1].back(process, result[k - 1]);
      auvest::math::mirror_lower(result[k - 1].P);
    }
    return result;
  }
};

// ---- Linear: everything at once
// ------------------------------------------------------------------

using Linear = auvest::LinearProcess<double, 4>;
using Seen = auvest::LinearMeasurement<double, 4, 2>;

Linear linear_process() {
  Matrix<double, 4, 4> phi;
  phi << 1, 0.1, 0.3, 0, -0.2, 0.95, 0, 0.25, 0.05, 0, 0.9, 0.1, 0, -0.1, 0.02, 1.02;
  Matrix<double, 4, 4> root;
  root << 0.3, 0, 0, 0, 0.1, 0.2, 0, 0, 0, 0.05, 0.4, 0, 0.02, 0, 0.1, 0.25;
  return Linear(phi, root * root.transpose());
}

Seen linear_sensor() {
  Matrix<double, 2, 4> h;
  h << 1, 0.5, 0, 0, 0, 0, -0.3, 1;
  Matrix<double, 2, 2> r;
  r << 0.5, 0.1, 0.1, 0.3;
  return Seen(h, r);
}

const int kRows = 30;

bool measured(int k) { return k % 3 != 0 && k != 20; }

Vector<double, 2> linear_z(int k) {
  return Vector<double, 2>(std::sin(0.7 * k), 1 + std::cos(0.4 * k));
}

struct Dense {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// The joint posterior of the states 0..rows from its information matrix: the least squares over
/// the prior, all motions and all measurements at once.
Dense least_squares(const Vector<double, 4>& x0, const Matrix<double, 4, 4>& p0, int rows) {
  const Linear process = linear_process();
  const Seen sensor = linear_sensor();
  const int n = 4 * (rows + 1);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  information.topLeftCorner(4, 4) = p0.inverse();
  right.head(4) = p0.inverse() * x0;
  const Eigen::MatrixXd weight = process.noise.inverse();
  const Eigen::MatrixXd phi = process.transition;
  for (int k = 1; k <= rows; ++k) {
    information.block(4 * k, 4 * k, 4, 4) += weight;
    information.block(4 * k - 4, 4 * k - 4, 4, 4) += phi.transpose() * weight * phi;
    information.block(4 * k, 4 * k - 4, 4, 4) -= weight * phi;
    information.block(4 * k - 4, 4 * k, 4, 4) -= phi.transpose() * weight;
    if (!measured(k)) continue;
    const Eigen::MatrixXd h = sensor.matrix;
    const Eigen::MatrixXd inverse = sensor.noise.inverse();
    information.block(4 * k, 4 * k, 4, 4) += h.transpose() * inverse * h;
    right.segment(4 * k, 4) += h.transpose() * inverse * linear_z(k);
  }
  Dense dense;
  dense.covariance = information.inverse();
  dense.mean = information.ldlt().solve(right);
  return dense;
}

template <class Filter>
void require_least_squares(Filter filter) {
  const Vector<double, 4> x0(1, -2, 0.5, 3);
  const Matrix<double, 4, 4> p0 = Vector<double, 4>(4, 1, 9, 0.25).asDiagonal();
  REQUIRE(filter.reset(x0, p0) == Status::kOk);
  const Seen sensor = linear_sensor();
  auvest::FixedLagSmoother<Filter, 7> lagging(filter);
  Pass<double, 4> pass;
  pass.start(filter);
  for (int k = 1; k <= kRows; ++k) {
    pass.predict(filter, 1.0);
    REQUIRE(lagging.predict(1.0) == Status::kOk);
    if (measured(k)) {
      REQUIRE(filter.update(linear_z(k), sensor).status == Status::kOk);
      REQUIRE(lagging.update(linear_z(k), sensor).status == Status::kOk);
    }
    pass.start(filter);
    const Dense so_far = least_squares(x0, p0, k);
    CHECK(lagging.lag() == (k < 7 ? k : 7));
    const int then = k - lagging.lag();
    const Belief<double, 4> lagged = lagging.lagged();
    CHECK((lagged.x - so_far.mean.segment(4 * then, 4)).norm() < 1e-10);
    CHECK((lagged.P - so_far.covariance.block(4 * then, 4 * then, 4, 4)).norm() < 1e-10);
  }
  const Dense all = least_squares(x0, p0, kRows);
  const auto smoothed = pass.smoothed(filter.process());
  double moved = 0;
  for (int k = 0; k <= kRows; ++k) {
    const auto& belief = smoothed[std::size_t(k)];
    CHECK((belief.x - all.mean.segment(4 * k, 4)).norm() < 1e-10);
    CHECK((belief.P - all.covariance.block(4 * k, 4 * k, 4, 4)).norm() < 1e-10);
    moved += (belief.x - pass.filtered[std::size_t(k)].x).norm();
    if (k == kRows) break;
    // What the next state says of this one: the cross-covariance.
    const Eigen::MatrixXd across = pass.steps[std::size_t(k)].gain * smoothed[std::size_t(k) + 1].P;
    CHECK((across - all.covariance.block(4 * k, 4 * k + 4, 4, 4)).norm() < 1e-10);
  }
  CHECK(moved > 1);  // the filter alone is not the solution
}

TEST_CASE("smoother: a linear model gives the least squares over everything, with every filter") {
  require_least_squares(auvest::Ekf<Linear>(linear_process()));
  require_least_squares(auvest::Ukf<Linear>(linear_process()));
  require_least_squares(auvest::Ckf<Linear>(linear_process()));
}

// ---- Points
// --------------------------------------------------------------------------------------

/// A turn whose rate depends on where the craft is: nothing about it is linear.
struct Swirl : auvest::ProcessModel<Swirl, double, 3> {
  State f(const State& x, double dt) const {
    const double rate = 0.4 + 0.1 * x(0) * x(1);
    return State(x(0) + dt * std::cos(x(2)), x(1) + dt * std::sin(x(2)), x(2) + dt * rate);
  }
  Covariance Q(double dt) const {
    return dt * Vector<double, 3>(0.01, 0.02, 0.005).asDiagonal().toDenseMatrix();
  }
};

TEST_CASE("smoother: the gain of a UKF is the covariance of both states over that of the later") {
  auvest::Ukf<Swirl>::Params params;
  params.alpha = 0.7;
  params.beta = 2;
  params.kappa = 1;
  auvest::Ukf<Swirl> filter{Swirl(), params};
  const Vector<double, 3> x0(1, -0.5, 0.3);
  Matrix<double, 3, 3> p0;
  p0 << 0.5, 0.1, 0.05, 0.1, 0.3, -0.02, 0.05, -0.02, 0.2;
  REQUIRE(filter.reset(x0, p0) == Status::kOk);
  Pass<double, 3> pass;
  pass.start(filter);
  pass.predict(filter, 0.5);
  pass.start(filter);

  // Julier's weights, point by point.
  const double c = 0.7 * 0.7 * (3 + 1);
  const Matrix<double, 3, 3> root = p0.llt().matrixL();
  std::vector<Vector<double, 3>> from{x0}, to;
  for (int i = 0; i < 3; ++i) {
    from.push_back(x0 + std::sqrt(c) * root.col(i));
    from.push_back(x0 - std::sqrt(c) * root.col(i));
  }
  for (const auto& point : from) to.push_back(Swirl().f(point, 0.5));
  Vector<double, 3> mean = (1 - 3 / c) * to[0];
  for (std::size_t i = 1; i < 7; ++i) mean += to[i] / (2 * c);
  Matrix<double, 3, 3> across = Matrix<double, 3, 3>::Zero();
  for (std::size_t i = 1; i < 7; ++i) {
    across += (from[i] - x0) * (to[i] - mean).transpose() / (2 * c);
  }
  const Matrix<double, 3, 3> later = filter.P();
  const Matrix<double, 3, 3> gain = across * later.inverse();
  CHECK((pass.steps[0].predicted - mean).norm() < 1e-12);
  CHECK((pass.steps[0].gain - gain).norm() < 1e-12);
  Matrix<double, 3, 3> rest = pass.steps[0].rest;
  auvest::math::mirror_lower(rest);
  CHECK((rest - (p0 - gain * later * gain.transpose())).norm() < 1e-12);
}

// ---- Angles
// --------------------------------------------------------------------------------------

/// A heading that turns with its input, wrapped or not.
template <bool Wrapped>
struct Heading : auvest::ProcessModel<Heading<Wrapped>, double, 1> {
  using Base = auvest::ProcessModel<Heading<Wrapped>, double, 1>;
  using typename Base::Covariance;
  using typename Base::State;
  State f(const State& x, double dt) const {
    const double next = x(0) + 0.5 * dt;
    return State(Wrapped ? auvest::math::wrap(next) : next);
  }
  Covariance Phi(const State&, double) const { return Covariance(1); }
  Covariance Q(double dt) const { return Covariance(0.01 * dt); }
  State residual(const State& a, const State& b) const {
    return State(Wrapped ? auvest::math::wrap(a(0) - b(0)) : a(0) - b(0));
  }
};

template <bool Wrapped>
std::vector<Belief<double, 1>> turned() {
  auvest::Ekf<Heading<Wrapped>> filter{Heading<Wrapped>()};
  REQUIRE(filter.reset(Vector<double, 1>(2.0), Matrix<double, 1, 1>(1)) == Status::kOk);
  const Matrix<double, 1, 1> one(1), noise(0.05);
  const auvest::LinearMeasurement<double, 1, 1> compass(one, noise);
  Pass<double, 1> pass;
  pass.start(filter);
  for (int k = 1; k <= 5; ++k) {
    pass.predict(filter, 1.0);
    if (k == 5) {
      // 0.2 more than the filter expects: the same for both.
      REQUIRE(filter.update(filter.x()(0) + 0.2, compass).status == Status::kOk);
    }
    pass.start(filter);
  }
  return pass.smoothed(filter.process());
}

TEST_CASE("smoother: an angle that was wrapped on the way is smoothed as one that was not") {
  const auto wrapped = turned<true>(), plain = turned<false>();
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const double apart = wrapped[k].x(0) - plain[k].x(0);
    CHECK(std::abs(auvest::math::wrap(apart)) < 1e-12);
    CHECK(wrapped[k].P(0, 0) == close_to(plain[k].P(0, 0), 1e-12));
  }
  CHECK(wrapped.back().x(0) < -1);  // it did pass pi
  // 0.2 times the gain of the update, 1.05 / 1.1, times that of five steps back, 1 / 1.05.
  CHECK(plain[0].x(0) == close_to(2.0 + 0.2 / 1.1, 1e-12));
}

// ---- Ranges
// --------------------------------------------------------------------------------------

template <class Scalar>
using Slave = auvest::SpeedHeading<Scalar, true>;  // x, y and the bias of the heading

template <class Scalar>
Vector<Scalar, 3> slave_input(int k) {
  return Vector<Scalar, 3>(Scalar(1.5), Scalar(0.1), Scalar(0.02) * Scalar(k));
}

template <class Scalar>
auvest::LeaderRange<Scalar, 3> beacon(int k) {
  typename auvest::LeaderRange<Scalar, 3>::Params p;
  p.leader_x_m = k % 2 == 0 ? Scalar(150) : Scalar(-80);
  p.leader_y_m = k % 3 == 0 ? Scalar(20) : Scalar(130);
  return auvest::LeaderRange<Scalar, 3>(p);
}

/// A record of ranges every fifth row, without noise, along the track of the model itself; with a
/// start that is off by `displaced` metres in each direction. Gives the passes and the true track.
template <class Filter>
std::vector<Vector<typename Filter::Scalar, 3>> run_slave(Filter& filter,
                                                          Pass<typename Filter::Scalar, 3>& pass,
                                                          int rows, double displaced) {
  using Scalar = typename Filter::Scalar;
  std::vector<Vector<Scalar, 3>> truth{Vector<Scalar, 3>(0, 0, Scalar(0.05))};
  const Vector<Scalar, 3> x0(Scalar(displaced), Scalar(-displaced), 0);
  const Matrix<Scalar, 3, 3> p0 =
      Vector<Scalar, 3>(4, 4, Scalar(0.01)).asDiagonal().toDenseMatrix();
  REQUIRE(filter.reset(x0, p0) == Status::kOk);
  pass.start(filter);
  Slave<Scalar> process;
  for (int k = 1; k <= rows; ++k) {
    process.input = slave_input<Scalar>(k);
    truth.push_back(process.f(truth.back(), Scalar(1)));
    pass.predict(filter, Scalar(1), slave_input<Scalar>(k));
    if (k % 5 == 0) {
      const auto range = beacon<Scalar>(k);
      REQUIRE(filter.update(range.h(truth.back()), range).status == Status::kOk);
    }
    pass.start(filter);
  }
  return truth;
}

/// The smallest eigenvalue of S^-1/2 (a - b) S^-1/2 with S = a: how far b <= a holds.
template <class Scalar>
double margin(const Matrix<Scalar, 3, 3>& a, const Matrix<Scalar, 3, 3>& b) {
  const Eigen::Matrix3d larger = a.template cast<double>();
  const Eigen::Matrix3d smaller = b.template cast<double>();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> solver(larger - smaller, larger);
  return solver.eigenvalues().minCoeff();
}

template <class Filter>
void require_smaller(Filter filter, double rounding) {
  using Scalar = typename Filter::Scalar;
  Pass<Scalar, 3> pass;
  const auto truth = run_slave(filter, pass, 400, 1.0);
  const auto smoothed = pass.smoothed(filter.process());
  double squares[2] = {0, 0};
  for (std::size_t k = 0; k < smoothed.size(); ++k) {
    CHECK(margin<Scalar>(pass.filtered[k].P, smoothed[k].P) > -rounding);
    CHECK(Filter::check_belief(smoothed[k]) == Status::kOk);
    squares[0] += double((pass.filtered[k].x - truth[k]).squaredNorm());
    squares[1] += double((smoothed[k].x - truth[k]).squaredNorm());
  }
  CHECK(squares[1] < 0.5 * squares[0]);
  // Half way in there is as much to come as there has been.
  CHECK(smoothed[200].P.trace() < Scalar(0.8) * pass.filtered[200].P.trace());
}

TEST_CASE("smoother: what comes later only adds, P_s <= P, in both precisions") {
  require_smaller(auvest::Ekf<Slave<double>>(), 1e-12);
  require_smaller(auvest::Ukf<Slave<double>>(), 1e-12);
  require_smaller(auvest::Ckf<Slave<double>>(), 1e-12);
  require_smaller(auvest::Ekf<Slave<float>>(), 1e-4);
  require_smaller(auvest::Ukf<Slave<float>>(), 1e-4);
}

TEST_CASE("smoother: a start far off, which the recovery finds out, is put right from the start") {
  using Filter =
      auvest::Robust<auvest::Ekf<Slave<double>>,
                     auvest::RobustUpdate<auvest::Hampel<double>, auvest::RejectionStreak<double>>>;
  Filter filter;
  Pass<double, 3> pass;
  const auto truth = run_slave(filter, pass, 400, 40.0);
  CHECK((pass.filtered[20].x - truth[20]).head(2).norm() > 40);
  const auto smoothed = pass.smoothed(filter.process());
  for (std::size_t k = 0; k < smoothed.size(); ++k) {
    // Nine tenths of the 57 m, while the filter still has them all.
    CHECK((smoothed[k].x - truth[k]).head(2).norm() < 5.7);
  }
}

// ---- Fixed lag
// -----------------------------------------------------------------------------------

TEST_CASE("smoother: a refused prediction leaves the lag as it is") {
  auvest::FixedLagSmoother<auvest::Ekf<Slave<double>>, 5> smoother;
  REQUIRE(smoother.reset(Vector<double, 3>(1, 2, 0), Matrix<double, 3, 3>::Identity()) ==
          Status::kOk);
  for (int k = 0; k < 8; ++k) {
    REQUIRE(smoother.predict(1.0, slave_input<double>(k)) == Status::kOk);
  }
  const auto before = smoother.lagged();
  CHECK(smoother.predict(-1.0, slave_input<double>(9)) == Status::kTimeBackwards);
  CHECK(smoother.predict(4000.0, slave_input<double>(9)) == Status::kStepTooLong);
  CHECK(smoother.lag() == 5);
  CHECK(smoother.lagged().x == before.x);
  CHECK(smoother.lagged().P == before.P);
  REQUIRE(smoother.reset(Vector<double, 3>(1, 2, 0), Matrix<double, 3, 3>::Identity()) ==
          Status::kOk);
  CHECK(smoother.lag() == 0);
  CHECK(smoother.lagged().x == Vector<double, 3>(1, 2, 0));
}

TEST_CASE("smoother: a fixed lag has the bits of the fixed interval that ends now") {
  auvest::RobustEkf<auvest::SpeedHeading<float>> filter;
  REQUIRE(filter.reset(Vector<float, 2>(1, 2), 9 * Matrix<float, 2, 2>::Identity()) == Status::kOk);
  auvest::FixedLagSmoother<decltype(filter), 6> lagging(filter);
  Pass<float, 2> pass;
  pass.start(filter);
  for (int k = 0; k < 20; ++k) {
    pass.predict(filter, 1.0f, slave_input<float>(k));
    REQUIRE(lagging.predict(1.0f, slave_input<float>(k)) == Status::kOk);
    auvest::LeaderRange<float, 2>::Params p;
    p.leader_x_m = 50.0f * float(k % 3);
    p.leader_y_m = 60.0f;
    const auvest::LeaderRange<float, 2> range(p);
    REQUIRE(filter.update(60.0f + float(k), range).status == Status::kOk);
    REQUIRE(lagging.update(60.0f + float(k), range).status == Status::kOk);
    pass.start(filter);
    const auto smoothed = pass.smoothed(filter.process());
    for (int back = 0; back <= lagging.lag(); ++back) {
      const auto& then = smoothed[smoothed.size() - 1 - std::size_t(back)];
      CHECK(lagging.smoothed(back).x == then.x);
      CHECK(lagging.smoothed(back).P == then.P);
    }
  }
  static_assert(sizeof(BackwardStep<float, 2>) == 48, "what the page says of the RAM for a lag");
}

}  // namespace
