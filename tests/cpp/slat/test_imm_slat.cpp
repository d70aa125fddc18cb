// The SLAT filters with an Imm as Master: against the textbook's filter with dense matrices,
// against each other, against the plain filters to the bit; manoeuvres are recognised.
#include <doctest/doctest.h>

#include "close.hpp"
#include "paper.hpp"

#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "simulation/slat.hpp"

namespace {

using auvest::Belief;
using auvest::Echo;
using auvest::Matrix;
using auvest::Status;
using auvest::Vector;
using auvest::math::Random;
using slat_test::OpenEkf;
using slat_test::paper;

template <class Scalar>
using Unicycle = auvest::UnicycleMotion<Scalar>;
template <class Scalar>
using Straight = auvest::ConstantVelocity<Scalar>;
template <class Scalar>
using Turn = auvest::CoordinatedTurn<Scalar>;
template <class Scalar>
using Accelerated = auvest::ExactAcceleration<Scalar>;
template <class Scalar>
using Three = auvest::Imm<Straight<Scalar>, Accelerated<Scalar>, Turn<Scalar>>;

template <class Scalar>
Three<Scalar> three_models(double rate) {
  typename Three<Scalar>::Params params;
  params.switch_rate_hz = Scalar(rate);
  params.share << Scalar(0.6), Scalar(0.2), Scalar(0.2);
  return Three<Scalar>(params);
}

/// A particle filter and its storage.
template <class Filter>
struct Owner {
  std::vector<typename Filter::Scalar> storage;
  Filter filter;

  Owner(const typename Filter::Motion& motion, const typename Filter::Master& master, int particles,
        const typename Filter::Params& params = paper<typename Filter::Params>())
      : storage(Filter::Set::storage_size(particles)),
        filter(motion, master, params, storage.data(), particles) {}
};

template <class Scalar>
Belief<Scalar, 6> master_belief(double x, double y) {
  Belief<Scalar, 6> belief;
  belief.x << Scalar(x), Scalar(y), Scalar(2), Scalar(-1), Scalar(0.01), Scalar(0);
  belief.P.setZero();
  for (int i = 0; i < 6; ++i) belief.P(i, i) = Scalar(i < 2 ? 4 : 0.01);
  return belief;
}

template <class Scalar>
Belief<Scalar, 3> slave_belief(double variance) {
  Belief<Scalar, 3> belief;
  belief.x << Scalar(1), Scalar(2), Scalar(3.0);
  belief.P.setZero();
  for (int i = 0; i < 3; ++i) belief.P(i, i) = Scalar(variance);
  return belief;
}

template <class Scalar>
auvest::Sonar<Scalar> sonar_from_heading() {
  typename auvest::Sonar<Scalar>::Params params;
  params.bearing = auvest::Bearing::kFromHeading;
  return auvest::Sonar<Scalar>(params);
}

// ---- Against the textbook
// ---------------------------------------------------------------------------

/// Interacting multiple models over the joint state of a unicycle and two masters, each straight or
/// turning: four hypotheses and their transition matrix, with the formulas of Bar-Shalom, Li and
/// Kirubarajan, 11.6.6, written out.
struct Textbook {
  static constexpr int kStates = 15;
  using State = Eigen::Matrix<double, kStates, 1>;
  using Square = Eigen::Matrix<double, kStates, kStates>;

  State x[4];
  Square P[4];
  double mu[4];

  static Vector<double, 6> f(int model, const Vector<double, 6>& x, double dt) {
    return model == 0 ? Straight<double>().f(x, dt) : Turn<double>().f(x, dt);
  }
  static Matrix<double, 6, 6> phi(int model, const Vector<double, 6>& x, double dt) {
    return model == 0 ? Straight<double>().Phi(x, dt) : Turn<double>().Phi(x, dt);
  }
  static Matrix<double, 6, 6> q(int model, double dt) {
    return model == 0 ? Straight<double>().Q(dt) : Turn<double>().Q(dt);
  }

  static State difference(const State& a, const State& b) {
    State d = a - b;
    d(2) = auvest::math::wrap(d(2));
    return d;
  }

