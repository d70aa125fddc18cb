#include <doctest/doctest.h>

#include "close.hpp"

#include <Eigen/LU>
#include <cmath>

#include "auvest/intervals/mahalanobis_interval.hpp"
#include "auvest/math/random.hpp"

namespace {

using auvest::Status;
using auvest::Vector;
using Law = auvest::MahalanobisInterval<double>;
using Position = Law::Position;

/// All the law asks of a filter: a state whose first two elements are the position.
struct Estimate {
  Position position;
  const Position& x() const { return position; }
};

double squared_distance(const Position& x0, const Position& r0, const Position& x1,
                        const Position& r1) {
  Law law;
  law.restart(x0, r0);
  law.next(Estimate{x1}, r1);
  return law.memory.mahalanobis_squared;
}

TEST_CASE("Eqs. (9) to (11): against Eigen on random points") {
  auvest::math::Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    Position p[4];
    for (auto& point : p) point << random.normal<double>(), random.normal<double>();
    const Position mean = (p[0] + p[1] + p[2] + p[3]) / 4;
    Eigen::Matrix2d s = Eigen::Matrix2d::Zero();
    for (const auto& point : p) s += (point - mean) * (point - mean).transpose() / 3;
    const Position v = p[2] - mean;
    const double expected = v.dot(s.inverse() * v);
    CHECK(squared_distance(p[0], p[1], p[2], p[3]) == close_to(expected, 1e-9));
    CHECK(squared_distance(p[0], p[1], p[2], p[3]) < 2.25 + 1e-12);  // (N - 1)^2 / N for N = 4
  }
}

TEST_CASE("finding 4: a constant error gives d^2 = 1.5, whatever its size") {
  // Estimate = reference + e: the four points form a parallelogram, whose corners all have 1.5.
  for (const double e : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    const Position r0(1, 2), r1(1.3, 1.8);
    const Position offset(0.6 * e, 0.8 * e);
    // At 1000 km the ridge, 2e-16 of the trace, begins to be felt in the narrow direction.
    CHECK(squared_distance(r0 + offset, r0, r1 + offset, r1) ==
          close_to(1.5, e == 1e6 ? 0.02 : 1e-4));
  }
}

TEST_CASE("in float the ridge begins at a thousandth of the step") {
  auvest::MahalanobisInterval<float> law;
  struct FloatEstimate {
    Vector<float, 2> position;
    const Vector<float, 2>& x() const { return position; }
  };
  for (const float e : {3e-3f, 0.1f, 10.0f, 100.0f}) {
    const Vector<float, 2> r0(0, 0), r1(0.3f, 0), offset(0, e);
    law.restart(r0 + offset, r0);
    law.next(FloatEstimate{r1 + offset}, r1);
    CHECK(double(law.memory.mahalanobis_squared) == close_to(1.5, 0.01));
  }
  // Far below the smallest step that matters, the points count as one.
  law.restart(Vector<float, 2>(0, 0), Vector<float, 2>(0, 0));
  law.next(FloatEstimate{Vector<float, 2>(1e-32f, 0)}, Vector<float, 2>(0, 1e-32f));
  CHECK(law.memory.mahalanobis_squared == 0);
}

TEST_CASE("d^2 sees the growth of an error, not its size") {
  // Errors e and g e across a straight track: d^2 = 3/4 + 3/2 g^2 / (1 + g^2).
  for (const double e : {1e-3, 1.0, 1e3}) {
    for (const double g : {-1.0, 0.0, 0.5, 1.0, 2.0, 10.0}) {
      CHECK(squared_distance(Position(0, e), Position(0, 0), Position(0.3, g * e),
                             Position(0.3, 0)) == close_to(0.75 + 1.5 * g * g / (1 + g * g), 1e-6));
    }
  }
}

