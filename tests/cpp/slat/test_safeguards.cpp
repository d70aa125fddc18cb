// What the SLAT filters do against echoes and silences that their models do not know: too long a
// step, too large a number, hours of silence, a master that is lost behind the gate.
#include <doctest/doctest.h>

#include "brute_force.hpp"
#include "close.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <type_traits>
#include <vector>

#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "auvest/slat/outage.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "auvest/slat/slatf_shared.hpp"

namespace {

TEST_CASE("safeguards: silence is counted from a master's last echo, or from when it was known") {
  // Another master's time goes on; what lay in memory before does not count.
  using Guards = auvest::Safeguards<double, 2>;
  std::aligned_storage<sizeof(Guards), alignof(Guards)>::type memory;
  std::memset(&memory, 0x45, sizeof memory);  // numbers of 1e25
  Guards& guards = *new (&memory) Guards;
  auvest::EchoParams<double> p;
  p.forget_after_s = 10;
  guards.begin(0);
  CHECK(!guards.forgotten(0, p));
  guards.wait(10, 1);
  CHECK(!guards.forgotten(0, p));  // at the bound, not beyond it
  guards.begin(1);
  guards.wait(0.5, 2);
  CHECK(guards.forgotten(0, p));
  CHECK(!guards.forgotten(1, p));
  guards.accepted(0);
  CHECK(!guards.forgotten(0, p));
  guards.wait(9.75, 2);
  CHECK(!guards.forgotten(0, p));
  CHECK(guards.forgotten(1, p));
  guards.reborn(1);
  CHECK(!guards.forgotten(1, p));
  p.forget_after_s = 0;  // never
  guards.wait(1e6, 2);
  CHECK(!guards.forgotten(0, p));
}

TEST_CASE("safeguards: the bounds of their parameters, on both sides") {
  using P = auvest::EchoParams<double>;
  const auto valid = [](void (*change)(P&)) {
    P p;
    change(p);
    return p.valid();
  };
  CHECK(P().valid());
  CHECK(valid([](P& p) { p.gate = 0; }));
  CHECK(!valid([](P& p) { p.gate = -1; }));
  CHECK(valid([](P& p) { p.recover_after = p.recover_of = 16; }));
  CHECK(!valid([](P& p) { p.recover_of = 17; }));
  CHECK(!valid([](P& p) { p.recover_after = 9; }));  // of 8
  CHECK(valid([](P& p) { p.recover_after = 0; }));
  CHECK(!valid([](P& p) { p.recover_after = -1; }));
  CHECK(!valid([](P& p) { p.fastest_m_s = 0; }));
  CHECK(!valid([](P& p) { p.forget_after_s = -1; }));
  CHECK(valid([](P& p) { p.rebirth_velocity_m_s = p.rebirth_acceleration_m_s2 = 1e9; }));
  CHECK(!valid([](P& p) { p.rebirth_velocity_m_s = 1.001e9; }));
  CHECK(!valid([](P& p) { p.rebirth_acceleration_m_s2 = 1.001e9; }));
  CHECK(!valid([](P& p) { p.rebirth_velocity_m_s = 0; }));
  CHECK(!valid([](P& p) { p.rebirth_acceleration_m_s2 = 0; }));
  CHECK(valid([](P& p) { p.longest_step_s = HUGE_VAL; }));
  CHECK(!valid([](P& p) { p.longest_step_s = 0; }));
}

using namespace slat_test;

using Motion = Compass<float>;
using Ekf = auvest::EkfSlat<Motion, Master<float>, 1>;
using First = auvest::Slatf1<Motion, Master<float>, 1>;
using Second = auvest::Slatf2<Motion, Master<float>, 1>;
using Joint = auvest::SlatfJoint<Motion, Master<float>, 1>;
using Shared = auvest::SlatfShared<Motion, Master<float>, 1>;
using Three = auvest::Imm<auvest::ConstantVelocity<float>, auvest::ExactAcceleration<float>>;
using ImmEkf = auvest::EkfSlat<Motion, Three, 1>;

Motion good_odometry() {
  Motion::Params p;
  p.sigma_speed_m_s = 0.1f;
  p.sigma_heading_rad = 0.05f;
  return Motion(p);
}

auvest::Sonar<float> good_sonar() {
  auvest::Sonar<float>::Params p;
  p.sigma_range_m = 0.1f;
  p.sigma_bearing_rad = 0.01f;
  return auvest::Sonar<float>(p);
}

/// The next random number, which stays the next.
float next_of(Random random) { return random.uniform<float>(); }

/// A filter of 16 particles, if it has any, at the origin, certain of it, with a master at (x, y).
template <class Filter>
struct Started {
  std::vector<float> storage;
  std::unique_ptr<Filter> filter;
  Random random{3};
  Vector<float, 2> u{1.0f, 0.0f};

