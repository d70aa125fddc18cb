// Interacting multiple models against the textbook's own formulas, with the full matrix of
// transition probabilities.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>

#include "auvest/filters/imm.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"

namespace {

using auvest::Belief;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;
using Shares = Vector<double, 3>;
using ThreeModels = auvest::Imm<auvest::ConstantVelocity<double>, auvest::ExactAcceleration<double>,
                                auvest::CoordinatedTurn<double>>;

constexpr int n = 4;

struct Mixture {
  Belief<double, n> mode[3];
  Belief<double, n>* pointers[3];
  Vector<double, 3> log_weight;

  explicit Mixture(std::uint64_t seed, const Vector<double, 3>& probability) {
    Random random(seed);
    for (int k = 0; k < 3; ++k) {
      Matrix<double, n, n> a;
      for (int i = 0; i < n; ++i) {
        mode[k].x(i) = 100 + random.normal<double>();
        for (int j = 0; j < n; ++j) a(i, j) = random.normal<double>();
      }
      mode[k].P = a * a.transpose();
      pointers[k] = mode + k;
      log_weight(k) = std::log(probability(k));
    }
  }
};

TEST_CASE("mixing: the textbook's formulas with the full transition matrix") {
  const Vector<double, 3> mu(0.7, 0.25, 0.05);
  const Shares share(0.5, 0.2, 0.3);
  const double stay = 0.9;
  Mixture mixed(1, mu);
  const Mixture before = mixed;
  auvest::mix(mixed.pointers, mixed.log_weight, share, stay);
  for (int j = 0; j < 3; ++j) {
    double c = 0;
    for (int i = 0; i < 3; ++i) c += (stay * (i == j) + (1 - stay) * share(j)) * mu(i);
    CHECK(std::exp(mixed.log_weight(j)) == close_to(c, 1e-14));
    Vector<double, n> x = Vector<double, n>::Zero();
    Matrix<double, n, n> p = Matrix<double, n, n>::Zero();
    double weight[3];
    for (int i = 0; i < 3; ++i) {
      weight[i] = (stay * (i == j) + (1 - stay) * share(j)) * mu(i) / c;
      x += weight[i] * before.mode[i].x;
    }
    for (int i = 0; i < 3; ++i) {
      const Vector<double, n> d = before.mode[i].x - x;
      p += weight[i] * (before.mode[i].P + d * d.transpose());
    }
    for (int r = 0; r < n; ++r) {
      CHECK(mixed.mode[j].x(r) == close_to(x(r), 1e-14));
      for (int s = 0; s <= r; ++s)
        CHECK(std::fabs(mixed.mode[j].P(r, s) - p(r, s)) < 1e-13 * p.trace());
    }
  }
}

TEST_CASE(
    "mixing: probabilities after two steps are those of one as long; weights keep their sum") {
  ThreeModels::Params params;
  params.switch_rate_hz = 0.3;
  params.share << 0.6, 0.3, 0.1;
  const ThreeModels imm(params);
  REQUIRE(imm.check() == Status::kOk);
  Mixture twice(2, Vector<double, 3>(0.1, 0.1, 0.8));
  Mixture once = twice;
  for (int k = 0; k < 3; ++k) {
    once.pointers[k] = once.mode + k;
    once.log_weight(k) -= 200;  // a group of hypotheses that weighs e^-200
  }
  auvest::mix(twice.pointers, twice.log_weight, params.share, imm.stay(0.4));
  auvest::mix(twice.pointers, twice.log_weight, params.share, imm.stay(1.1));
  auvest::mix(once.pointers, once.log_weight, params.share, imm.stay(1.5));
  for (int k = 0; k < 3; ++k) {
    CHECK(once.log_weight(k) + 200 == close_to(twice.log_weight(k), 1e-12));
  }
  Vector<double, 3> part = Vector<double, 3>::Zero();
  CHECK(auvest::log_sum(once.log_weight, part) == close_to(-200, 1e-13));
  CHECK(part.sum() == close_to(1, 1e-14));
}

TEST_CASE("mixing: without switches nothing changes, not a bit; a dead model is revived by one") {
  const Vector<double, 3> mu(1, 0, 0);  // log 0 = -infinity
  Mixture mixed(3, mu);
  mixed.log_weight(1) = mixed.log_weight(2) = auvest::no_log_weight<double>();
  const Mixture before = mixed;
  auvest::mix(mixed.pointers, mixed.log_weight, Shares(0.5, 0.5, 0), 1.0);
  for (int k = 0; k < 3; ++k) {
    CHECK(mixed.mode[k].x == before.mode[k].x);
    CHECK(mixed.mode[k].P == before.mode[k].P);
    CHECK(mixed.log_weight(k) == before.log_weight(k));
  }
  auvest::mix(mixed.pointers, mixed.log_weight, Shares(0.5, 0.5, 0), 0.9);
  CHECK(std::exp(mixed.log_weight(1)) == close_to(0.05, 1e-14));
  for (int i = 0; i < n; ++i) {  // the model of probability 1 is all that it can come from
    CHECK(mixed.mode[1].x(i) == close_to(before.mode[0].x(i), 1e-15));
    CHECK(mixed.mode[1].P(i, i) == close_to(before.mode[0].P(i, i), 1e-13));
  }
  CHECK(mixed.log_weight(2) == before.log_weight(2));  // nothing leads to it
  CHECK(mixed.mode[2].x == before.mode[2].x);
}

TEST_CASE("mixing: without switches not a bit changes, whatever the probabilities") {
  Mixture mixed(4, Vector<double, 3>(0.7, 0.25, 0.05));
  const Mixture before = mixed;
  auvest::mix(mixed.pointers, mixed.log_weight, Shares(0.5, 0.2, 0.3), 1.0);
  for (int k = 0; k < 3; ++k) {
    CHECK(mixed.mode[k].x == before.mode[k].x);
    CHECK(mixed.mode[k].P == before.mode[k].P);
    CHECK(mixed.log_weight(k) == before.log_weight(k));
  }
}

TEST_CASE("models are refused where shares are none, rates are negative or a model is") {
  ThreeModels::Params params;
  CHECK(ThreeModels(params).check() == Status::kOk);
  CHECK(params.share.sum() == close_to(1, 1e-15));
  for (const double bad : {-0.1, 0.9, std::nan("")}) {
    params.share << bad, 0.5, 0.5;
    CHECK(ThreeModels(params).check() == Status::kBadParameter);
  }
  for (int j = 0; j < 3; ++j) {  // negative, and their sum is 1
    params.share.setConstant(0.55);
    params.share(j) = -0.1;
    CHECK(ThreeModels(params).check() == Status::kBadParameter);
  }
  for (const double sum : {0.998, 0.9995, 1.0005, 1.002}) {  // 1 to the digits of what is written
    params.share << sum - 0.5, 0.3, 0.2;
    CHECK(ThreeModels(params).check() ==
          (std::fabs(sum - 1) < 0.001 ? Status::kOk : Status::kBadParameter));
  }
  params.share << 0, 0.5, 0.5;
  CHECK(ThreeModels(params).check() == Status::kOk);
  for (const double bad : {-1.0, HUGE_VAL, std::nan("")}) {
    params.switch_rate_hz = bad;
    CHECK(ThreeModels(params).check() == Status::kBadParameter);
  }
  auvest::CoordinatedTurn<double>::Params turn;
  turn.slow_m_s = -1;
  const ThreeModels imm{ThreeModels::Params(), auvest::ConstantVelocity<double>(),
                        auvest::ExactAcceleration<double>(), auvest::CoordinatedTurn<double>(turn)};
  CHECK(imm.check() == Status::kBadParameter);
  auvest::ConstantVelocity<double>::Params straight;
  straight.velocity = -1;
  const ThreeModels first{ThreeModels::Params(), auvest::ConstantVelocity<double>(straight),
                          auvest::ExactAcceleration<double>(), auvest::CoordinatedTurn<double>()};
  CHECK(first.check() == Status::kBadParameter);
}

}  // namespace