  /// The mixture of all by the given weights, about the first.
  void moments(const double (&weight)[4], State& mean, Square& covariance) const {
    mean = x[0];
    for (int i = 0; i < 4; ++i) mean += weight[i] * difference(x[i], x[0]);
    covariance.setZero();
    for (int i = 0; i < 4; ++i) {
      const State d = difference(x[i], mean);
      covariance += weight[i] * (P[i] + d * d.transpose());
    }
    mean(2) = auvest::math::wrap(mean(2));
  }

  void interact(const double (&share)[2], double stay) {
    State mean[4];
    Square covariance[4];
    double predicted[4];
    for (int j = 0; j < 4; ++j) {
      double weight[4];
      predicted[j] = 0;
      for (int i = 0; i < 4; ++i) {
        double p = 1;
        for (int m = 0; m < 2; ++m) {
          const int from = i >> m & 1, to = j >> m & 1;
          p *= stay * (from == to) + (1 - stay) * share[to];
        }
        weight[i] = p * mu[i];
        predicted[j] += weight[i];
      }
      for (double& w : weight) w /= predicted[j];
      moments(weight, mean[j], covariance[j]);
    }
    for (int j = 0; j < 4; ++j) {
      x[j] = mean[j];
      P[j] = covariance[j];
      mu[j] = predicted[j];
    }
  }

  void predict(int j, const Unicycle<double>& motion, const Vector<double, 2>& u, double dt) {
    Square transition = Square::Identity();
    Square noise = Square::Zero();
    Belief<double, 3> slave;
    slave.x = x[j].head<3>();
    slave.P.setZero();
    const auto step = motion.step(u, dt);
    transition.topLeftCorner<3, 3>() = motion.transition(step, slave.x);
    noise.topLeftCorner<3, 3>() = motion.noise(step, slave.x);
    motion.propagate(step, slave);
    x[j].head<3>() = slave.x;
    for (int m = 0; m < 2; ++m) {
      const int at = 3 + 6 * m, model = j >> m & 1;
      const Vector<double, 6> master = x[j].segment<6>(at);
      transition.block<6, 6>(at, at) = phi(model, master, dt);
      noise.block<6, 6>(at, at) = q(model, dt);
      x[j].segment<6>(at) = f(model, master, dt);
    }
    P[j] = (transition * P[j] * transition.transpose() + noise).eval();
  }