  explicit Started(float x = 0, float y = 300,
                   const typename Filter::Params& params = typename Filter::Params()) {
    make(params, static_cast<Filter*>(nullptr));
    typename Filter::SlaveBelief pose;
    pose.x.setZero();
    pose.P.setZero();
    REQUIRE(filter->reset(pose, random) == Status::kOk);
    auto prior = master_belief<float>(double(x), double(y), 0, 0, 1);
    for (int i = 2; i < 6; ++i) prior.P(i, i) = i < 4 ? 0.1f : 0.01f;
    REQUIRE(filter->add_master(prior) == Status::kOk);
  }

  Status predict(float dt) { return filter->predict(dt, u, random); }

  /// An echo of a master that stands `x`, `y` from the slave.
  Status hear(float x, float y) {
    Echo<float> echo;
    echo.master = 0;
    echo.z << std::hypot(x, y), std::atan2(-y, -x);
    return filter->update(&echo, 1, good_sonar(), random);
  }
  /// An echo from where the filter expects it.
  Status hear_expected() {
    const auto master = filter->master(0).x;
    const auto slave = filter->slave().x;
    return hear(master(0) - slave(0), master(1) - slave(1));
  }

 private:
  template <class Particles, class = typename Particles::Set>
  void make(const typename Filter::Params& params, Particles*) {
    storage.resize(Filter::Set::storage_size(16));
    filter.reset(new Filter(good_odometry(), Master<float>(), params, storage.data(), 16));
  }
  void make(const Ekf::Params& params, Ekf*) {
    filter.reset(new Filter(good_odometry(), typename Filter::Master(), params));
  }
  void make(const ImmEkf::Params& params, ImmEkf*) {
    filter.reset(new Filter(good_odometry(), typename Filter::Master(), params));
  }
};

// ---- Refused, and nothing has changed ----------------------------------------------------------

template <class Filter>
void check_long_steps() {
  Started<Filter> one;
  const auto before = one.filter->slave();
  const Random numbers = one.random;
  CHECK(one.predict(3600.5f) == Status::kStepTooLong);
  CHECK(one.predict(std::numeric_limits<float>::infinity()) == Status::kNotFinite);
  CHECK(one.filter->slave().x == before.x);
  CHECK(one.filter->slave().P == before.P);
  CHECK(next_of(numbers) == next_of(one.random));
  CHECK(one.predict(3600) == Status::kOk);
  typename Filter::Params any;
  any.longest_step_s = std::numeric_limits<float>::infinity();
  Started<Filter> patient(0, 300, any);
  CHECK(patient.predict(20000) == Status::kOk);
}

TEST_CASE("SLAT: a prediction longer than longest_step_s is refused by its own name") {
  check_long_steps<Ekf>();
  check_long_steps<ImmEkf>();
  check_long_steps<First>();
  check_long_steps<Second>();
  check_long_steps<Joint>();
  check_long_steps<Shared>();
  auvest::DeadReckoning<Motion> reckoning((Motion()));
  Random random(1);
  REQUIRE(reckoning.reset({Vector<float, 2>::Zero(), Matrix<float, 2, 2>::Zero()}, random) ==
          Status::kOk);
  CHECK(reckoning.predict(3601, Vector<float, 2>(1, 0), random) == Status::kStepTooLong);
}

/// Whatever is predicted, the filter says that it cannot or has finite numbers.
template <class Filter>
void check_large_numbers() {
  typename Filter::Params any;
  any.longest_step_s = std::numeric_limits<float>::infinity();
  for (const float dt : {1.0f, 3600.0f, 1e6f, 1e9f, 1e15f, 1e30f}) {
    for (const float speed : {1.0f, 1e6f, 1e15f, 3e38f}) {
      Started<Filter> one(0, 300, any);
      one.u(0) = speed;
      Status status = Status::kOk;
      for (int k = 0; k < 20 && status == Status::kOk; ++k) {
        const auto before = one.filter->slave();
        status = one.predict(dt);
        const auto slave = one.filter->slave();
        const auto master = one.filter->master(0);
        CAPTURE(dt);
        CAPTURE(speed);
        REQUIRE(slave.x.allFinite());
        REQUIRE(slave.P.allFinite());
        REQUIRE(master.x.allFinite());
        REQUIRE(master.P.allFinite());
        if (status != Status::kOk) REQUIRE(slave.x == before.x);
      }
      CHECK((status == Status::kOk || status == Status::kOverflow ||
             status == Status::kFarFromOrigin));
      if (dt >= 1e15f || speed > 1e20f) CHECK(status == Status::kOverflow);
    }
  }
}

TEST_CASE("SLAT: a prediction whose result would not be finite is refused") {
  check_large_numbers<Ekf>();
  check_large_numbers<ImmEkf>();
  check_large_numbers<First>();
  check_large_numbers<Second>();
  check_large_numbers<Joint>();
  check_large_numbers<Shared>();
}

TEST_CASE("dead reckoning: a yaw rate beyond all numbers is refused") {
  auvest::DeadReckoning<auvest::UnicycleMotion<float>> reckoning((auvest::UnicycleMotion<float>()));
  Random random(1);
  REQUIRE(reckoning.reset({Vector<float, 3>::Zero(), Matrix<float, 3, 3>::Zero()}, random) ==
          Status::kOk);
  CHECK(reckoning.predict(1.83f, Vector<float, 2>(-0.42f, 3e38f), random) == Status::kOverflow);
  CHECK(reckoning.slave().x == Vector<float, 3>::Zero());
  CHECK(reckoning.predict(1.83f, Vector<float, 2>(-0.42f, 0.3f), random) == Status::kOk);
}

TEST_CASE("Outage: a first prediction that is refused leaves communication up") {
  Ekf filter(good_odometry(), Master<float>());
  auvest::Outage<Ekf, 1> outage(filter);
  Belief<float, 2> pose;
  pose.x.setZero();
  pose.P.setIdentity();
  const auto master = master_belief<float>(0, 300, 0, 0, 1);
  REQUIRE(outage.share(pose, &master, 1) == Status::kOk);
  Random random(5);
  const Random before = random;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  CHECK(outage.predict(7200, {1.0f, 0.0f}, random) == Status::kStepTooLong);
  CHECK(outage.predict(nan, {1.0f, 0.0f}, random) == Status::kNotFinite);
  CHECK(outage.predict(-1, {1.0f, 0.0f}, random) == Status::kTimeBackwards);
  CHECK(outage.predict(1, {nan, 0.0f}, random) == Status::kNotFinite);
  CHECK(outage.predict(1, {3e38f, 0.0f}, random) == Status::kOverflow);
  CHECK(outage.mode() == auvest::Communication::kUp);
  CHECK(next_of(random) == next_of(before));
  CHECK(outage.predict(1, {1.0f, 0.0f}, random) == Status::kOk);
  CHECK(outage.mode() == auvest::Communication::kDown);
  // A correlation of 2 is no covariance.
  pose.P(1, 0) = pose.P(0, 1) = 2;
  CHECK(outage.share(pose, &master, 1) == Status::kNotPositiveDefinite);
  CHECK(outage.mode() == auvest::Communication::kDown);
}

/// Ranges that no sonar measures are refused by name, and nothing has changed.
template <class Filter>
void check_impossible_ranges() {
  auvest::Sonar<float>::Params limits;
  const auto status = [&](float range) {
    Started<Filter> one;
    const auto before = one.filter->slave();
    const Random numbers = one.random;
    const Echo<float> echo = {Vector<float, 2>(range, -1.5f), 0};
    const Status said = one.filter->update(&echo, 1, auvest::Sonar<float>(limits), one.random);
    if (said == Status::kOk) return said;
    CHECK(one.filter->slave().x == before.x);
    CHECK(one.filter->slave().P == before.P);
    CHECK(one.filter->safeguards().report().refused == 0);
    CHECK(next_of(numbers) == next_of(one.random));
    return said;
  };
  CHECK(status(-1) == Status::kImpossibleRange);
  CHECK(status(0) == Status::kOk);
  CHECK(status(9999) == Status::kOk);
  limits.smallest_range_m = 2;
  limits.largest_range_m = 500;
  CHECK(status(1.9f) == Status::kImpossibleRange);
  CHECK(status(300) == Status::kOk);
  CHECK(status(9999) == Status::kImpossibleRange);
  limits.smallest_range_m = -3;  // noise that is not cut off at 0
  CHECK(status(-2) == Status::kOk);
  limits.largest_range_m = -4;
  CHECK(status(300) == Status::kBadParameter);
}

TEST_CASE("SLAT: ranges that the sonar cannot measure are refused") {
  check_impossible_ranges<Ekf>();
  check_impossible_ranges<ImmEkf>();
  check_impossible_ranges<First>();
  check_impossible_ranges<Second>();
  check_impossible_ranges<Joint>();
  check_impossible_ranges<Shared>();
}

// Coordinates of a map: floats are 0.25 m apart there, and a slave would stand still.
const float kNorthing = 3948996.0f;

Belief<float, 2> pose_at(float x, float sigma) {
  Belief<float, 2> pose;
  pose.x << x, 0;
  pose.P << sigma * sigma, 0, 0, sigma * sigma;
  return pose;
}

template <class Filter>
void check_far_places() {
  Started<Filter> one;
  Filter& filter = *one.filter;
  CHECK(filter.reset(pose_at(kNorthing, 0.1f), one.random) == Status::kFarFromOrigin);
  CHECK(filter.masters() == 1);
  CHECK(filter.reset(pose_at(kNorthing, 10), one.random) == Status::kOk);
  CHECK(filter.reset(pose_at(1e6f, 1e19f), one.random) == Status::kOverflow);
  for (const float variance : {1e-45f, 1e-39f}) {  // without an inverse: Slatf drew NaN from it
    Belief<float, 2> tiny = pose_at(1, 0);
    tiny.P(0, 0) = tiny.P(1, 1) = variance;
    CHECK(filter.reset(tiny, one.random) == Status::kOverflow);
  }
  CHECK(filter.reset(pose_at(4000, 0), one.random) == Status::kOk);
  auto master = master_belief<float>(double(kNorthing), 0, 0, 0, 0.1);
  CHECK(filter.add_master(master) == Status::kFarFromOrigin);
  CHECK(filter.masters() == 0);
  master.x(0) = 4000;
  for (const int i : {2, 5}) {  // beyond any speed or acceleration; an Imm squares their products
    for (const float beyond : {1.01f, 1e19f}) {
      auto large = master;
      large.x(i) = -1e6f * beyond;
      CHECK(filter.add_master(large) == Status::kOverflow);
      large = master;
      large.P(i, i) = 1e12f * beyond;
      CHECK(filter.add_master(large) == Status::kOverflow);
    }
  }
  CHECK(filter.masters() == 0);
  CHECK(filter.add_master(master) == Status::kOk);
}

/// A slave that drifts far off, as sure of its way as a float is not, says so before it stands
/// still.
template <class Filter>
void check_drift(Filter& filter, Random& random) {
  REQUIRE(filter.reset(pose_at(0, 1e-3f), random) == Status::kOk);
  Status status = Status::kOk;
  float gone = 0;
  while (status == Status::kOk && gone < 1e5f) {
    gone = filter.slave().x(0);
    status = filter.predict(100, {5.0f, 0.0f}, random);
  }
  CHECK(status == Status::kFarFromOrigin);
  CHECK(gone > 4096);
  CHECK(filter.slave().x(0) == gone);
}

TEST_CASE("SLAT: starts and masters that are too far or too large are refused") {
  check_far_places<Ekf>();
  check_far_places<ImmEkf>();
  check_far_places<First>();
  check_far_places<Second>();
  check_far_places<Joint>();
  check_far_places<Shared>();
  auvest::DeadReckoning<Motion> reckoning((Motion()));
  Random random(1);
  CHECK(reckoning.reset(pose_at(kNorthing, 0.1f), random) == Status::kFarFromOrigin);
  auvest::Outage<Ekf, 1> outage(Ekf(good_odometry(), Master<float>()));
  auto master = master_belief<float>(0, double(kNorthing), 0, 0, 0.1);
  CHECK(outage.share(pose_at(kNorthing, 0.1f), &master, 0) == Status::kFarFromOrigin);
  CHECK(outage.share(pose_at(0, 0.1f), &master, 1) == Status::kFarFromOrigin);
  CHECK(outage.mode() == auvest::Communication::kNever);
}

TEST_CASE("SLAT: a slave that drifts so far that it would stand still is not predicted") {
  Motion::Params sure;
  sure.sigma_speed_m_s = 1e-7f;
  sure.sigma_heading_rad = 0;
  const Motion motion(sure);
  Random random(1);
  auvest::DeadReckoning<Motion> reckoning(motion);
  check_drift(reckoning, random);
  Ekf ekf(motion, Master<float>());
  check_drift(ekf, random);
  ImmEkf imm(motion, Three());
  check_drift(imm, random);
  std::vector<float> storage(Joint::Set::storage_size(16) + Second::Set::storage_size(16));
  First first(motion, Master<float>(), First::Params(), storage.data(), 16);
  check_drift(first, random);
  Second second(motion, Master<float>(), Second::Params(), storage.data(), 16);
  check_drift(second, random);
  Joint joint(motion, Master<float>(), Joint::Params(), storage.data(), 16);
  check_drift(joint, random);
  Shared shared(motion, Master<float>(), Shared::Params(), storage.data(), 16);
  check_drift(shared, random);
}

// ---- Hours of silence --------------------------------------------------------------------------

/// The smallest eigenvalue of the correlations; -2 where there are none.
template <int N>
double least_correlation(Matrix<float, N, N> lower) {
  auvest::math::mirror_lower(lower);
  Eigen::Matrix<double, N, N> p = lower.template cast<double>();
  if (!p.allFinite() || (p.diagonal().array() <= 0).any()) return -2;
  const Eigen::Matrix<double, N, 1> scale = p.diagonal().cwiseSqrt().cwiseInverse();
  p = scale.asDiagonal() * p * scale.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>>(p).eigenvalues()(0);
}

double least(const Ekf& filter) { return least_correlation(filter.belief().P); }
double least(const Joint& filter) { return least_correlation(filter.particle(0).P); }
double least(const Shared& filter) { return least_correlation(filter.covariance()); }
double least(const Second& filter) { return least_correlation(filter.master(0).P); }

template <class Filter>
void check_gaps() {
  for (const int hours : {1, 4}) {
    double worst = 1;
    for (int start = 0; start < 12; ++start) {
      Started<Filter> one(40.0f * static_cast<float>(start) - 200, 300);
      for (int k = 0; k < hours + 8; ++k) {
        const bool silent = k >= 3 && k < 3 + hours;
        REQUIRE(one.predict(silent ? 3600 : 1) == Status::kOk);
        if (!silent) REQUIRE(one.hear_expected() == Status::kOk);
        worst = std::fmin(worst, least(*one.filter));
      }
    }
    CAPTURE(hours);
    // What rounding alone may do to the eigenvalues of a symmetric matrix of eight with a diagonal
    // of ones, for the dozen operations behind each element.
    CHECK(worst > -8 * 12 * double(auvest::math::machine_epsilon<float>()));
  }
}

TEST_CASE("SLAT: covariances stay positive definite when an echo ends hours of silence") {
  check_gaps<Ekf>();
  check_gaps<Joint>();
  check_gaps<Shared>();
  check_gaps<Second>();
}

template <class Filter>
void check_silences(std::uint64_t runs, Filter&& filter) {
  double worst = 1;
  for (std::uint64_t run = 0; run < runs; ++run) {
    Random random(run);
    const auto even = [&random] { return random.uniform<double>() < 0.5; };
    typename Filter::SlaveBelief pose;
    pose.x.setZero();
    pose.P.setIdentity();
    pose.P *= 0.01f;
    REQUIRE(filter.reset(pose, random) == Status::kOk);
    for (int n = 0; n < 2; ++n) {
      auto prior = master_belief<float>(300 * random.normal<double>(), 300.0 * n, 0, 0, 1);
      for (int i = 2; i < 6; ++i) prior.P(i, i) = i < 4 ? 0.1f : 0.01f;
      REQUIRE(filter.add_master(prior) == Status::kOk);
    }
    for (int k = 0; k < 40; ++k) {
      const Vector<float, 2> u{random.normal<float>(), random.normal<float>()};
      REQUIRE(filter.predict(even() ? 1.0f : 3600.0f, u, random) == Status::kOk);
      Echo<float> echo;
      echo.master = even();
      const auto master = filter.master(echo.master).x;
      const auto slave = filter.slave().x;
      const float x = master(0) - slave(0);
      const float y = master(1) - slave(1);
      echo.z << std::hypot(x, y), std::atan2(-y, -x);
      REQUIRE(filter.update(&echo, 1, good_sonar(), random) == Status::kOk);
      for (int n = 0; n < 2; ++n) worst = std::fmin(worst, least_correlation(filter.master(n).P));
    }
  }
  CHECK(worst > -6 * 12 * double(auvest::math::machine_epsilon<float>()));  // as above, of six
}

TEST_CASE("SLAT: silences of an hour, again and again, leave covariances and take every echo") {
  using Unicycle = auvest::UnicycleMotion<float>;
  using LongJoint = auvest::SlatfJoint<Unicycle, Master<float>, 2>;
  using LongSecond = auvest::Slatf2<Unicycle, Master<float>, 2>;
  std::vector<float> storage(8 * LongJoint::Set::storage_size(1));
  float* const room = storage.data();
  const Unicycle motion;
  const Master<float> master;
  check_silences(10, auvest::EkfSlat<Unicycle, Master<float>, 2>(motion, master));
  check_silences(10, auvest::EkfSlat<Unicycle, Three, 2>(motion, Three()));
  check_silences(8, LongJoint(motion, master, LongJoint::Params(), room, 8));
  check_silences(8, LongSecond(motion, master, LongSecond::Params(), room, 8));
}

// ---- A master that is lost ---------------------------------------------------------------------

/// The echoes of a master that stands 200 m from where the filter believes it to be.
template <class Filter>
void check_recovery() {
  Started<Filter> one;
  for (int k = 0; k < 5; ++k) {
    REQUIRE(one.predict(1) == Status::kOk);
    REQUIRE(one.hear(0, 500) == Status::kOk);
    CHECK(one.filter->safeguards().report().refused == k + 1);
    CHECK(one.filter->safeguards().report().rebirths == 0);
  }
  CHECK(one.filter->safeguards().report().since_rebirth_s == -1);
  CHECK(std::abs(one.filter->master(0).x(1) - 300) < 20);
  const auto before = one.filter->slave();
  REQUIRE(one.hear(0, 500) == Status::kOk);
  CHECK(one.filter->safeguards().report().rebirths == 1);
  const auto master = one.filter->master(0);
  const auto slave = one.filter->slave();
  CHECK(std::abs(master.x(0) - slave.x(0)) < 1);
  CHECK(std::abs(master.x(1) - slave.x(1) - 500) < 1);
  // The echo tells the slave nothing.
  CHECK((slave.x - before.x).norm() < 1e-3f);
  REQUIRE(one.predict(2.5f) == Status::kOk);
  CHECK(one.filter->safeguards().report().since_rebirth_s == 2.5f);
  REQUIRE(one.hear(0, 500) == Status::kOk);
  CHECK(one.filter->safeguards().report().refused == 6);  // heard again
}

TEST_CASE("SLAT: a master of whose last 8 echoes 6 were refused is born again") {
  check_recovery<Ekf>();
  check_recovery<ImmEkf>();
  check_recovery<First>();
  check_recovery<Second>();
  check_recovery<Joint>();
  check_recovery<Shared>();
}

template <class Filter>
int rebirths_after(const std::vector<float>& ranges) {
  Started<Filter> one;
  for (const float range : ranges) {
    REQUIRE(one.predict(1) == Status::kOk);
    REQUIRE((range > 0 ? one.hear(0, range) : one.hear_expected()) == Status::kOk);
  }
  return one.filter->safeguards().report().rebirths;
}

TEST_CASE("SLAT: bursts, and wrong echoes that do not agree, are no master") {
  const float good = 0;
  for (const auto count : {rebirths_after<Ekf>, rebirths_after<Shared>, rebirths_after<Second>}) {
    CHECK(count({600, 600, 600, 600, 600, good, good, good, 600, 600, 600, 600, 600}) == 0);
    CHECK(count({600, 600, 600, good, good, 600, 600, 600}) == 1);  // 6 of 8
    CHECK(count({600, 600, good, good, good, 600, 600, 600, 600}) == 0);
    CHECK(count({600, 600, 600, 900, 900, 900, 600, 600, 600}) == 0);  // 300 m in a second
    CHECK(count({600, 608, 616, 624, 632, 640}) == 1);                 // 8 m in a second
  }
}

template <class Filter>
void check_switched_off() {
  typename Filter::Params off;
  off.recover_after = 0;
  Started<Filter> one(0, 300, off);
  for (int k = 0; k < 20; ++k) REQUIRE(one.hear(0, 500) == Status::kOk);
  CHECK(one.filter->safeguards().report().refused == 20);
  CHECK(one.filter->safeguards().report().rebirths == 0);
  typename Filter::Params open;
  open.gate = 0;
  Started<Filter> paper(0, 300, open);
  REQUIRE(paper.hear(0, 320) == Status::kOk);  // 20 of its sigmas: no echo is refused
  CHECK(paper.filter->safeguards().report().refused == 0);
  CHECK(paper.filter->master(0).x(1) > 310);
}

TEST_CASE("SLAT: recovery and gate can be switched off") {
  check_switched_off<Ekf>();
  check_switched_off<Joint>();
  check_switched_off<Shared>();
  check_switched_off<Second>();
}

template <class Filter>
void check_silence() {
  typename Filter::Params params;
  params.forget_after_s = 5;
  Started<Filter> one(0, 300, params);
  REQUIRE(one.predict(5) == Status::kOk);
  REQUIRE(one.hear_expected() == Status::kOk);
  CHECK(one.filter->safeguards().report().rebirths == 0);
  for (int k = 0; k < 6; ++k) REQUIRE(one.predict(1) == Status::kOk);
  REQUIRE(one.hear(30, 290) == Status::kOk);  // which the gate would refuse
  CHECK(one.filter->safeguards().report().rebirths == 1);
  CHECK(one.filter->safeguards().report().refused == 0);
  const auto master = one.filter->master(0);
  CHECK(std::abs(master.x(0) - one.filter->slave().x(0) - 30) < 0.5f);
  CHECK(double(master.P(2, 2)) == close_to(9, 1e-5));
}

TEST_CASE("SLAT: an echo after a longer silence is the master's rebirth") {
  check_silence<Ekf>();
  check_silence<ImmEkf>();
  check_silence<First>();
  check_silence<Second>();
  check_silence<Joint>();
  check_silence<Shared>();
}

/// A master that is born from an echo stands relative to the slave: where that is wrong, so is the
/// master by as much, and further echoes of a master that stands still say nothing of the slave.
TEST_CASE("EKF-SLAT: a rebirth knows of the slave's covariance") {
  using Unicycle = auvest::UnicycleMotion<double>;
  using Model = auvest::JointGaussian<Unicycle, Master<double>, 2>;
  Model::Joint joint;
  Random random(9);
  Eigen::Matrix<double, 15, 15> root;
  for (int i = 0; i < 15; ++i) {
    joint.x(i) = random.normal<double>();
    for (int j = 0; j < 15; ++j) root(i, j) = 0.1 * random.normal<double>();
  }
  joint.P = root * root.transpose();
  auvest::Sonar<double>::Params params;
  params.bearing = auvest::Bearing::kFromHeading;
  const auvest::Sonar<double> sonar(params);
  auvest::EchoParams<double> rules;
  const Vector<double, 2> z(80, 0.7);
  Model::Joint after = joint;
  Model::give_rebirth(z, 0, sonar, rules, after);
  auvest::math::mirror_lower(after.P);

  // The map from (old state, range, bearing) to the new state, by differences.
  const auto born = [&](const Vector<double, 15>& x, double range, double bearing) {
    Vector<double, 15> y = x;
    y(3) = x(0) + range * std::cos(x(2) + bearing);
    y(4) = x(1) + range * std::sin(x(2) + bearing);
    for (int i = 5; i < 9; ++i) y(i) = 0;
    return y;
  };
  Eigen::Matrix<double, 15, 17> jacobian;
  for (int j = 0; j < 17; ++j) {
    Vector<double, 15> d = Vector<double, 15>::Zero();
    if (j < 15) d(j) = 1e-6;
    const double r = j == 15 ? 1e-6 : 0, b = j == 16 ? 1e-6 : 0;
    jacobian.col(j) =
        (born(joint.x + d, z(0) + r, z(1) + b) - born(joint.x - d, z(0) - r, z(1) - b)) / 2e-6;
  }
  Eigen::Matrix<double, 17, 17> before = Eigen::Matrix<double, 17, 17>::Zero();
  before.topLeftCorner<15, 15>() = joint.P;
  before(15, 15) = params.sigma_range_m * params.sigma_range_m;
  before(16, 16) = params.sigma_bearing_rad * params.sigma_bearing_rad;
  Eigen::Matrix<double, 15, 15> expected = jacobian * before * jacobian.transpose();
  for (int i = 5; i < 9; ++i) {
    expected(i, i) =
        i < 7 ? rules.rebirth_velocity_variance() : rules.rebirth_acceleration_variance();
  }
  CHECK((after.P - expected).cwiseAbs().maxCoeff() < 1e-6);
  CHECK((after.x - born(joint.x, z(0), z(1))).cwiseAbs().maxCoeff() < 1e-12);
}

TEST_CASE("EKF-SLAT: a slave that is considered is never corrected, and the masters know it") {
  Ekf::Params params;
  params.consider = true;
  Started<Ekf> considered(0, 300, params);
  Started<Ekf> corrected;
  auvest::DeadReckoning<Motion> reckoning(good_odometry());
  REQUIRE(reckoning.reset({Vector<float, 2>::Zero(), Matrix<float, 2, 2>::Zero()},
                          considered.random) == Status::kOk);
  for (int k = 0; k < 30; ++k) {
    for (Started<Ekf>* one : {&considered, &corrected}) {
      REQUIRE(one->predict(1) == Status::kOk);
      REQUIRE(one->hear(0.1f * static_cast<float>(k % 3), 300) == Status::kOk);
    }
    REQUIRE(reckoning.predict(1, considered.u, considered.random) == Status::kOk);
    CHECK(considered.filter->slave().x == reckoning.slave().x);
    CHECK(considered.filter->slave().P == reckoning.slave().P);
    CHECK(least(*considered.filter) > 0);
  }
  CHECK(corrected.filter->slave().P(0, 0) < reckoning.slave().P(0, 0));
  CHECK(considered.filter->master(0).P(0, 0) >= corrected.filter->master(0).P(0, 0));
}

}  // namespace
