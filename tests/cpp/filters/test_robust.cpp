// The robust update: bits of the plain one where nothing is reweighted, the closed form elsewhere.
#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>

#include "auvest/auvest.hpp"

namespace {

using auvest::Decision;
using auvest::Matrix;
using auvest::Residual;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;

template <class Scalar, int Rows, int Cols>
bool same_bits(const Matrix<Scalar, Rows, Cols>& a, const Matrix<Scalar, Rows, Cols>& b) {
  return std::memcmp(a.data(), b.data(), sizeof(Scalar) * Rows * Cols) == 0;
}

// ---- The unit kernel, and any kernel that finds nothing to weight
// --------------------------------

/// Updates that are all accepted must leave the bits of the plain filter.
template <class Rule, class Filter>
void check_plain_bits(Filter plain, const Rule& rule) {
  using Scalar = typename Filter::Scalar;
  auvest::Robust<Filter, Rule> robust(plain, rule);
  const auvest::RangeBearing<Scalar, 6> sonar;
  Vector<Scalar, 6> x;
  x << Scalar(3), Scalar(-4), Scalar(0.2), Scalar(0.1), Scalar(0), Scalar(0.01);
  const Matrix<Scalar, 6, 6> P = Matrix<Scalar, 6, 6>::Identity() * Scalar(0.5);
  REQUIRE(plain.reset(x, P) == Status::kOk);
  REQUIRE(robust.reset(x, P) == Status::kOk);
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    REQUIRE(plain.predict(Scalar(0.5)) == Status::kOk);
    REQUIRE(robust.predict(Scalar(0.5)) == Status::kOk);
    Vector<Scalar, 2> z;  // gross errors too, and the near field at times
    z << std::abs(Scalar(6.6) + Scalar(3) * random.normal<Scalar>()),
        Scalar(-1.1) + random.normal<Scalar>();
    const auto a = plain.update(z, sonar);
    const auto b = robust.update(z, sonar);
    REQUIRE(a.status == Status::kOk);
    REQUIRE(b.status == Status::kOk);
    CHECK(b.decision == Decision::kAccepted);
    CHECK(b.iterations == 1);
    CHECK(a.near_field == b.near_field);
    CHECK(a.nis == b.nis);
    CHECK(same_bits(a.S, b.S));
    CHECK(same_bits(a.innovation, b.innovation));
    CHECK(same_bits(plain.x(), robust.x()));
    CHECK(same_bits(plain.P(), robust.P()));
  }
}

/// The same for a range, which has code of its own.
template <class Filter>
void check_plain_bits_of_a_range() {
  using Scalar = typename Filter::Scalar;
  Filter plain{typename Filter::Process()};
  auvest::Robust<Filter, auvest::RobustUpdate<auvest::Unit<Scalar>>> robust(plain);
  const auvest::LeaderRange<Scalar, 2> leader;
  const Vector<Scalar, 2> x(Scalar(30), Scalar(-40));
  const Matrix<Scalar, 2, 2> P = Matrix<Scalar, 2, 2>::Identity();
  REQUIRE(plain.reset(x, P) == Status::kOk);
  REQUIRE(robust.reset(x, P) == Status::kOk);
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    const Vector<Scalar, 3> motion(Scalar(1), Scalar(0), Scalar(0.02) * Scalar(k));
    REQUIRE(plain.predict(Scalar(0.5), motion) == Status::kOk);
    REQUIRE(robust.predict(Scalar(0.5), motion) == Status::kOk);
    const Vector<Scalar, 1> z(Scalar(50) + Scalar(5) * random.normal<Scalar>());
    const auto a = plain.update(z, leader);
    const auto b = robust.update(z, leader);
    REQUIRE(b.decision == Decision::kAccepted);
    CHECK(a.nis == b.nis);
    CHECK(same_bits(a.S, b.S));
    CHECK(same_bits(plain.x(), robust.x()));
    CHECK(same_bits(plain.P(), robust.P()));
  }
}

template <class Scalar>
void check_plain_bits_of_all() {
  using Process = auvest::ExactAcceleration<Scalar>;
  const auvest::Ekf<Process> ekf{Process()};
  const auvest::Ukf<Process> ukf{Process()};
  using Unit = auvest::RobustUpdate<auvest::Unit<Scalar>>;
  using Igg = auvest::RobustUpdate<auvest::Igg<Scalar>, auvest::RejectionStreak<Scalar>>;
  typename auvest::Igg<Scalar>::Params infinite;
  infinite.k0 = infinite.k1 = std::numeric_limits<Scalar>::infinity();
  Unit post_fit;
  post_fit.params.residual = Residual::kPostFit;
  check_plain_bits(ekf, Unit());
  check_plain_bits(ukf, Unit());
  check_plain_bits(ekf, post_fit);
  check_plain_bits(ukf, Igg(auvest::Igg<Scalar>(infinite)));
}