  /// Returns the likelihood of the echo.
  double update(int j, const Echo<double>& seen, const auvest::Sonar<double>& sonar) {
    auvest::Sonar<double>::View<double, 3> view;
    const int at = 3 + 6 * seen.master;
    const Vector<double, 3> here = x[j].head<3>();
    sonar.look(here, x[j](at), x[j](at + 1), seen.z, view);
    Eigen::Matrix<double, 2, kStates> h = Eigen::Matrix<double, 2, kStates>::Zero();
    h.leftCols<3>() = view.by_slave;
    h.middleCols<2>(at) = view.by_master;
    const Eigen::Matrix2d s = h * P[j] * h.transpose() + sonar.R<double>();
    const Eigen::Matrix<double, kStates, 2> gain = P[j] * h.transpose() * s.inverse();
    x[j] += gain * view.innovation;
    x[j](2) = auvest::math::wrap(x[j](2));
    P[j] = (P[j] - gain * s * gain.transpose()).eval();
    const double nis = view.innovation.dot(s.inverse() * view.innovation);
    return std::exp(-0.5 * nis) / (2 * auvest::math::pi<double>() * std::sqrt(s.determinant()));
  }
};

TEST_CASE("EKF-SLAT with an Imm: two masters, against the textbook over the joint Gaussian") {
  using Two = auvest::Imm<Straight<double>, Turn<double>>;
  Two::Params params;
  params.switch_rate_hz = 0.2;
  params.share << 0.7, 0.3;
  const Unicycle<double> motion;
  OpenEkf<Unicycle<double>, Two, 2> slat(motion, Two(params));
  Random random(5);
  const auto start = slave_belief<double>(0.01);
  REQUIRE(slat.reset(start, random) == Status::kOk);
  Textbook book;
  book.x[0].setZero();
  book.P[0].setZero();
  book.x[0].head<3>() = start.x;
  book.P[0].topLeftCorner<3, 3>() = start.P;
  for (int m = 0; m < 2; ++m) {
    const auto belief = master_belief<double>(60 - 100 * m, 80);
    REQUIRE(slat.add_master(belief) == Status::kOk);
    book.x[0].segment<6>(3 + 6 * m) = belief.x;
    book.P[0].block<6, 6>(3 + 6 * m, 3 + 6 * m) = belief.P;
  }
  const double share[2] = {0.7, 0.3};
  for (int j = 0; j < 4; ++j) {
    book.x[j] = book.x[0];
    book.P[j] = book.P[0];
    book.mu[j] = share[j & 1] * share[j >> 1];
  }
  const auto sonar = sonar_from_heading<double>();
  double log_likelihood = 0;
  for (int k = 0; k < 60; ++k) {
    const Vector<double, 2> u(2, 0);
    const double dt = 0.5;
    REQUIRE(slat.predict(dt, u, random) == Status::kOk);
    book.interact(share, std::exp(-0.2 * dt));
    for (int j = 0; j < 4; ++j) book.predict(j, motion, u, dt);
    if (k % 3 == 0) continue;

    Echo<double> seen;
    seen.master = k / 3 % 2;
    const double t = 0.5 * (k + 1), side = seen.master == 0 ? 60 : -40;
    const auto slave = slat.slave().x;
    const double dx = side + 2 * t - slave(0), dy = 80 - t + 0.02 * t * t - slave(1);
    seen.z << std::hypot(dx, dy) + random.normal<double>(),
        auvest::math::wrap(std::atan2(dy, dx) - slave(2) + 0.06 * random.normal<double>());
    REQUIRE(slat.update(&seen, 1, sonar, random) == Status::kOk);
    double sum = 0;
    for (int j = 0; j < 4; ++j) {
      book.mu[j] *= book.update(j, seen, sonar);
      sum += book.mu[j];
    }
    for (double& mu : book.mu) mu /= sum;
    log_likelihood += std::log(sum);
    for (int j = 0; j < 2; ++j) {
      CHECK(slat.mode_probability(0, j) == close_to(book.mu[j] + book.mu[2 + j], 1e-9));
      CHECK(slat.mode_probability(1, j) == close_to(book.mu[2 * j] + book.mu[2 * j + 1], 1e-9));
    }
  }
  Textbook::State x;
  Textbook::Square P;
  book.moments(book.mu, x, P);
  const auto belief = slat.belief();
  for (int i = 0; i < Textbook::kStates; ++i) {
    CHECK(std::fabs(belief.x(i) - x(i)) < 1e-8);
    for (int j = 0; j <= i; ++j) CHECK(std::fabs(belief.P(i, j) - P(i, j)) < 1e-8);
  }
  CHECK(slat.log_likelihood() == close_to(log_likelihood, 1e-9));
}

TEST_CASE("EKF-SLAT with an Imm: headings on both sides of the cut are mixed as any others") {
  // The same run about a heading of 0 and, turned by half a circle, about one of pi.
  for (int run = 0; run < 100; ++run) {
    OpenEkf<Unicycle<double>, Three<double>, 1> filter[2];
    Random random(6), world[2] = {Random(7), Random(7)};
    for (int turned = 0; turned < 2; ++turned) {
      const double sign = turned == 1 ? -1 : 1;
      filter[turned] = OpenEkf<Unicycle<double>, Three<double>, 1>(Unicycle<double>(),
                                                                   three_models<double>(0.5));
      auto start = slave_belief<double>(0.01);
      start.x << 0, 0, 0.002 * (run - 50) + (turned == 1 ? auvest::math::pi<double>() : 0);
      auto master = master_belief<double>(20, 10);
      master.x *= sign;
      REQUIRE(filter[turned].reset(start, random) == Status::kOk);
      REQUIRE(filter[turned].add_master(master) == Status::kOk);
      for (int k = 0; k < 20; ++k) {
        REQUIRE(filter[turned].predict(1, Vector<double, 2>(1, 0), random) == Status::kOk);
        Echo<double> seen;
        seen.master = 0;
        seen.z << 25 + 5 * world[turned].normal<double>(), 0.5 * world[turned].normal<double>();
        REQUIRE(filter[turned].update(&seen, 1, sonar_from_heading<double>(), random) ==
                Status::kOk);
      }
    }
    CHECK((filter[0].master(0).x + filter[1].master(0).x).norm() < 1e-8);
    const auto a = filter[0].slave().x;
    const auto b = filter[1].slave().x;
    CHECK(std::fabs(auvest::math::wrap(a(2) - b(2))) == close_to(auvest::math::pi<double>(), 1e-8));
    CHECK(std::hypot(a(0) + b(0), a(1) + b(1)) < 1e-8);
  }
}

// ---- Against the plain filters, and each other
// ------------------------------------------------------

template <class Scalar, class Filter, class Other>
void check_same_bits(Filter& imm, Other& plain) {
  Random random_imm(7), random_plain(7), noise(8);
  const auto start = slave_belief<Scalar>(0.01);
  REQUIRE(imm.reset(start, random_imm) == Status::kOk);
  REQUIRE(plain.reset(start, random_plain) == Status::kOk);
  REQUIRE(imm.add_master(master_belief<Scalar>(60, 80)) == Status::kOk);
  REQUIRE(plain.add_master(master_belief<Scalar>(60, 80)) == Status::kOk);
  const auto sonar = sonar_from_heading<Scalar>();
  const Vector<Scalar, 2> change(Scalar(0.1), Scalar(-0.05));
  for (int k = 0; k < 40; ++k) {
    const Vector<Scalar, 2> u(Scalar(2), Scalar(0.05));
    REQUIRE(imm.predict(Scalar(0.5), u, random_imm, &change) == Status::kOk);
    REQUIRE(plain.predict(Scalar(0.5), u, random_plain, &change) == Status::kOk);
    Echo<Scalar> seen;
    seen.master = 0;
    seen.z << Scalar(100 + noise.normal<double>()), Scalar(-2 + 0.06 * noise.normal<double>());
    REQUIRE(imm.update(&seen, 1, sonar, random_imm) == Status::kOk);
    REQUIRE(plain.update(&seen, 1, sonar, random_plain) == Status::kOk);
    REQUIRE(imm.slave().x == plain.slave().x);
    REQUIRE(imm.slave().P == plain.slave().P);
    REQUIRE(imm.master(0).x == plain.master(0).x);
    REQUIRE(imm.master(0).P == plain.master(0).P);
    REQUIRE(imm.log_likelihood() == plain.log_likelihood());
  }
  CHECK(imm.mode_probability(0, 0) == Scalar(1));
}

TEST_CASE_TEMPLATE("Imm: where one model has probability 1 and no other follows, the plain filter",
                   Scalar, float, double) {
  typename Three<Scalar>::Params only;
  only.switch_rate_hz = Scalar(0);
  only.share << Scalar(1), Scalar(0), Scalar(0);
  const Three<Scalar> master(only);
  const Unicycle<Scalar> motion;
  OpenEkf<Unicycle<Scalar>, Three<Scalar>, 1> imm(motion, master);
  OpenEkf<Unicycle<Scalar>, Straight<Scalar>, 1> plain(motion, Straight<Scalar>());
  check_same_bits<Scalar>(imm, plain);
  using Imm1 = auvest::Slatf1<Unicycle<Scalar>, Three<Scalar>, 1>;
  using Plain1 = auvest::Slatf1<Unicycle<Scalar>, Straight<Scalar>, 1>;
  Owner<Imm1> imm1(motion, master, 50);
  Owner<Plain1> plain1(motion, Straight<Scalar>(), 50);
  check_same_bits<Scalar>(imm1.filter, plain1.filter);
  using Imm2 = auvest::Slatf2<Unicycle<Scalar>, Three<Scalar>, 1>;
  using Plain2 = auvest::Slatf2<Unicycle<Scalar>, Straight<Scalar>, 1>;
  Owner<Imm2> imm2(motion, master, 50);
  Owner<Plain2> plain2(motion, Straight<Scalar>(), 50);
  check_same_bits<Scalar>(imm2.filter, plain2.filter);
}

TEST_CASE("Imm: with a slave that is known, one particle is the joint filter") {
  Unicycle<double>::Params still;
  still.sigma_speed_m_s = still.sigma_yaw_rate_rad_s = 0;
  const Unicycle<double> motion(still);
  OpenEkf<Unicycle<double>, Three<double>, 1> joint(motion, three_models<double>(0.1));
  using Filter = auvest::Slatf1<Unicycle<double>, Three<double>, 1>;
  Owner<Filter> owner(motion, three_models<double>(0.1), 1);
  Random random(9);
  REQUIRE(joint.reset(slave_belief<double>(0), random) == Status::kOk);
  REQUIRE(owner.filter.reset(slave_belief<double>(0), random) == Status::kOk);
  REQUIRE(joint.add_master(master_belief<double>(60, 80)) == Status::kOk);
  REQUIRE(owner.filter.add_master(master_belief<double>(60, 80)) == Status::kOk);
  const auto sonar = sonar_from_heading<double>();
  for (int k = 0; k < 50; ++k) {
    const Vector<double, 2> u(2, 0.05);
    REQUIRE(joint.predict(0.5, u, random) == Status::kOk);
    REQUIRE(owner.filter.predict(0.5, u, random) == Status::kOk);
    Echo<double> seen;
    seen.master = 0;
    seen.z << 100 + random.normal<double>(), -2 + 0.06 * random.normal<double>();
    REQUIRE(joint.update(&seen, 1, sonar, random) == Status::kOk);
    REQUIRE(owner.filter.update(&seen, 1, sonar, random) == Status::kOk);
    double sum = 0;
    for (int j = 0; j < 3; ++j) {
      CHECK(owner.filter.mode_probability(0, j) == close_to(joint.mode_probability(0, j), 1e-9));
      sum += joint.mode_probability(0, j);
    }
    CHECK(sum == close_to(1, 1e-14));
    for (int i = 0; i < 6; ++i) {
      CHECK(std::fabs(owner.filter.master(0).x(i) - joint.master(0).x(i)) < 1e-9);
    }
  }
  CHECK(owner.filter.log_likelihood() == close_to(joint.log_likelihood(), 1e-10));
}

// ---- Manoeuvres
// -------------------------------------------------------------------------------------

/// A master at 5 m/s goes straight for 100 s, turns at 0.1 rad/s for 60 s and goes straight again;
/// the slave is 100 m away and drifts. Means of probabilities over the last 30 s of each.
struct Manoeuvre {
  double manoeuvring[3] = {0, 0, 0};
  double accelerating = 0, turning = 0;  ///< models, in the turn
  double largest_defect = 0;             ///< of the sum of the probabilities from 1

