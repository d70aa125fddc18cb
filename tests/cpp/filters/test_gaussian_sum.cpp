// The Gaussian sum filter: from an unknown start it converges, or says that it does not or that it
// is ambiguous; from a known one it keeps the bits of the robust filter inside.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

#include "auvest/filters/late_updates.hpp"
#include "auvest/models/odometry.hpp"
#include "auvest/models/position.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "simulation/unknown_start_figures.hpp"

namespace {

using auvest::Belief;
using auvest::Convergence;
using auvest::Decision;
using auvest::Igg;
using auvest::LeaderRange;
using auvest::Matrix;
using auvest::StartScenario;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

const double kPi = auvest::math::pi<double>();

/// Sixteen components in single precision; 32 in double, of which sixteen are used.
template <class Scalar>
struct Some;
template <>
struct Some<float> {
  static decltype(auvest::start_filter<float, auvest::Ekf, Igg, 16>()) filter() {
    return auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  }
};
template <>
struct Some<double> {
  static decltype(auvest::start_filter<double, auvest::Ekf, Igg, 32>()) filter() {
    return auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  }
};

template <class Scalar>
LeaderRange<Scalar, 2> leader(double x, double y) {
  LeaderRange<Scalar, 2> sensor;
  sensor.params.leader_x_m = static_cast<Scalar>(x);
  sensor.params.leader_y_m = static_cast<Scalar>(y);
  return sensor;
}

template <class Filter>
void begin(Filter& filter, double x, double y, double sigma_m) {
  using Scalar = typename Filter::Scalar;
  const Vector<Scalar, 2> mean(static_cast<Scalar>(x), static_cast<Scalar>(y));
  const Matrix<Scalar, 2, 2> unit = Matrix<Scalar, 2, 2>::Identity();
  REQUIRE(filter.reset(mean, unit * static_cast<Scalar>(sigma_m * sigma_m)) == Status::kOk);
}

/// The range from a leader to the craft at (x, y), without an error.
template <class Filter>
auvest::RobustCorrection<typename Filter::Scalar, 1> take(Filter& filter, double leader_x,
                                                          double leader_y, double x, double y) {
  using Scalar = typename Filter::Scalar;
  const double range = std::hypot(x - leader_x, y - leader_y);
  const auto correction = filter.update(Vector<Scalar, 1>(static_cast<Scalar>(range)),
                                        leader<Scalar>(leader_x, leader_y));
  REQUIRE(correction.status == Status::kOk);
  return correction;
}

/// Five seconds at 1 m/s on this course.
template <class Filter>
void sail(Filter& filter, double course, double (&position)[2]) {
  using Scalar = typename Filter::Scalar;
  for (int second = 0; second < 5; ++second) {
    Vector<Scalar, 3> input(Scalar(1), Scalar(0), static_cast<Scalar>(course));
    REQUIRE(filter.predict(Scalar(1), input) == Status::kOk);
    position[0] += std::cos(course);
    position[1] += std::sin(course);
  }
}

template <class Filter>
double error_m(const Filter& filter, double x, double y) {
  return std::hypot(double(filter.x()(0)) - x, double(filter.x()(1)) - y);
}

template <class Filter>
double sigma_m(const Filter& filter) {
  return std::sqrt(double(filter.P().trace()));
}

template <class Filter>
double weight_sum(const Filter& filter) {
  double sum = 0;
  for (int k = 0; k < filter.size(); ++k) sum += double(filter.weight(k));
  return sum;
}

// ---- Scenes with a known answer
// ------------------------------------------------------------------

template <class Filter>
void check_three_circles(Filter filter) {
  const double stations[3][2] = {{0, 0}, {120, 0}, {60, 90}};
  begin(filter, 12, 9, 1e4);
  CHECK(filter.convergence() == Convergence::kNotConverged);
  for (int range = 1; range <= 12; ++range) {
    const double(&station)[2] = stations[(range - 1) % 3];
    take(filter, station[0], station[1], 46, 53);
    CAPTURE(range);
    CHECK(weight_sum(filter) == doctest::Approx(1));
    if (range <= 2) CHECK(filter.convergence() == Convergence::kNotConverged);
    if (range >= 6) CHECK(filter.size() == 1);
    if (range == 6) CHECK(error_m(filter, 46, 53) < 0.02);
    if (range == 10) {
      CHECK(error_m(filter, 46, 53) < 0.012);
      // Nine ranges along three directions: the bound without any second order is 0.66 m.
      const double bound = std::sqrt(2 * 2 / 9.0);
      CHECK(sigma_m(filter) > bound);
      CHECK(sigma_m(filter) < 1.07 * bound);
      CHECK(filter.convergence() == Convergence::kSettling);
    }
  }
  CHECK(filter.convergence() == Convergence::kSettled);
}

TEST_CASE("unknown start: three circles meet in a point") {
  check_three_circles(auvest::start_filter<double, auvest::Ekf, Igg, 32>());
  check_three_circles(auvest::start_filter<double, auvest::Ukf, Igg, 32>());
  check_three_circles(auvest::start_filter<float, auvest::Ekf, Igg, 16>());
  check_three_circles(auvest::start_filter<float, auvest::Ukf, Igg, 16>());
}

template <class Filter>
void check_mirror(Filter filter, double weight_error) {
  begin(filter, 0, 0, 1e4);
  double at[2] = {-60, 80};
  for (int range = 1; range <= 40; ++range) {
    CAPTURE(range);
    sail(filter, range > 24 ? kPi / 2 : 0, at);
    take(filter, range % 2 == 0 ? -100 : 100, 0, at[0], at[1]);
    if (range >= 10 && range <= 24) {
      CHECK(filter.convergence() == Convergence::kAmbiguous);
      double heavy[2] = {0, 0};
      int place[2] = {0, 0};
      for (int k = 0; k < filter.size(); ++k) {
        const double w = double(filter.weight(k));
        const int side = filter.component(k).x(1) > 0 ? 0 : 1;
        if (w > heavy[side]) {
          heavy[side] = w;
          place[side] = k;
        }
      }
      CHECK(heavy[0] > 0.49);
      CHECK(std::fabs(heavy[0] - heavy[1]) < weight_error);
      const auto& up = filter.component(place[0]).x;
      const auto& down = filter.component(place[1]).x;
      CHECK(std::fabs(double(up(0) - down(0))) < 1e-3);
      CHECK(std::fabs(double(up(1) + down(1))) < 1e-3);
      CHECK(std::fabs(double(up(1)) - 80) < 0.1);
      CHECK(sigma_m(filter) == doctest::Approx(80).epsilon(0.001));
    }
    if (range >= 26) {
      CHECK(filter.size() == 1);
      CHECK(error_m(filter, at[0], at[1]) < 0.02);
    }
  }
  CHECK(filter.convergence() == Convergence::kSettled);
}

TEST_CASE("unknown start: on a leg along the line of two leaders there are two places") {
  check_mirror(auvest::start_filter<double, auvest::Ekf, Igg, 32>(), 1e-6);
  check_mirror(auvest::start_filter<double, auvest::Ukf, Igg, 32>(), 1e-6);
  check_mirror(auvest::start_filter<float, auvest::Ekf, Igg, 16>(), 1e-3);
  check_mirror(auvest::start_filter<float, auvest::Ukf, Igg, 16>(), 1e-3);
}

template <class Filter>
void check_one_leader(Filter filter) {
  begin(filter, -60, 0, 1e4);
  double at[2] = {-60, 80};
  for (int range = 1; range <= 42; ++range) {
    CAPTURE(range);
    sail(filter, range > 40 ? kPi / 2 : 0, at);
    take(filter, 0, 0, at[0], at[1]);
    if (range >= 20 && range <= 40) {
      REQUIRE(filter.size() == 2);
      CHECK(double(filter.weight(0)) == doctest::Approx(0.5).epsilon(0.002));
      CHECK(filter.convergence() == Convergence::kAmbiguous);
    }
  }
  CHECK(filter.size() == 1);
  CHECK(error_m(filter, at[0], at[1]) < 0.5);
  CHECK(filter.convergence() == Convergence::kSettling);
}

TEST_CASE("unknown start: one leader on a straight leg leaves two places until the turn") {
  check_one_leader(auvest::start_filter<double, auvest::Ekf, Igg, 32>(16));
  check_one_leader(auvest::start_filter<float, auvest::Ekf, Igg, 16>());
  check_one_leader(auvest::start_filter<float, auvest::Ukf, Igg, 16>());
}

template <class Filter>
void check_circling(Filter filter) {
  using Scalar = typename Filter::Scalar;
  begin(filter, 0, 0, 1e4);
  double at[2] = {150, 80};
  double course = 0;
  for (int range = 1; range <= 120; ++range) {
    for (int second = 0; second < 5; ++second) {
      Vector<Scalar, 3> input(Scalar(1), Scalar(0), static_cast<Scalar>(course));
      REQUIRE(filter.predict(Scalar(1), input) == Status::kOk);
      at[0] += std::cos(course);
      at[1] += std::sin(course);
      course += 2 * kPi / 300;
    }
    take(filter, 0, 0, at[0], at[1]);
    if (range == 60) {
      CHECK(filter.convergence() == Convergence::kSettled);
      CHECK(error_m(filter, at[0], at[1]) < 1);
    }
  }
  CHECK(error_m(filter, at[0], at[1]) < 0.25);
  CHECK(filter.convergence() == Convergence::kSettled);
}

TEST_CASE("unknown start: one leader and a craft that circles settle") {
  check_circling(auvest::start_filter<double, auvest::Ekf, Igg, 32>());
  check_circling(auvest::start_filter<float, auvest::Ekf, Igg, 16>());
}

// ---- A known start
// -------------------------------------------------------------------------------

/// A craft that knows where it begins, among leaders that send ranges with outliers: every bit of
/// the sum of Gaussians and of the filter inside, for each kernel.
template <class Scalar, template <class> class Filter>
void check_known_start() {
  using Kernel = auvest::AnyKernel<Scalar>;
  using Kind = typename Kernel::Kind;
  using Process = auvest::SpeedHeading<Scalar>;
  using Rule = auvest::RobustUpdate<Kernel, auvest::RejectionStreak<Scalar>>;
  using Plain = auvest::Robust<Filter<Process>, Rule>;
  StartScenario scenario;
  scenario.leaders = 2;
  scenario.sigma_start_m = 1;
  scenario.drawn_from_prior = true;
  scenario.outlier_fraction = 0.2;
  for (const Kind kind : {Kind::kUnit, Kind::kIgg, Kind::kHuber, Kind::kHampel}) {
    Kernel kernel;
    kernel.kind = kind;
    const Plain plain{Filter<Process>(Process()), Rule(kernel)};
    for (std::uint64_t run = 0; run < 20; ++run) {
      Plain alone = plain;
      auvest::GaussianSum<Plain, 16> summed(plain);
      std::vector<Belief<Scalar, 2>> beliefs;
      REQUIRE(auvest::run_unknown_start(
                  alone, scenario, 21, run, 100,
                  [&](std::uint32_t, const Plain& filter, const auvest::StartWorld&,
                      const auvest::RobustCorrection<Scalar, 1>&) {
                    beliefs.push_back(filter.belief());
                  }) == Status::kOk);
      std::size_t same = 0;
      REQUIRE(auvest::run_unknown_start(
                  summed, scenario, 21, run, 100,
                  [&](std::uint32_t range, const auvest::GaussianSum<Plain, 16>& filter,
                      const auvest::StartWorld&, const auvest::RobustCorrection<Scalar, 1>&) {
                    const Belief<Scalar, 2>& a = filter.belief();
                    const Belief<Scalar, 2>& b = beliefs[range - 1];
                    const bool alike = filter.size() == 1 && a.x == b.x && a.P(0, 0) == b.P(0, 0) &&
                                       a.P(1, 0) == b.P(1, 0) && a.P(1, 1) == b.P(1, 1);
                    same += alike ? 1 : 0;
                  }) == Status::kOk);
      CHECK(same == 100);
    }
  }
}

TEST_CASE("known start: the bits of the filter inside, whatever the kernel") {
  check_known_start<float, auvest::Ekf>();
  check_known_start<double, auvest::Ukf>();
}

TEST_CASE("one component is the filter inside, however wide the start") {
  auto one = auvest::start_filter<double, auvest::Ekf, Igg, 32>(1);
  typename decltype(one)::Base plain(one);
  begin(one, 12, 9, 1e4);
  begin(plain, 12, 9, 1e4);
  for (int range = 0; range < 20; ++range) {
    take(one, 60.0 * (range % 3), 0, 46, 53);
    take(plain, 60.0 * (range % 3), 0, 46, 53);
    CHECK(one.x() == plain.x());
    CHECK(one.P() == plain.P());
    CHECK(one.convergence() == Convergence::kNotConverged);
  }
}

// ---- Shares of runs
// ------------------------------------------------------------------------------

template <class Filter>
void check_shares(const Filter& filter, const auvest::StartCase& which, double late,
                  const double (&figures)[3], int runs) {
  StartScenario scenario;
  which.place(scenario);
  scenario.late_fraction = late;
  const auto shares = auvest::start_shares(filter, scenario, runs, 1);
  CAPTURE(which.name);
  CHECK(shares.refused == 0);
  const double allowed = auvest::start_wrong_bound(filter.params().components);
  for (int at = 0; at < 3; ++at) {
    CAPTURE(at);
    CHECK(shares.right[at] >=
          auvest::start_bound(figures[at] / 100, auvest::kStartFigureRuns, runs));
    if (at > 0) CHECK(shares.wrong_settled[at] <= allowed + 3 * std::sqrt(allowed / runs));
  }
}

TEST_CASE("unknown start: as many runs are right as in the prototype, and few are wrong" *
          doctest::test_suite("statistics")) {
  const auto single = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  const auto points = auvest::start_filter<double, auvest::Ukf, Igg, 32>();
  for (const auto& row : auvest::kStartFigures) {
    check_shares(single, row.which, 0, row.clean[0], 200);
    check_shares(single, row.which, 0.1, row.late[0], 200);
  }
  for (const int k : {0, 2, 3}) {
    check_shares(points, auvest::kStartFigures[k].which, 0.1, auvest::kStartFigures[k].late[1],
                 100);
  }
}

TEST_CASE("a start known to 100 m: components are split where circles bend" *
          doctest::test_suite("statistics")) {
  const auto filter = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  const auto& row = auvest::kStartPriorFigures[2];
  StartScenario scenario;
  scenario.drawn_from_prior = true;
  scenario.sigma_start_m = row.sigma_m;
  scenario.late_fraction = 0.1;
  for (const int c : {1, 3}) {
    auvest::kStartPriorCases[c].place(scenario);
    const auto shares = auvest::start_shares(filter, scenario, 200, 4);
    for (int at = 0; at < 3; ++at) {
      CAPTURE(at);
      CHECK(shares.right[at] >=
            auvest::start_bound(row.right[c][at] / 100, auvest::kStartPriorRuns, 200));
    }
  }
}

TEST_CASE("unknown start: a million metres are as good as a hundred thousand" *
          doctest::test_suite("statistics")) {
  const auto filter = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  StartScenario scenario;
  scenario.drawn_from_prior = true;
  for (const double sigma : {1e5, 1e6}) {
    scenario.sigma_start_m = sigma;
    const auto shares = auvest::start_shares(filter, scenario, 100, 2);
    CHECK(shares.refused == 0);
    CHECK(shares.right[1] >= 0.97);
  }
}

TEST_CASE("a wrong time stamp: the filter comes back by itself, without components never") {
  StartScenario scenario;
  scenario.leaders = 3;
  scenario.sigma_start_m = 1;
  scenario.drawn_from_prior = true;
  scenario.late_fraction = 0.1;
  scenario.bad_step = 10;
  const auto filter = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  const auto back = auvest::start_return(filter, scenario, 100, 3);
  CHECK(back.refused == 0);
  CHECK(back.median <= 16);
  CHECK(back.never == 0);
  const auto without = auvest::start_filter<float, auvest::Ekf, Igg, 16>(1);
  CHECK(auvest::start_return(without, scenario, 20, 3).never == 1);
}

// ---- The mixture
// ---------------------------------------------------------------------------------

using Mixture = auvest::GaussianMixture<double, 3, 32>;

Belief<double, 3> some_belief(Random& random) {
  Belief<double, 3> belief;
  Matrix<double, 3, 3> root;
  for (int i = 0; i < 9; ++i) root.data()[i] = 20 * random.normal<double>();
  for (int i = 0; i < 3; ++i) belief.x(i) = 100 * random.normal<double>();
  belief.P = root * root.transpose() + Matrix<double, 3, 3>::Identity();
  return belief;
}

void check_moments(const Mixture& mixture, const Belief<double, 3>& expected) {
  Belief<double, 3> whole;
  mixture.moments(whole);
  const double scale = expected.P.trace();
  for (int i = 0; i < 3; ++i) {
    CHECK(std::fabs(whole.x(i) - expected.x(i)) < 1e-9 * std::sqrt(scale));
    for (int j = 0; j <= i; ++j) {
      CHECK(std::fabs(whole.P(i, j) - expected.P(i, j)) < 1e-9 * scale);
    }
  }
}

TEST_CASE("mixture: splitting and merging keep mean and covariance") {
  Random random(5, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Belief<double, 3> belief = some_belief(random);
    Mixture mixture;
    mixture.assign(belief);
    mixture.split(0);
    REQUIRE(mixture.size == 2);
    check_moments(mixture, belief);
    mixture.split(trial % 2);
    check_moments(mixture, belief);
    // Along its long axis a component is left with 1 - 0.6^2 of its variance.
    mixture.assign(belief);
    mixture.split(0);
    const auvest::LongAxis<double> axis(belief.P);
    CHECK(auvest::variance_along(mixture.component[0].P, axis.x, axis.y) ==
          close_to(0.64 * axis.variance, 1e-9));
    mixture.merge(1e9);
    REQUIRE(mixture.size == 1);
    check_moments(mixture, belief);
  }
}

TEST_CASE("mixture: the long axis is that of the eigenvalues") {
  Random random(6, 1);
  for (int trial = 0; trial < 50; ++trial) {
    Matrix<double, 2, 2> p = some_belief(random).P.topLeftCorner<2, 2>();
    if (trial < 4) p << (trial < 2 ? 4 : 1), 0, 0, (trial % 2 == 0 ? 1 : 4);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(p);
    const auvest::LongAxis<double> axis(p);
    CHECK(axis.variance == close_to(solver.eigenvalues()(1), 1e-12));
    CHECK(auvest::variance_along(p, axis.x, axis.y) == close_to(axis.variance, 1e-9));
    CHECK(std::hypot(axis.x, axis.y) == close_to(1, 1e-12));
  }
}

TEST_CASE("mixture: a ring is the product of the prior with its components") {
  Random random(7, 1);
  for (int trial = 0; trial < 20; ++trial) {
    const Belief<double, 3> prior = some_belief(random);
    auvest::RangeCircle<double> circle;
    circle.centre[0] = 50 * random.normal<double>();
    circle.centre[1] = 50 * random.normal<double>();
    circle.radius = 10 + 100 * random.uniform<double>();
    circle.sigma = 1.5;
    const int count = 16;
    Mixture mixture;
    REQUIRE(mixture.ring(prior, circle, count));
    REQUIRE(mixture.size == count);
    CHECK(*std::max_element(mixture.weight, mixture.weight + count) == 1);
    const double s = kPi / count;
    const double first = std::atan2(prior.x(1) - circle.centre[1], prior.x(0) - circle.centre[0]);
    double log_first = 0;
    for (int k = 0; k < count; ++k) {
      // The textbook's update by a position c with covariance R.
      const double angle = first + 2 * s * k;
      const Eigen::Vector2d u(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d t(-u(1), u(0));
      const Eigen::Vector2d c =
          Eigen::Vector2d(circle.centre[0], circle.centre[1]) + circle.radius * (1 - s * s / 2) * u;
      const Eigen::Matrix2d R =
          (circle.sigma * circle.sigma + std::pow(s * s * circle.radius, 2) / 2) * u *
              u.transpose() +
          std::pow(s * circle.radius, 2) * t * t.transpose();
      const Eigen::Matrix3d P = prior.P;
      const Eigen::Matrix<double, 3, 2> PH = P.leftCols<2>();
      const Eigen::Matrix2d S = P.topLeftCorner<2, 2>() + R;
      const Eigen::Vector2d d = c - prior.x.head<2>();
      const Eigen::Vector3d x = prior.x + PH * S.inverse() * d;
      const Eigen::Matrix3d after = P - PH * S.inverse() * PH.transpose();
      const double log_weight = -0.5 * d.dot(S.inverse() * d) - 0.5 * std::log(S.determinant());
      if (k == 0) log_first = log_weight;
      const double scale = P.trace();
      for (int i = 0; i < 3; ++i) {
        CHECK(std::fabs(mixture.component[k].x(i) - x(i)) < 1e-8);
        for (int j = 0; j <= i; ++j) {
          CHECK(std::fabs(mixture.component[k].P(i, j) - after(i, j)) < 1e-10 * scale);
        }
      }
      if (log_weight - log_first > -30 && log_weight - log_first < 30) {
        CHECK(std::log(mixture.weight[k] / mixture.weight[0]) ==
              doctest::Approx(log_weight - log_first).epsilon(1e-6));
      }
    }
  }
}

TEST_CASE("mixture: in single precision a ring loses no digit to a prior of any width") {
  for (const double sigma : {1e3, 1e5, 1e6, 1e9}) {
    CAPTURE(sigma);
    Belief<float, 2> prior;
    prior.x << 30.f, -20.f;
    prior.P = Matrix<float, 2, 2>::Identity() * static_cast<float>(sigma * sigma);
    const auvest::RangeCircle<float> circle = {{0, 0}, 80, 1};
    auvest::GaussianMixture<float, 2, 16> mixture;
    REQUIRE(mixture.ring(prior, circle, 16));
    const double s = kPi / 16;
    for (int k = 0; k < 16; ++k) {
      const auto& one = mixture.component[k];
      CHECK(std::hypot(double(one.x(0)), double(one.x(1))) == close_to(80 * (1 - s * s / 2), 5e-3));
      CHECK(double(one.P.trace()) ==
            close_to(1 + std::pow(s * s * 80, 2) / 2 + std::pow(s * 80, 2), 5e-3));
      CHECK(double(mixture.weight[k]) == doctest::Approx(1).epsilon(0.2));
    }
  }
}

TEST_CASE("mixture: what is light leaves, what is near merges, the order stays") {
  auvest::GaussianMixture<double, 2, 8> mixture;
  mixture.size = 4;
  for (int k = 0; k < 4; ++k) {
    mixture.component[k].x << 10.0 * k, 0.0;
    mixture.component[k].P = Matrix<double, 2, 2>::Identity();
    mixture.weight[k] = k == 1 ? 1e-4 : 1;
  }
  mixture.prune(std::exp(-9.0));
  REQUIRE(mixture.size == 3);
  CHECK(mixture.component[1].x(0) == 20);
  CHECK(mixture.weight[0] == close_to(1 / 3.0, 1e-12));
  // Neighbours on a ring, two sigma apart, are two; 0.7 sigma apart they are one.
  mixture.component[1].x(0) = 2;
  mixture.merge(0.5);
  CHECK(mixture.size == 3);
  mixture.component[1].x(0) = 0.7;
  mixture.merge(0.5);
  REQUIRE(mixture.size == 2);
  CHECK(mixture.component[0].x(0) == close_to(0.35, 1e-12));
  CHECK(mixture.component[0].P(0, 0) == close_to(1 + 0.35 * 0.35, 1e-12));
  CHECK(mixture.component[1].x(0) == 30);
}

/// d' ((P_i + P_j) / 2)^-1 d by its definition.
double squared_distance(const auvest::GaussianMixture<double, 2, 16>& mixture, int i, int j) {
  const Eigen::Matrix2d P = 0.5 * (mixture.component[i].P + mixture.component[j].P);
  const Eigen::Vector2d d = mixture.component[i].x - mixture.component[j].x;
  return d.dot(P.inverse() * d);
}

TEST_CASE("mixture: the closest two merge first, until none are close") {
  Random random(8, 1);
  int joined = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    auvest::GaussianMixture<double, 2, 16> mixture;
    mixture.size = 12;
    for (int k = 0; k < mixture.size; ++k) {
      mixture.component[k].x << random.normal<double>(), random.normal<double>();
      const double a = 0.2 + random.uniform<double>();
      mixture.component[k].P << a, 0.1, 0.1, 0.5;
      mixture.weight[k] = 1 / 12.0;
    }
    auto expected = mixture;
    while (expected.size > 1) {
      int first = 0;
      int second = 0;
      double least = 0.5;
      for (int i = 0; i < expected.size; ++i) {
        for (int j = i + 1; j < expected.size; ++j) {
          if (squared_distance(expected, i, j) < least) {
            least = squared_distance(expected, i, j);
            first = i;
            second = j;
          }
        }
      }
      if (second == 0) break;
      auto& one = expected.component[first];
      const auto& other = expected.component[second];
      const double sum = expected.weight[first] + expected.weight[second];
      const double part = expected.weight[second] / sum;
      const Eigen::Vector2d d = other.x - one.x;
      const Eigen::Matrix2d P =
          (1 - part) * one.P + part * other.P + part * (1 - part) * d * d.transpose();
      one.x += part * d;
      one.P = P;
      expected.weight[first] = sum;
      for (int k = second + 1; k < expected.size; ++k) {
        expected.component[k - 1] = expected.component[k];
        expected.weight[k - 1] = expected.weight[k];
      }
      --expected.size;
      ++joined;
    }
    mixture.merge(0.5);
    REQUIRE(mixture.size == expected.size);
    for (int k = 0; k < mixture.size; ++k) {
      CHECK((mixture.component[k].x - expected.component[k].x).norm() < 1e-9);
      CHECK(std::fabs(mixture.component[k].P(1, 0) - expected.component[k].P(1, 0)) < 1e-9);
      CHECK(mixture.weight[k] == close_to(expected.weight[k], 1e-9));
    }
  }
  CHECK(joined > 500);
}

// ---- The filter
// ----------------------------------------------------------------------------------

/// A craft at rest at (46, 53) in a scene that is turned by `angle`, mirrored and shifted.
struct Placed {
  double angle, shift_x, shift_y;
  bool mirrored;