TEST_CASE("robust update: unit kernel, or infinite thresholds, give the bits of the plain filter") {
  check_plain_bits_of_all<double>();
  check_plain_bits_of_all<float>();
  check_plain_bits_of_a_range<auvest::Ekf<auvest::SpeedHeading<float>>>();
  check_plain_bits_of_a_range<auvest::Ukf<auvest::SpeedHeading<float>>>();
}

// ---- Weights
// -------------------------------------------------------------------------------------

constexpr int kN = 3;
constexpr int kM = 2;
using Process = auvest::LinearProcess<double, kN>;
using Sensor = auvest::LinearMeasurement<double, kN, kM>;
using Scalar1 = auvest::LinearMeasurement<double, kN, 1, 1>;

Process still() {
  const Matrix<double, kN, kN> zero = Matrix<double, kN, kN>::Zero();
  return Process(Matrix<double, kN, kN>::Identity(), zero);
}

Matrix<double, kN, kN> prior() {
  Matrix<double, kN, kN> p;
  p << 2, 0.5, 0.3, 0.5, 1, -0.2, 0.3, -0.2, 1.5;
  return p;
}

Sensor sensor() {
  Matrix<double, kM, kN> h;
  h << 1, 0, 0.2, 0, 0.5, 1;
  Matrix<double, kM, kM> r;
  r << 0.3, 0.1, 0.1, 0.2;
  return Sensor(h, r);
}

template <class Rule>
auvest::Robust<auvest::Ekf<Process>, Rule> robust_ekf(const Rule& rule) {
  auvest::Robust<auvest::Ekf<Process>, Rule> filter(auvest::Ekf<Process>(still()), rule);
  REQUIRE(filter.reset(Vector<double, kN>::Zero(), prior()) == Status::kOk);
  return filter;
}