  template <class Filter>
  explicit Manoeuvre(Filter& filter) {
    using Scalar = typename Filter::Scalar;
    Random world(21), random(22);
    Belief<Scalar, 3> start = slave_belief<Scalar>(1e-4);
    REQUIRE(filter.reset(start, random) == Status::kOk);
    auvest::SlatVehicle master;
    master.position[0] = 40;
    master.position[1] = 60;
    master.speed = 5;
    Belief<Scalar, 6> prior = master_belief<Scalar>(40, 60);
    prior.x.template tail<4>().setZero();
    prior.P(2, 2) = prior.P(3, 3) = Scalar(25);
    REQUIRE(filter.add_master(prior) == Status::kOk);
    typename auvest::Sonar<Scalar>::Params sonar;
    sonar.bearing = auvest::Bearing::kFromHeading;
    sonar.sigma_range_m = Scalar(0.3);
    sonar.sigma_bearing_rad = Scalar(0.003);
    for (int t = 0; t < 260; ++t) {
      master.turn_rate = t >= 100 && t < 160 ? 0.1 : 0;
      master.turn_start_s = 0;
      master.advance(t, 1);
      const Vector<Scalar, 2> u(Scalar(0), Scalar(0));
      REQUIRE(filter.predict(Scalar(1), u, random) == Status::kOk);
      const double dx = master.position[0] - 1, dy = master.position[1] - 2;
      Echo<Scalar> seen;
      seen.master = 0;
      seen.z << Scalar(std::hypot(dx, dy) + 0.3 * world.normal<double>()),
          Scalar(auvest::math::wrap(std::atan2(dy, dx) - 3 + 0.003 * world.normal<double>()));
      REQUIRE(filter.update(&seen, 1, auvest::Sonar<Scalar>(sonar), random) == Status::kOk);
      double sum = 0;
      for (int j = 0; j < 3; ++j) sum += static_cast<double>(filter.mode_probability(0, j));
      largest_defect = std::fmax(largest_defect, std::fabs(sum - 1));
      const int phase = t < 100 ? 0 : t < 160 ? 1 : 2;
      const int end = phase == 0 ? 100 : phase == 1 ? 160 : 260;
      if (t >= end - 30) {
        const double accelerated = static_cast<double>(filter.mode_probability(0, 1));
        const double turned = static_cast<double>(filter.mode_probability(0, 2));
        manoeuvring[phase] += (accelerated + turned) / 30;
        accelerating += phase == 1 ? accelerated : 0;
        turning += phase == 1 ? turned : 0;
      }
    }
  }
};

template <class Scalar>
Three<Scalar> manoeuvring_models() {
  Three<Scalar> master = three_models<Scalar>(0.02);
  typename Straight<Scalar>::Params straight;
  straight.velocity = Scalar(1e-4);
  straight.sigma_acceleration_m_s2 = Scalar(0.3);
  typename Turn<Scalar>::Params turn;
  turn.noise.position = turn.noise.velocity = Scalar(0);
  turn.noise.acceleration = Scalar(1e-4);
  turn.slow_m_s = Scalar(0.1);
  auvest::AccelerationNoise<Scalar> jerk;
  jerk.position = jerk.velocity = Scalar(0);
  jerk.acceleration = Scalar(1e-4);
  return Three<Scalar>(master.params, Straight<Scalar>(straight), Accelerated<Scalar>(jerk),
                       Turn<Scalar>(turn));
}

template <class Scalar>
Unicycle<Scalar> drifting() {
  typename Unicycle<Scalar>::Params params;
  params.sigma_speed_m_s = Scalar(0.01);
  params.sigma_yaw_rate_rad_s = Scalar(1e-4);
  return Unicycle<Scalar>(params);
}

template <class Filter>
void check_manoeuvre(Filter& filter) {
  const Manoeuvre found(filter);
  CHECK(found.largest_defect < 1e-5);
  CHECK(found.manoeuvring[0] < 0.05);
  CHECK(found.manoeuvring[1] > 0.9);
  CHECK(found.manoeuvring[2] < 0.05);
  CHECK(found.turning > 2 * found.accelerating);
}

TEST_CASE_TEMPLATE("Imm: a turn is recognised, and its end", Scalar, float, double) {
  OpenEkf<Unicycle<Scalar>, Three<Scalar>, 1> joint(drifting<Scalar>(),
                                                    manoeuvring_models<Scalar>());
  check_manoeuvre(joint);
  using Filter = auvest::Slatf2<Unicycle<Scalar>, Three<Scalar>, 1>;
  Owner<Filter> owner(drifting<Scalar>(), manoeuvring_models<Scalar>(), 100);
  check_manoeuvre(owner.filter);
}

// ---- What must not happen
// -------------------------------------------------------------------------------

// Without a gate an echo of 9e8 m may carry the belief to where a float is coarse, which the filter
// then says; behind a gate it may not.
template <class Filter>
void check_survival(Filter& filter, bool gated) {
  Random random(31), world(32);
  REQUIRE(filter.reset(slave_belief<float>(0.01), random) == Status::kOk);
  REQUIRE(filter.add_master(master_belief<float>(60, 80)) == Status::kOk);
  const auto sonar = sonar_from_heading<float>();
  const float far[] = {0, 1e-20f, 1e3f, 1e6f, 9e8f};
  for (int k = 0; k < 300; ++k) {
    // Silence of 200 s, then echoes of which each third is wrong by anything.
    const float dt = k == 150 ? 200 : k % 7 == 0 ? 0.0f : 0.5f;
    const Status predicted = filter.predict(dt, Vector<float, 2>(2, 0.05f), random);
    REQUIRE((predicted == Status::kOk || (!gated && predicted == Status::kFarFromOrigin)));
    Echo<float> seen;
    seen.master = 0;
    seen.z << 100 + world.normal<float>(), -2 + 0.06f * world.normal<float>();
    if (k % 3 == 2) seen.z(0) = far[k / 3 % 5];
    const Status status = filter.update(&seen, 1, sonar, random);
    REQUIRE((status == Status::kOk || status == Status::kOverflow));
    const auto slave = filter.slave();
    const auto master = filter.master(0);
    REQUIRE(auvest::math::all_finite(slave));
    REQUIRE(auvest::math::all_finite(master));
    for (int i = 0; i < 6; ++i) REQUIRE(master.P(i, i) > 0);
    float sum = 0;
    for (int j = 0; j < 3; ++j) {
      REQUIRE(filter.mode_probability(0, j) >= 0);
      sum += filter.mode_probability(0, j);
    }
    REQUIRE(std::fabs(sum - 1) < 1e-5f);
  }
}

TEST_CASE("Imm: whatever is heard, and after a long silence, numbers stay numbers") {
  for (const float gate : {0.0f, 16.0f}) {
    CAPTURE(gate);
    using Joint = OpenEkf<Unicycle<float>, Three<float>, 1>;
    Joint::Params joint_params;
    joint_params.gate = gate;
    Joint joint(Unicycle<float>(), three_models<float>(0.1), joint_params);
    check_survival(joint, gate > 0);
    using Filter = auvest::Slatf2<Unicycle<float>, Three<float>, 1>;
    Filter::Params params;
    params.gate = gate;
    Owner<Filter> owner(Unicycle<float>(), three_models<float>(0.1), 40, params);
    check_survival(owner.filter, gate > 0);
  }
}

TEST_CASE("EKF-SLAT with an Imm: the NIS is the mean over the hypotheses before the echo") {
  // Without switches the hypotheses are two plain filters, and their weights follow from the shares
  // and from what each of them found likely so far.
  using Two = auvest::Imm<Straight<double>, Accelerated<double>>;
  Two::Params params;
  params.switch_rate_hz = 0;
  params.share << 0.7, 0.3;
  const Unicycle<double> motion;
  OpenEkf<Unicycle<double>, Two, 1> both(motion, Two(params));
  OpenEkf<Unicycle<double>, Straight<double>, 1> straight(motion, Straight<double>());
  OpenEkf<Unicycle<double>, Accelerated<double>, 1> accelerated(motion, Accelerated<double>());
  Random random(42);
  auto master = master_belief<double>(60, 80);
  master.x(4) = 0.5;  // which the first takes for nothing
  REQUIRE(both.reset(slave_belief<double>(0.01), random) == Status::kOk);
  REQUIRE(straight.reset(slave_belief<double>(0.01), random) == Status::kOk);
  REQUIRE(accelerated.reset(slave_belief<double>(0.01), random) == Status::kOk);
  REQUIRE(both.add_master(master) == Status::kOk);
  REQUIRE(straight.add_master(master) == Status::kOk);
  REQUIRE(accelerated.add_master(master) == Status::kOk);
  const auto sonar = sonar_from_heading<double>();
  const Vector<double, 2> u(0, 0);
  for (int k = 0; k < 4; ++k) {
    REQUIRE(both.predict(2, u, random) == Status::kOk);
    REQUIRE(straight.predict(2, u, random) == Status::kOk);
    REQUIRE(accelerated.predict(2, u, random) == Status::kOk);
    Echo<double> seen;
    seen.master = 0;
    seen.z << 98 + 2 * k, -2.1 - 0.02 * k;
    const double a = 0.7 * std::exp(straight.log_likelihood());
    const double b = 0.3 * std::exp(accelerated.log_likelihood());
    CHECK(both.mode_probability(0, 0) == close_to(a / (a + b), 1e-9));
    REQUIRE(both.update(&seen, 1, sonar, random) == Status::kOk);
    REQUIRE(straight.update(&seen, 1, sonar, random) == Status::kOk);
    REQUIRE(accelerated.update(&seen, 1, sonar, random) == Status::kOk);
    if (k == 0) CHECK(std::fabs(straight.nis() - accelerated.nis()) > 0.05);
    CHECK(both.nis() == close_to((a * straight.nis() + b * accelerated.nis()) / (a + b), 1e-9));
  }
}

/// Puts a state of all hypotheses of a filter far away, through its visit_state().
template <class Joint>
struct PutFar {
  int state;