TEST_CASE("collinear points: distance along the line; coincident points: zero") {
  // On a line the sample variance alone counts: points 0, 0, 1, 1 have d^2 = 0.25 / (1/3) = 0.75.
  CHECK(squared_distance(Position(0, 0), Position(0, 0), Position(3, 4), Position(3, 4)) ==
        close_to(0.75, 1e-5));
  CHECK(squared_distance(Position(5, 5), Position(5, 5), Position(5, 5), Position(5, 5)) == 0);
  // Far from the origin the coordinates' rounding spans a plane; it must not count.
  const Position far(1e5, -3e5);
  CHECK(squared_distance(far, far, far + Position(0.3, 0.4), far + Position(0.3, 0.4)) ==
        close_to(0.75, 1e-3));
}

TEST_CASE("Eqs. (7), (8), (12): one step by hand") {
  Law::Params params;
  params.gamma1_m2 = 0.25;
  Law law(params);
  law.restart(Position(0, 0), Position(0, 0));
  // d_t^2 = 0.01, d_e^2 = 0.04: M = 0.01 / 0.29.
  const double t = law.next(Estimate{Position(0.2, 0)}, Position(0, 0.1));
  CHECK(law.memory.ratio == close_to(0.01 / 0.29, 1e-14));
  CHECK(t == close_to(0.5 * 0.1 * 0.5 + 0.5 * (0.01 / 0.29), 1e-14));
  CHECK(law.memory.tau == close_to(1.6 / (law.memory.mahalanobis_squared + 1), 1e-12));

  // Restarted, it knows nothing of that step.
  REQUIRE(law.memory.mahalanobis_squared > 0);
  law.restart(Position(1, 2), Position(3, 4));
  CHECK(law.memory.ratio == 0);
  CHECK(law.memory.mahalanobis_squared == 0);
  CHECK(law.memory.tau == params.tau0);
  CHECK(law.memory.interval == params.initial_s);
  CHECK(law.memory.last_estimate == Position(1, 2));
  CHECK(law.memory.last_reference == Position(3, 4));
}

TEST_CASE("figure3: the steady interval is the fixed point at d^2 = 1.5, M = 0.9") {
  // T = (1 - tau) 0.1 T + tau 0.9 with tau = 1.6 / 2.5: T = 0.576 / 0.964.
  Law law;
  Position r(0, 0);
  const Position offset(0.3, -0.2);
  law.restart(r + offset, r);
  double t = 0;
  for (int k = 0; k < 30; ++k) {
    r += Position(0.1, 0.2);
    t = law.next(Estimate{r + offset}, r);
  }
  CHECK(t == close_to(0.576 / 0.964, 1e-6));
}

TEST_CASE("table1: the numbers of the paper's Table 1, and tau by them") {
  const Law::Params p = Law::Params::table1();
  CHECK(p.gamma1_m2 == 10);
  CHECK(p.gamma2 == 100);
  CHECK(p.min_s == 0.01);
  Law law(p);
  law.restart(Position(0, 0), Position(0, 0));
  // Points 0, 0, 5, 5 on a line: d^2 = 0.75. d_t = d_e = 5.
  const double t = law.next(Estimate{Position(3, 4)}, Position(3, 4));
  CHECK(law.memory.ratio == close_to(25.0 / 35.0, 1e-14));
  CHECK(t == close_to(0.5 * 0.1 * 0.5 + 0.5 * (25.0 / 35.0), 1e-14));
  CHECK(law.memory.tau == close_to(1.6 / 100.75, 1e-12));
}

TEST_CASE("table1: tau is at most eps / gamma2, so T falls to T_min (finding 1)") {
  Law law(Law::Params::table1());
  Position r(0, 0);
  law.restart(r, r);
  double t = law.initial();
  CHECK(t == 0.5);
  for (int k = 1; k < 60; ++k) {
    r += Position(0.1, 0.2);
    t = law.next(Estimate{r}, r);
    CHECK(law.memory.tau <= 0.016);
    if (k > 3) CHECK(t == law.params.min_s);
  }
}