/// The textbook update with R + diag(R_mm (1 / w_m - 1)); a component of weight 0 is left out.
template <class Filter>
void check_textbook(const Filter& filter, const Vector<double, kM>& z,
                    const Vector<double, kM>& weight) {
  Matrix<double, kM, kM> r = sensor().noise;
  for (int m = 0; m < kM; ++m) {
    r(m, m) = weight(m) > 0 ? r(m, m) / weight(m) : 1e18;
  }
  const Matrix<double, kM, kN> h = sensor().matrix;
  const Matrix<double, kM, kM> s = h * prior() * h.transpose() + r;
  const Matrix<double, kN, kM> gain = prior() * h.transpose() * s.inverse();
  const Vector<double, kN> x = gain * z;
  const Matrix<double, kN, kN> p = prior() - gain * s * gain.transpose();
  CHECK((filter.x() - x).cwiseAbs().maxCoeff() < 1e-13);
  CHECK((filter.P() - p).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("robust update: innovation form, weights from innovation / sqrt S") {
  using Rule = auvest::RobustUpdate<auvest::Igg<double>>;
  const Matrix<double, kM, kM> s =
      sensor().matrix * prior() * sensor().matrix.transpose() + sensor().noise;
  struct Case {
    double t[2], weight[2];
    Decision decision;
  };
  for (const Case& c : {Case{{1, -1.4}, {1, 1}, Decision::kAccepted},
                        Case{{2, -1.4}, {0.75, 1}, Decision::kDownweighted},
                        Case{{2, -2.5}, {0.75, 0.6}, Decision::kDownweighted},
                        Case{{50, 1}, {0, 1}, Decision::kDownweighted},
                        Case{{1, -4}, {1, 0}, Decision::kDownweighted},
                        Case{{2, 1e3}, {0.75, 0}, Decision::kDownweighted},
                        Case{{3.1, -9}, {0, 0}, Decision::kRejected}}) {
    auto filter = robust_ekf(Rule());
    Vector<double, kM> z, weight;
    for (int m = 0; m < kM; ++m) {
      z(m) = c.t[m] * std::sqrt(s(m, m));
      weight(m) = c.weight[m];
    }
    const auto correction = filter.update(z, sensor());
    REQUIRE(correction.status == Status::kOk);
    CHECK(correction.decision == c.decision);
    CHECK(correction.iterations == 1);
    for (int m = 0; m < kM; ++m) {
      CHECK(correction.standardised(m) == close_to(c.t[m], 1e-14));
      CHECK(std::fabs(correction.weight(m) - c.weight[m]) < 1e-14);
    }
    // S and NIS are those of the plain update, whatever the weights.
    CHECK((correction.S - s).cwiseAbs().maxCoeff() < 1e-14);
    CHECK(correction.nis == close_to(z.dot(s.inverse() * z), 1e-12));
    if (c.decision == Decision::kRejected) {
      CHECK(filter.x() == (Vector<double, kN>::Zero()));
      CHECK(filter.P() == prior());
    } else {
      check_textbook(filter, z, weight);
    }
  }
}

/// One number that N states are seen through, weighted: x, P, S and NIS of the textbook.
template <int N>
void check_one_number(Residual residual) {
  using Still = auvest::LinearProcess<double, N>;
  using One = auvest::LinearMeasurement<double, N, 1>;
  using Rule = auvest::RobustUpdate<auvest::Igg<double>>;
  using Square = Matrix<double, N, N>;
  Rule::Params params;
  params.residual = residual;
  Square p = Square::Identity();
  p(0, 1) = p(1, 0) = 0.5;
  Matrix<double, 1, N> h = Matrix<double, 1, N>::Constant(0.7);
  h(0) = -0.4;
  const double r = 0.3;
  const double s = (h * p * h.transpose())(0) + r;
  for (const double t : {1.2, 2.0, -2.9, 3.5}) {
    auvest::Robust<auvest::Ekf<Still>, Rule> filter(
        auvest::Ekf<Still>(Still(Square::Identity(), Square::Zero())),
        Rule(auvest::Igg<double>(), auvest::NoRecovery<double>(), params));
    REQUIRE(filter.reset(Vector<double, N>::Zero(), p) == Status::kOk);
    const double z = t * std::sqrt(s);
    const auto u = filter.update(Vector<double, 1>(z), One(h, Matrix<double, 1, 1>(r)));
    REQUIRE(u.status == Status::kOk);
    CHECK(u.S(0, 0) == close_to(s, 1e-14));
    CHECK(u.nis == close_to(z * z / s, 1e-14));
    const double size = std::fabs(t);
    if (residual == Residual::kInnovation) {
      const double wanted = size < 1.5 ? 1 : size < 3 ? 1.5 / size : 0;
      CHECK(std::fabs(u.weight(0) - wanted) < 1e-14);
    }
    const double weight = u.weight(0);
    const Vector<double, N> gain = weight > 0 ? p * h.transpose() / (s + r / weight - r)
                                              : Vector<double, N>(0 * h.transpose());
    CHECK((filter.x() - gain * z).cwiseAbs().maxCoeff() < 1e-14);
    CHECK((filter.P() - (p - gain * (h * p))).cwiseAbs().maxCoeff() < 1e-14);
  }
}

TEST_CASE("robust update: one number, weighted") {
  for (const Residual residual : {Residual::kInnovation, Residual::kPostFit}) {
    check_one_number<2>(residual);
    check_one_number<3>(residual);
  }
}

TEST_CASE("robust update: the post-fit form is a fixed point of Eq. (20)") {
  // One state of variance p, seen with variance r; Huber's post-fit residual v solves
  // v = z r_w / (p + r_w) with r_w = r / w and w = k sqrt(r) / |v|: v = z - p k / sqrt(r).
  using Rule = auvest::RobustUpdate<auvest::Huber<double>>;
  Rule::Params params;
  params.residual = Residual::kPostFit;
  params.tolerance = 1e-12;
  params.max_iterations = 100;
  const Rule rule{auvest::Huber<double>(), auvest::NoRecovery<double>(), params};
  const double p = 2, r = 0.25, k = 1.345;
  const Scalar1 one{Matrix<double, 1, 1>(1.0), Matrix<double, 1, 1>(r)};
  for (const double z : {1.0, 7.0, -9.0, 20.0}) {
    auto filter = robust_ekf(rule);
    const auto correction = filter.update(Vector<double, 1>(z), one);
    REQUIRE(correction.status == Status::kOk);
    const double plain = z * r / (p + r);
    const double pull = p * k / std::sqrt(r);
    const double v = std::fabs(plain) < k * std::sqrt(r) ? plain : z - (z > 0 ? pull : -pull);
    CHECK(correction.standardised(0) == close_to(v / std::sqrt(r), 1e-9));
    CHECK(correction.weight(0) == close_to(std::fmin(1, k * std::sqrt(r) / std::fabs(v)), 1e-9));
    CHECK(filter.x()(0) == close_to(z - v, 1e-9));
    CHECK((correction.iterations == 1) == (std::fabs(plain) < k * std::sqrt(r)));
    CHECK(correction.iterations < 100);
  }
}

TEST_CASE("robust update: the number of iterations is bounded, weights are those that were used") {
  using Rule = auvest::RobustUpdate<auvest::Huber<double>>;
  Rule::Params params;
  params.residual = Residual::kPostFit;
  params.tolerance = 0;
  params.max_iterations = 3;
  auto filter = robust_ekf(Rule{auvest::Huber<double>(), auvest::NoRecovery<double>(), params});
  const Vector<double, kM> z(7, -8);
  const auto correction = filter.update(z, sensor());
  CHECK(correction.iterations == 3);
  CHECK(correction.weight(0) < 1);
  check_textbook(filter, z, correction.weight);
}

TEST_CASE("robust update: post-fit residuals that are all rejected end the iteration") {
  using Rule = auvest::RobustUpdate<auvest::Igg<double>>;
  Rule::Params params;
  params.residual = Residual::kPostFit;
  auto filter = robust_ekf(Rule{auvest::Igg<double>(), auvest::NoRecovery<double>(), params});
  const Vector<double, kM> z(70, -80);
  const auto correction = filter.update(z, sensor());
  REQUIRE(correction.status == Status::kOk);
  CHECK(correction.decision == Decision::kRejected);
  CHECK(correction.iterations == 1);  // the next would take a measurement of nothing
  for (int m = 0; m < kM; ++m) CHECK(correction.weight(m) == 0);
  const Matrix<double, kM, kM> s =
      sensor().matrix * prior() * sensor().matrix.transpose() + sensor().noise;
  CHECK(correction.nis == close_to(z.dot(s.inverse() * z), 1e-12));
  // The residuals that were judged are those after the plain update.
  const Vector<double, kM> residual = sensor().noise * s.inverse() * z;
  for (int m = 0; m < kM; ++m) {
    CHECK(correction.standardised(m) ==
          close_to(residual(m) / std::sqrt(sensor().noise(m, m)), 1e-12));
  }
  CHECK(filter.x() == (Vector<double, kN>::Zero()));
  CHECK(filter.P() == prior());
}

TEST_CASE("robust update: a change of weight within the tolerance is none") {
  using Rule = auvest::RobustUpdate<auvest::Huber<double>>;
  Rule::Params params;
  params.residual = Residual::kPostFit;
  params.tolerance = 0.5;
  auto filter = robust_ekf(Rule{auvest::Huber<double>(), auvest::NoRecovery<double>(), params});
  const double p = prior()(0, 0);
  const Scalar1 one{Matrix<double, 1, 1>(1.0), Matrix<double, 1, 1>(1.0)};
  // A plain post-fit residual of 2 sigma: its weight would be 0.67.
  const auto correction = filter.update(Vector<double, 1>(2 * (p + 1)), one);
  CHECK(correction.standardised(0) == close_to(2, 1e-12));
  CHECK(correction.weight(0) == 1);
  CHECK(correction.decision == Decision::kAccepted);
  CHECK(correction.iterations == 1);
}

TEST_CASE("robust update: weights that rise are followed as those that fall") {
  // Two instruments see one state and disagree by 20 sigma. The plain update lies between them: the
  // first looks nearly as bad as the second, which is rejected. Without the second it is good.
  using Rule = auvest::RobustUpdate<auvest::Igg<double>>;
  Rule::Params params;
  params.residual = Residual::kPostFit;
  auvest::Igg<double>::Params thresholds;
  thresholds.k0 = 2;
  thresholds.k1 = 10;
  auto filter =
      robust_ekf(Rule{auvest::Igg<double>(thresholds), auvest::NoRecovery<double>(), params});
  Matrix<double, kM, kN> h;
  h << 1, 0, 0, 1, 0, 0;
  const Sensor both(h, Matrix<double, kM, kM>::Identity());
  const auto correction = filter.update(Vector<double, kM>(0, 20), both);
  REQUIRE(correction.status == Status::kOk);
  CHECK(correction.weight(0) == 1);
  CHECK(correction.weight(1) == 0);
  CHECK(std::fabs(filter.x()(0)) < 1e-12);
  const double p = prior()(0, 0);
  CHECK(filter.P()(0, 0) == close_to(p / (p + 1), 1e-12));
}

TEST_CASE("robust update: the adaptive filter takes it, and only the kernel's side is changed") {
  using Acceleration = auvest::ExactAcceleration<double>;
  using Rule = auvest::RobustUpdate<auvest::Igg<double>, auvest::RejectionStreak<double>>;
  using RobustUkf = auvest::Robust<auvest::Ukf<Acceleration>, Rule>;
  using Policy = auvest::CovarianceBudget<double>;
  auvest::AdaptiveInterval<RobustUkf, Policy> filter{
      RobustUkf(auvest::Ukf<Acceleration>(Acceleration()))};
  Vector<double, 6> x;
  x << 30, 2, 0, 0, 0, 0;
  REQUIRE(filter.reset(x, 0.01 * Matrix<double, 6, 6>::Identity()) == Status::kOk);
  const auvest::RangeBearing<double, 6> sonar;
  REQUIRE(filter.predict(filter.interval()) == Status::kOk);
  const auto good = filter.update(sonar.h(x), sonar);
  CHECK(good.decision == Decision::kAccepted);
  const auto before = filter.belief();
  Vector<double, 2> late = sonar.h(x);
  late(0) += 10;  // multipath: the range is late, the bearing is good
  const auto bad = filter.update(late, sonar);
  CHECK(bad.decision == Decision::kDownweighted);
  CHECK(bad.weight(0) == 0);
  CHECK(bad.weight(1) == 1);
  CHECK(filter.x()(0) == close_to(before.x(0), 1e-4));
  CHECK(filter.feedback(Vector<double, 2>(30, 2)) == Status::kOk);
}

// ---- Failures
// ------------------------------------------------------------------------------------

TEST_CASE("robust update: refuses what the plain one refuses, and bad parameters") {
  using Rule = auvest::RobustUpdate<auvest::Igg<double>, auvest::RejectionStreak<double>>;
  auvest::Robust<auvest::Ekf<Process>, Rule> filter(auvest::Ekf<Process>{still()});
  const Vector<double, kM> z(0.1, 0.1);
  CHECK(filter.update(z, sensor()).status == Status::kNotInitialised);
  REQUIRE(filter.reset(Vector<double, kN>::Zero(), prior()) == Status::kOk);
  CHECK(filter.update(Vector<double, kM>(0.1, std::nan("")), sensor()).status ==
        Status::kNotFinite);
  Sensor broken = sensor();
  broken.noise(1, 1) = -1;
  const auto refused = filter.update(z, broken);
  CHECK(refused.status == Status::kNotPositiveDefinite);
  CHECK(refused.weight(0) == 0);
  CHECK(filter.update(Vector<double, kM>(1e300, 0), sensor()).status == Status::kOverflow);
  const Matrix<double, 1, kN> row(1, 0, 0);
  for (const double r : {-1.0, 0.3}) {  // one number: with a weight of 0, and NIS beyond the range
    const auvest::LinearMeasurement<double, kN, 1> one(row, Matrix<double, 1, 1>(r));
    const auto alone = filter.update(Vector<double, 1>(r < 0 ? 9 : 1e300), one);
    CHECK(alone.status == (r < 0 ? Status::kNotPositiveDefinite : Status::kOverflow));
    CHECK(alone.S(0, 0) == 0);
  }
  Sensor indefinite = sensor();  // beside a wide prior S does not show it
  indefinite.noise << 0.1, 0.2, 0.2, 0.1;
  const auto alike = filter.update(Vector<double, kM>(90, -90), indefinite);
  CHECK(alike.status == Status::kNotPositiveDefinite);
  CHECK(alike.decision == Decision::kAccepted);
  CHECK(alike.nis == 0);
  CHECK(filter.P() == prior());
  CHECK(filter.rule().recovery.count == 0);

  const auto reset_with = [](const Rule& rule) {
    auvest::Robust<auvest::Ekf<Process>, Rule> other(auvest::Ekf<Process>(still()), rule);
    return other.reset(Vector<double, kN>::Zero(), prior());
  };
  Rule bad;
  bad.kernel.params.k0 = -1;
  CHECK(reset_with(bad) == Status::kBadParameter);
  bad = Rule();
  bad.recovery.params.rejections = 0;
  CHECK(reset_with(bad) == Status::kBadParameter);
  bad = Rule();
  bad.params.max_iterations = 1;
  CHECK(reset_with(bad) == Status::kBadParameter);
  bad.params.max_iterations = 2;
  CHECK(reset_with(bad) == Status::kOk);
  bad = Rule();
  bad.params.tolerance = -1;
  CHECK(reset_with(bad) == Status::kBadParameter);
  CHECK(filter.restore(filter.belief(), bad) == Status::kBadParameter);

  // Those of the filter inside are asked for, too.
  auvest::Ukf<Process>::Params flat;
  flat.alpha = 0;
  const auvest::Robust<auvest::Ukf<Process>, Rule> inside(auvest::Ukf<Process>(still(), flat));
  CHECK(inside.check() == Status::kBadParameter);
}

TEST_CASE("robust update: what was saved goes on with the same bits, whatever the rule before") {
  using Rule = auvest::RobustUpdate<auvest::Igg<double>, auvest::RejectionStreak<double>>;
  auto filter = robust_ekf(Rule());
  const Vector<double, kM> far(30, -40);
  REQUIRE(filter.update(far, sensor()).decision == Decision::kRejected);
  REQUIRE(filter.rule().recovery.count > 0);
  Rule bad;
  bad.params.tolerance = -1;
  auvest::Robust<auvest::Ekf<Process>, Rule> other(auvest::Ekf<Process>(still()), bad);
  CHECK(other.check() == Status::kBadParameter);
  CHECK(other.restore(filter.belief()) == Status::kBadParameter);  // with the rule that it has
  CHECK_FALSE(other.initialised());
  REQUIRE(other.restore(filter.belief(), filter.rule()) == Status::kOk);
  CHECK(other.check() == Status::kOk);
  for (int k = 0; k < 8; ++k) {
    const auto a = filter.update(far, sensor());
    const auto b = other.update(far, sensor());
    CHECK(a.recovered == b.recovered);
    CHECK(filter.rule().recovery.count == other.rule().recovery.count);
    CHECK(same_bits(filter.x(), other.x()));
    CHECK(same_bits(filter.P(), other.P()));
  }
  CHECK(other.reset(Vector<double, kN>::Zero(), prior()) == Status::kOk);
  CHECK(other.rule().recovery.count == 0);
  // A belief that is refused leaves the rule, too.
  auto broken = filter.belief();
  broken.x(0) = std::nan("");
  CHECK(other.restore(broken, filter.rule()) == Status::kNotFinite);
  CHECK(other.rule().recovery.count == 0);
}

// ---- How a filter is written down ---------------------------------------------------------------

/// From a process alone or from nothing, a filter is that of all its parts; a range may be a plain
/// number.
template <class Filter>
void check_short_forms(Filter whole) {
  using Motion = typename Filter::Process;
  Filter from_process{Motion()};
  Filter from_nothing;
  const auvest::LeaderRange<float, 2> beacon;
  Filter* const filters[] = {&whole, &from_process, &from_nothing};
  for (Filter* filter : filters) {
    REQUIRE(filter->reset(Vector<float, 2>(30, -40), Matrix<float, 2, 2>::Identity()) ==
            Status::kOk);
    REQUIRE(filter->predict(2.0f, Vector<float, 3>(1.5f, 0.1f, 0.3f)) == Status::kOk);
    const auto report = filter == &whole ? filter->update(Vector<float, 1>(53.0f), beacon)
                                         : filter->update(53.0f, beacon);
    REQUIRE(report.status == Status::kOk);
    CHECK(report.nis > 0.1f);
    CHECK(same_bits(filter->x(), whole.x()));
    CHECK(same_bits(filter->P(), whole.P()));
  }
}

TEST_CASE("filters: from a process alone, and from nothing") {
  using Motion = auvest::SpeedHeading<float>;
  using Inside = auvest::Ekf<Motion>;
  using Rule = auvest::RobustUpdate<auvest::Igg<float>, auvest::RejectionStreak<float>>;
  using Policy = auvest::MahalanobisInterval<float>;
  check_short_forms(Inside(Motion()));
  check_short_forms(auvest::Ckf<Motion>(Motion()));
  check_short_forms(auvest::Ukf<Motion>(Motion(), auvest::Ukf<Motion>::default_params()));
  check_short_forms(auvest::RobustEkf<Motion>(Inside(Motion()), Rule()));
  check_short_forms(auvest::Aukf<Motion>(auvest::Ukf<Motion>(Motion()), Policy()));
  check_short_forms(auvest::GaussianSum<auvest::RobustEkf<Motion>>(
      auvest::RobustEkf<Motion>(Inside(Motion()), Rule())));
}

}  // namespace