  void operator()(Joint& joint) const { joint.x(state) = 1e25f; }
  template <class Other>
  void operator()(Other&) const {}
  template <class Count>
  void count(Count&) const {}
  template <class Count>
  void count(Count&, Count) const {}
};

TEST_CASE("EKF-SLAT with an Imm: an echo that overflows in all hypotheses is refused") {
  using Filter = OpenEkf<Unicycle<float>, Three<float>, 2>;
  Filter filter(Unicycle<float>(), three_models<float>(0.1));
  Random random(43);
  REQUIRE(filter.reset(slave_belief<float>(0.01), random) == Status::kOk);
  REQUIRE(filter.add_master(master_belief<float>(60, 80)) == Status::kOk);
  REQUIRE(filter.add_master(master_belief<float>(90, 0)) == Status::kOk);
  PutFar<Filter::BeliefType> far = {Filter::Model::first_of(1)};  // its range overflows
  Filter::visit_state(static_cast<Filter&>(filter), far);
  const auto sonar = sonar_from_heading<float>();
  Echo<float> seen[2];
  seen[0].master = 0;
  seen[0].z << 98, -2.1f;
  seen[1].master = 1;
  seen[1].z << 300, 0;
  REQUIRE(filter.update(seen, 1, sonar, random) == Status::kOk);
  const auto before = filter.belief();
  const float nis = filter.nis();
  const float log_likelihood = filter.log_likelihood();
  float probability[3];
  for (int k = 0; k < 3; ++k) probability[k] = filter.mode_probability(0, k);
  CHECK(nis > 0);
  CHECK(filter.update(seen, 2, sonar, random) == Status::kOverflow);
  CHECK(filter.belief().x == before.x);
  CHECK(filter.belief().P == before.P);
  CHECK(filter.nis() == nis);
  CHECK(filter.log_likelihood() == log_likelihood);
  for (int k = 0; k < 3; ++k) CHECK(filter.mode_probability(0, k) == probability[k]);
  CHECK(filter.update(seen, 1, sonar, random) == Status::kOk);
}

TEST_CASE("EKF-SLAT with an Imm: what is refused leaves it as it was") {
  using Filter = OpenEkf<Unicycle<double>, Three<double>, 1>;
  Random random(41);
  Filter filter(Unicycle<double>(), three_models<double>(0.1));
  const auto sonar = sonar_from_heading<double>();
  Echo<double> seen;
  seen.master = 0;
  seen.z << 100, -2;
  const Vector<double, 2> u(2, 0.05);
  CHECK(filter.predict(1, u, random) == Status::kNotInitialised);
  CHECK(filter.update(&seen, 1, sonar, random) == Status::kNotInitialised);
  CHECK(filter.add_master(master_belief<double>(60, 80)) == Status::kNotInitialised);
  REQUIRE(filter.reset(slave_belief<double>(0.01), random) == Status::kOk);
  CHECK(filter.update(&seen, 1, sonar, random) == Status::kBadParameter);  // there is no master
  REQUIRE(filter.add_master(master_belief<double>(60, 80)) == Status::kOk);
  CHECK(filter.add_master(master_belief<double>(0, 0)) == Status::kBadParameter);
  REQUIRE(filter.predict(1, u, random) == Status::kOk);
  const auto before = filter.belief();
  const double probability = filter.mode_probability(0, 1);
  CHECK(filter.predict(-1, u, random) == Status::kTimeBackwards);
  CHECK(filter.predict(std::nan(""), u, random) == Status::kNotFinite);
  CHECK(filter.predict(1, Vector<double, 2>(HUGE_VAL, 0), random) == Status::kNotFinite);
  seen.z(1) = std::nan("");
  CHECK(filter.update(&seen, 1, sonar, random) == Status::kNotFinite);
  seen.z(1) = 0;
  seen.master = 1;
  CHECK(filter.update(&seen, 1, sonar, random) == Status::kBadParameter);
  CHECK(filter.belief().x == before.x);
  CHECK(filter.belief().P == before.P);
  CHECK(filter.mode_probability(0, 1) == probability);
  Three<double>::Params none;
  none.share << 0, 0, 0;
  Filter bad{Unicycle<double>(), Three<double>(none)};
  CHECK(bad.reset(slave_belief<double>(0.01), random) == Status::kBadParameter);
  for (const double gate : {-0.1, std::nan(""), HUGE_VAL}) {
    Filter::Params params;
    params.gate = gate;
    Filter gated(Unicycle<double>(), three_models<double>(0.1), params);
    CHECK(gated.reset(slave_belief<double>(0.01), random) == Status::kBadParameter);
  }
}

}  // namespace