TEST_CASE("the clamps hold for any input") {
  Law law;
  law.restart(Position(0, 0), Position(0, 0));
  const Position wild[] = {Position(1e308, -1e308), Position(-1e308, 1e308),
                           Position(1e150, 0),      Position(-1e150, 1e-150),
                           Position(0, 0),          Position(1e-160, 1e-160)};
  for (const auto& estimate : wild) {
    for (const auto& reference : wild) {
      const double t = law.next(Estimate{estimate}, reference);
      CHECK(t >= law.params.min_s);
      CHECK(t <= law.params.max_s);
      CHECK(law.memory.tau >= law.params.tau_min);
      CHECK(law.memory.tau <= law.params.tau_max);
      CHECK(std::isfinite(law.memory.mahalanobis_squared));
    }
  }
}

TEST_CASE("bad parameters are reported") {
  const auto changed = [](double Law::Params::*member, double value) {
    Law::Params params;
    params.*member = value;
    return Law(params).check();
  };
  using P = Law::Params;
  CHECK(Law().check() == Status::kOk);
  CHECK(Law(P::table1()).check() == Status::kOk);
  for (const double tau0 : {0.1, 0.3, 0.5, 0.9}) CHECK(changed(&P::tau0, tau0) == Status::kOk);
  CHECK(changed(&P::tau0, 0) == Status::kBadParameter);
  CHECK(changed(&P::tau0, 1) == Status::kBadParameter);
  CHECK(changed(&P::min_s, 0) == Status::kBadParameter);
  CHECK(changed(&P::min_s, 0.6) == Status::kBadParameter);  // above T(0)
  CHECK(changed(&P::max_s, 0.4) == Status::kBadParameter);  // below T(0)
  CHECK(changed(&P::max_s, std::nan("")) == Status::kBadParameter);
  CHECK(changed(&P::gamma1_m2, 0) == Status::kBadParameter);
  CHECK(changed(&P::gamma2, -1) == Status::kBadParameter);
  CHECK(changed(&P::epsilon, 0) == Status::kBadParameter);
  CHECK(changed(&P::scale, 1.5) == Status::kBadParameter);
  CHECK(changed(&P::scale, -0.1) == Status::kBadParameter);
  for (const double scale : {0.0, 1.0}) CHECK(changed(&P::scale, scale) == Status::kOk);
  CHECK(changed(&P::ratio_max, 0) == Status::kBadParameter);
  CHECK(changed(&P::ratio_max, 1) == Status::kOk);
  CHECK(changed(&P::ratio_max, 1.1) == Status::kBadParameter);
  CHECK(changed(&P::ratio_max, std::nan("")) == Status::kBadParameter);
  CHECK(changed(&P::tau_max, 1) == Status::kBadParameter);
  CHECK(changed(&P::tau_min, 0) == Status::kBadParameter);

  // The same of a memory, which is put back from outside: tau lies between 0 and 1, M within them.
  const auto remembering = [](double Law::Memory::*member, double value) {
    Law law;
    law.restart(Position(0, 0), Position(0, 0));
    law.memory.*member = value;
    return law.check();
  };
  using M = Law::Memory;
  CHECK(remembering(&M::tau, 0.25) == Status::kOk);
  for (const double tau : {0.0, 1.0, -0.5, std::nan("")}) {
    CHECK(remembering(&M::tau, tau) == Status::kBadParameter);
  }
  for (const double interval : {0.0, -1.0}) {
    CHECK(remembering(&M::interval, interval) == Status::kBadParameter);
  }
  for (const double ratio : {0.0, 1.0}) CHECK(remembering(&M::ratio, ratio) == Status::kOk);
  for (const double ratio : {-0.1, 1.1}) {
    CHECK(remembering(&M::ratio, ratio) == Status::kBadParameter);
  }
  CHECK(remembering(&M::mahalanobis_squared, 0) == Status::kOk);
  CHECK(remembering(&M::mahalanobis_squared, -1) == Status::kBadParameter);
}

}  // namespace