  void operator()(double x, double y, double (&to)[2]) const {
    const double side = mirrored ? -y : y;
    to[0] = std::cos(angle) * x - std::sin(angle) * side + shift_x;
    to[1] = std::sin(angle) * x + std::cos(angle) * side + shift_y;
  }
};

TEST_CASE("turning, shifting and mirroring the scene does so to the result") {
  const Placed scenes[] = {{0, 0, 0, false}, {1.1, -300, 40, false}, {-2, 5, 900, true}};
  const double stations[2][2] = {{0, 0}, {120, 10}};
  for (const Placed& scene : scenes) {
    auto filter = auvest::start_filter<double, auvest::Ekf, Igg, 32>();
    auto reference = auvest::start_filter<double, auvest::Ekf, Igg, 32>();
    double start[2], craft[2], mean[2];
    scene(12, 9, start);
    scene(46, 53, craft);
    begin(filter, start[0], start[1], 300);
    begin(reference, 12, 9, 300);
    for (int range = 0; range < 6; ++range) {
      CAPTURE(range);
      double station[2];
      scene(stations[range % 2][0], stations[range % 2][1], station);
      take(filter, station[0], station[1], craft[0], craft[1]);
      take(reference, stations[range % 2][0], stations[range % 2][1], 46, 53);
      scene(reference.x()(0), reference.x()(1), mean);
      CHECK(error_m(filter, mean[0], mean[1]) < 1e-6);
      CHECK(sigma_m(filter) == close_to(sigma_m(reference), 1e-7));
      CHECK(filter.size() == reference.size());
    }
  }
}

/// Whether two filters are in the same state, in every bit that means something.
template <class Filter>
bool same_state(const Filter& a, const Filter& b) {
  const auto same = [](const typename Filter::BeliefType& p, const typename Filter::BeliefType& q) {
    return p.x == q.x && p.P(0, 0) == q.P(0, 0) && p.P(1, 0) == q.P(1, 0) && p.P(1, 1) == q.P(1, 1);
  };
  bool alike =
      a.size() == b.size() && same(a.belief(), b.belief()) && a.convergence() == b.convergence() &&
      a.state().accepted == b.state().accepted && a.state().bend == b.state().bend &&
      a.rule().recovery.count == b.rule().recovery.count && a.process().input == b.process().input;
  for (int k = 0; alike && k < a.size(); ++k) {
    alike = a.weight(k) == b.weight(k) && same(a.component(k), b.component(k));
  }
  return alike;
}

TEST_CASE_TEMPLATE("a refused call changes nothing, a restored filter goes on with the same bits",
                   Scalar, float, double) {
  auto filter = Some<Scalar>::filter();
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar largest = (std::numeric_limits<Scalar>::max)();
  CHECK(filter.predict(Scalar(1)) == Status::kNotInitialised);
  CHECK(filter.update(Vector<Scalar, 1>(Scalar(5)), leader<Scalar>(0, 0)).status ==
        Status::kNotInitialised);
  begin(filter, 12, 9, 1e4);
  double at[2] = {46, 53};
  int several = 0;
  for (int range = 0; range < 16; ++range) {
    CAPTURE(range);
    const auto before = filter;
    const Vector<Scalar, 3> input(Scalar(1), Scalar(0), Scalar(2));
    CHECK(filter.predict(Scalar(-1), input) == Status::kTimeBackwards);
    CHECK(filter.predict(nan, input) == Status::kNotFinite);
    CHECK(filter.predict(Scalar(1), Vector<Scalar, 3>(nan, Scalar(0), Scalar(0))) ==
          Status::kNotFinite);
    CHECK(filter.predict(largest, Vector<Scalar, 3>(largest, Scalar(0), Scalar(0))) != Status::kOk);
    for (const Scalar z : {nan, std::numeric_limits<Scalar>::infinity(), largest}) {
      CHECK(filter.update(Vector<Scalar, 1>(z), leader<Scalar>(0, 0)).status != Status::kOk);
    }
    LeaderRange<Scalar, 2> without = leader<Scalar>(0, 0);
    without.params.sigma_range_m = 0;
    CHECK(filter.update(Vector<Scalar, 1>(nan), without).status == Status::kNotFinite);
    const auvest::Position<Scalar, 2, 2> fix;
    CHECK(filter.update(Vector<Scalar, 2>(largest, largest), fix).status != Status::kOk);
    CHECK(filter.update(Vector<Scalar, 1>(Scalar(-1)), leader<Scalar>(0, 0)).status ==
          Status::kImpossibleRange);
    CHECK(filter.predict(Scalar(3601), input) == Status::kStepTooLong);
    CHECK(same_state(filter, before));

    auto twin = Some<Scalar>::filter();
    REQUIRE(twin.restore(filter.belief(), filter.rule(), filter.state()) == Status::kOk);
    REQUIRE(twin.predict(Scalar(0), filter.process().input) == Status::kOk);
    sail(filter, 0.5 * range, at);
    double same_place[2] = {at[0], at[1]};
    sail(twin, 0.5 * range, same_place);
    take(filter, 120.0 * (range % 2), 0, at[0], at[1]);
    take(twin, 120.0 * (range % 2), 0, at[0], at[1]);
    CHECK(same_state(filter, twin));
    several += filter.size() > 1 ? 1 : 0;
  }
  CHECK(several >= 2);
}

TEST_CASE("single precision: what has no square is refused") {
  auto filter = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  const auto refused = [&filter](double sigma, float range, double leader_x) {
    begin(filter, 0, 0, sigma);
    const auto before = filter;
    const auto sensor = leader<float>(leader_x, 0);
    CHECK(filter.update(Vector<float, 1>(range), sensor).status == Status::kOverflow);
    CHECK(same_state(filter, before));
  };
  refused(1e18, 1e18f, 3e19);
  refused(1.5e19, 1.9e19f, 1e18);  // wide beside the range, but a ring of it has no covariance
}

TEST_CASE("what no filter left is not restored") {
  auto filter = auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  begin(filter, 12, 9, 1e4);
  take(filter, 0, 0, 46, 53);
  REQUIRE(filter.size() == 16);
  const auto good = filter.state();
  const auto restored = [&](const decltype(filter)::SumState& state) {
    return filter.restore(filter.belief(), filter.rule(), state);
  };
  CHECK(restored(good) == Status::kOk);
  auto bad = good;
  bad.mixture.size = 0;
  CHECK(restored(bad) == Status::kBadParameter);
  bad.mixture.size = 17;
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.mixture.weight[3] = -bad.mixture.weight[3];
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.mixture.weight[3] *= 2;
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.mixture.weight[4] += 2 * bad.mixture.weight[3];
  bad.mixture.weight[3] = -bad.mixture.weight[3];
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.mixture.component[2].P(1, 1) = -1;
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.mixture.component[2].x(0) = std::nan("");
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.headings = 0;
  CHECK(restored(bad) == Status::kBadParameter);
  bad.headings = 3;
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.accepted = 7;
  CHECK(restored(bad) == Status::kBadParameter);
  bad = good;
  bad.bend = std::nan("");
  CHECK(restored(bad) == Status::kBadParameter);
  // One Gaussian is what the two arguments say.
  REQUIRE(filter.restore(filter.belief(), filter.rule()) == Status::kOk);
  CHECK(filter.size() == 1);
  CHECK(filter.convergence() == Convergence::kNotConverged);
}

TEST_CASE("parameters out of their range are refused") {
  using Filter = decltype(auvest::start_filter<double, auvest::Ekf, Igg, 32>(16));
  const Filter::Base inside(auvest::start_filter<double, auvest::Ekf, Igg, 32>(16));
  const auto status = [&](double share, double width, int components) {
    Filter::Params params;
    params.outlier_share = share;
    params.outlier_width = width;
    params.components = static_cast<std::uint8_t>(components);
    Filter filter(inside, params);
    CHECK(filter.check() ==
          filter.reset(Vector<double, 2>(0, 0), Matrix<double, 2, 2>::Identity()));
    return filter.check();
  };
  CHECK(status(0.1, 50, 16) == Status::kOk);
  CHECK(status(0.1, 50, 1) == Status::kOk);
  CHECK(status(0.1, 50, 8) == Status::kOk);
  for (const int components : {0, 2, 7, 33}) {
    CHECK(status(0.1, 50, components) == Status::kBadParameter);
  }
  CHECK(status(0, 50, 16) == Status::kBadParameter);
  CHECK(status(0.6, 50, 16) == Status::kBadParameter);
  CHECK(status(std::nan(""), 50, 16) == Status::kBadParameter);
  CHECK(status(0.1, 1, 16) == Status::kBadParameter);
  CHECK(status(0.1, 1e4, 16) == Status::kBadParameter);
}

TEST_CASE("a wrong range costs no component more than an outlier does") {
  auto filter = auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  begin(filter, 0, 0, 1e4);
  double at[2] = {-60, 80};
  for (int range = 1; range <= 12; ++range) {
    sail(filter, 0, at);
    take(filter, range % 2 == 0 ? -100 : 100, 0, at[0], at[1]);
  }
  REQUIRE(filter.size() == 2);
  // Seen from above, the lower place is 160 m off: exactly the other one is meant, and gains by
  // 1 / (sqrt(2 pi S)) over share / width = 1 / 500 m; no more.
  const auto first = filter;
  const bool upper = first.component(0).x(1) > 0;
  const int right = upper ? 0 : 1;
  const double s = 1 + auvest::variance_along(first.component(right).P, 0.0, 1.0);
  take(filter, at[0], 500, at[0], at[1]);
  REQUIRE(filter.size() == 2);
  const double ratio = filter.weight(right) / filter.weight(1 - right);
  CHECK(ratio == doctest::Approx(500 / std::sqrt(2 * kPi * s)).epsilon(0.01));
  // A range that none explains leaves the weights as they are.
  const auto before = filter;
  const auto report = take(filter, 0, 0, 4000, 0);
  CHECK(report.decision == Decision::kRejected);
  CHECK(filter.weight(0) == doctest::Approx(before.weight(0)).epsilon(1e-12));
  CHECK(filter.component(0).x == before.component(0).x);
}

TEST_CASE("a recovery widens every component, and the next range is a ring") {
  auto filter = auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  begin(filter, 0, 0, 1);
  for (int range = 0; range < 8; ++range) {
    take(filter, range % 2 == 0 ? -100 : 100, 0, 0, 0);
    take(filter, 0, 100, 0, 0);
  }
  CHECK(filter.convergence() == Convergence::kSettled);
  bool recovered = false;
  int ranges = 0;
  while (!recovered && ranges < 8) {
    recovered = take(filter, ranges % 2 == 0 ? -100 : 100, 50, 900, 700).recovered;
    ++ranges;
  }
  REQUIRE(recovered);
  CHECK(filter.convergence() != Convergence::kSettled);
  take(filter, -100, 50, 900, 700);
  CHECK(filter.size() > 8);
  CHECK(filter.rule().recovery.count == 0);
  CHECK(filter.convergence() == Convergence::kNotConverged);
  for (int range = 0; range < 12; ++range) {
    take(filter, range % 2 == 0 ? -100 : 100, range % 3 == 0 ? 50 : -50, 900, 700);
  }
  CHECK(error_m(filter, 900, 700) < 5);
}

TEST_CASE_TEMPLATE("nothing is NaN or indefinite where geometry has no answer", Scalar, float,
                   double) {
  auto filter = Some<Scalar>::filter();
  const auto check = [&filter] {
    const auto P = filter.P();
    CHECK(auvest::math::all_finite(filter.belief()));
    CHECK(P(0, 0) > 0);
    CHECK(P(0, 0) * P(1, 1) > P(1, 0) * P(1, 0));
    CHECK(weight_sum(filter) == doctest::Approx(1));
  };
  const Scalar ranges[] = {80, Scalar(1e-3), 0, 3, 5000, 80, 1, 1, 1e6, 20};
  for (const double sigma : {0.5, 30.0, 1e4, 1e6}) {
    begin(filter, 0, 0, sigma);  // the leader at the mean
    for (const Scalar z : ranges) {
      const auto status = filter.update(Vector<Scalar, 1>(z), leader<Scalar>(0, 0)).status;
      CHECK(status == Status::kOk);
      check();
      REQUIRE(filter.predict(Scalar(5)) == Status::kOk);
    }
  }
  // The first range says "at the leader", or nearly.
  for (const double z : {0.0, 1e-3, 0.5}) {
    begin(filter, 30, 0, 1e4);
    for (int k = 0; k < 4; ++k) {
      const auto status =
          filter.update(Vector<Scalar, 1>(static_cast<Scalar>(z)), leader<Scalar>(0, 0)).status;
      CHECK(status == Status::kOk);
      check();
      // As from a range of one sigma: the ring's radius, its width and that of its components.
      if (k == 0) CHECK(sigma_m(filter) == doctest::Approx(std::sqrt(2)).epsilon(0.05));
    }
    CHECK(error_m(filter, 0, 0) < 1);
    CHECK(sigma_m(filter) > 0.5);
    CHECK(sigma_m(filter) < 3);
  }
  // Every slot taken, and all of them bend for a precise range from nearby.
  begin(filter, 0, 0, 1e4);
  take(filter, 0, 0, 900, 0);
  REQUIRE(filter.size() == 16);
  LeaderRange<Scalar, 2> precise = leader<Scalar>(850, 0);
  precise.params.sigma_range_m = Scalar(0.01);
  CHECK(filter.update(Vector<Scalar, 1>(Scalar(50)), precise).status == Status::kOk);
  check();
}

TEST_CASE("single precision: any sequence of ranges leaves a positive definite belief" *
          doctest::test_suite("statistics")) {
  auto filter = auvest::start_filter<float, auvest::Ekf, Igg, 16>();
  Random random(11, 1);
  int bad = 0;
  int several = 0;
  for (int sequence = 0; sequence < 3000; ++sequence) {
    const double sigma = std::pow(10, 6 * random.uniform<double>());
    begin(filter, 100 * random.normal<double>(), 100 * random.normal<double>(), sigma);
    for (int range = 0; range < 6; ++range) {
      LeaderRange<float, 2> sensor =
          leader<float>(300 * random.normal<double>(), 300 * random.normal<double>());
      sensor.params.sigma_range_m =
          static_cast<float>(std::pow(10, 2 * random.uniform<double>() - 1));
      const double z = std::pow(10, 4 * random.uniform<double>());
      if (filter.update(Vector<float, 1>(static_cast<float>(z)), sensor).status != Status::kOk)
        ++bad;
      Vector<float, 3> input(1, 0, 6 * random.uniform<float>());
      if (filter.predict(static_cast<float>(5 * random.uniform<double>()), input) != Status::kOk) {
        ++bad;
      }
      Matrix<float, 2, 2> P = filter.P();
      if (!auvest::math::all_finite(filter.belief()) || !auvest::math::is_positive_definite(P)) {
        ++bad;
      }
      several += filter.size() > 1 ? 1 : 0;
      if (std::fabs(weight_sum(filter) - 1) > 1e-5) ++bad;
    }
  }
  CHECK(bad == 0);
  CHECK(several > 3000);
}

TEST_CASE("a fix between the ranges tells two places apart") {
  auto filter = auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  begin(filter, 0, 0, 1e4);
  double at[2] = {-60, 80};
  for (int range = 1; range <= 12; ++range) {
    sail(filter, 0, at);
    take(filter, range % 2 == 0 ? -100 : 100, 0, at[0], at[1]);
  }
  REQUIRE(filter.size() == 2);
  auvest::Position<double, 2, 2>::Params params;
  params.covariance_m2 = Matrix<double, 2, 2>::Identity() * 25;
  const auvest::Position<double, 2, 2> fix(params);
  for (int k = 0; k < 2; ++k) {
    REQUIRE(filter.update(Vector<double, 2>(at[0] + 3, at[1] - 4), fix).status == Status::kOk);
  }
  CHECK(filter.size() == 1);
  CHECK(error_m(filter, at[0], at[1]) < 1);
}

TEST_CASE("late ranges: as if each had come in time, with several components too") {
  using Filter = decltype(auvest::start_filter<double, auvest::Ekf, Igg, 32>(16));
  Filter in_time = auvest::start_filter<double, auvest::Ekf, Igg, 32>(16);
  begin(in_time, 12, 9, 1e4);
  auvest::LateUpdates<Filter, LeaderRange<double, 2>, 32> late(in_time);
  const Vector<double, 3> input(1, 0, 0.3);
  const double stations[3][2] = {{0, 0}, {120, 0}, {60, 90}};
  const auto z = [&](int k) {
    return Vector<double, 1>(std::hypot(46 - stations[k % 3][0], 53 - stations[k % 3][1]) +
                             0.1 * (k % 2));
  };
  for (int k = 0; k < 9; ++k) {
    CAPTURE(k);
    const auto sensor = leader<double>(stations[k % 3][0], stations[k % 3][1]);
    REQUIRE(in_time.predict(5, input) == Status::kOk);
    REQUIRE(in_time.update(z(k), sensor).status == Status::kOk);
    REQUIRE(late.predict(5, input) == Status::kOk);
    if (k == 0) {
      REQUIRE(late.update(z(k), sensor).status == Status::kOk);
    } else {
      // The range before comes with this one's message, 5 s late.
      const auto previous = leader<double>(stations[(k - 1) % 3][0], stations[(k - 1) % 3][1]);
      if (k > 1) REQUIRE(late.update(z(k - 1), previous, 5).status == Status::kOk);
      auto now = late;
      REQUIRE(now.update(z(k), sensor).status == Status::kOk);
      CHECK(same_state(now.filter(), in_time));
    }
  }
}

// ---- A heading that is estimated too
// -------------------------------------------------------------

using Odometry = auvest::Odometry<double>;
using OdometryInside =
    auvest::Robust<auvest::Ekf<Odometry>,
                   auvest::RobustUpdate<Igg<double>, auvest::RejectionStreak<double>>>;
using OdometrySum = auvest::GaussianSum<OdometryInside, 32>;

OdometrySum odometry_filter(int components) {
  OdometrySum::Params params;
  params.components = static_cast<std::uint8_t>(components);
  return OdometrySum(OdometryInside(auvest::Ekf<Odometry>(Odometry())), params);
}

/// Runs that are right after 30 ranges to three leaders; the start's heading is known to half a
/// radian, or, with several headings, not at all.
int right_of(int runs, int components, int headings) {
  StartScenario scenario;
  scenario.leaders = 3;
  scenario.sigma_speed = 0;
  scenario.sigma_heading = 0;
  int right = 0;
  for (int run = 0; run < runs; ++run) {
    const auto number = static_cast<std::uint64_t>(run);
    auvest::StartWorld world(scenario, 4, number);
    Random random(5, number);
    OdometrySum filter = odometry_filter(components);
    Vector<double, 3> x(world.start()[0], world.start()[1],
                        world.heading() + 0.5 * random.normal<double>());
    Matrix<double, 3, 3> P = Matrix<double, 3, 3>::Identity() * 1e8;
    P(2, 2) = 0.25;
    REQUIRE((headings > 1 ? filter.reset(x, P, headings) : filter.reset(x, P)) == Status::kOk);
    double course = world.heading();
    for (int range = 1; range <= 30; ++range) {
      for (int second = 0; second < 5; ++second) {
        double speed, heading;
        world.advance(speed, heading);
        Vector<double, 3> input;
        input(0) = speed * (1 + 0.05 * random.normal<double>()) + 0.1 * random.normal<double>();
        input(1) = 0.05 * speed * random.normal<double>() + 0.1 * random.normal<double>();
        input(2) = world.heading() - course + 0.001 * random.normal<double>();
        course = world.heading();
        REQUIRE(filter.predict(1, input) == Status::kOk);
      }
      LeaderRange<double, 3> sensor;
      double there[2];
      const double z = world.range(range % 3, there);
      sensor.params.lift_smallest();
      sensor.params.leader_x_m = there[0];
      sensor.params.leader_y_m = there[1];
      REQUIRE(filter.update(Vector<double, 1>(z), sensor).status == Status::kOk);
    }
    right += auvest::StartError(filter, world).right() ? 1 : 0;
  }
  return right;
}

TEST_CASE("unknown start: with a heading known to half a radian, and with one not known at all" *
          doctest::test_suite("statistics")) {
  // The prototype: 99 and 95 % of 400 runs.
  const int runs = 100;
  CHECK(right_of(runs, 16, 1) >= runs * auvest::start_bound(0.99, 400, runs));
  CHECK(right_of(runs, 32, 4) >= runs * auvest::start_bound(0.95, 400, runs));
}

TEST_CASE("a heading that is not known: components all round, and a ring of each") {
  OdometrySum filter = odometry_filter(32);
  const Vector<double, 3> x(1, 2, 0);
  const Matrix<double, 3, 3> P = Matrix<double, 3, 3>::Identity() * 1e8;
  CHECK(filter.reset(x, P, 1) == Status::kBadParameter);
  CHECK(filter.reset(x, P, 5) == Status::kBadParameter);
  REQUIRE(filter.reset(x, P, 4) == Status::kOk);
  REQUIRE(filter.size() == 4);
  CHECK(filter.convergence() == Convergence::kNotConverged);
  for (int k = 0; k < 4; ++k) {
    CHECK(std::fabs(filter.component(k).x(2) - k * kPi / 2) < 1e-12);
    CHECK(filter.component(k).P(2, 2) == close_to(kPi * kPi / 16, 1e-12));
  }
  REQUIRE(filter.predict(1, Vector<double, 3>(0, 0, 0)) == Status::kOk);
  LeaderRange<double, 3> sensor;
  REQUIRE(filter.update(Vector<double, 1>(100), sensor).status == Status::kOk);
  CHECK(filter.size() == 32);
  CHECK(weight_sum(filter) == doctest::Approx(1));
  CHECK(filter.state().bend == close_to(300 * std::sqrt(2.0), 1e-7));
  int of_heading[4] = {0, 0, 0, 0};
  for (int k = 0; k < 32; ++k) {
    const auto& one = filter.component(k);
    CHECK(std::hypot(one.x(0), one.x(1)) == close_to(100 * (1 - kPi * kPi / 128), 0.01));
    of_heading[static_cast<int>(std::lround(one.x(2) / (kPi / 2)))] += 1;
  }
  for (const int count : of_heading) CHECK(count == 8);
  // Later a wide belief is one ring.
  CHECK(filter.state().headings == 1);
}

}  // namespace
