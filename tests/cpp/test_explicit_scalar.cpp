// The filters compile with a scalar that converts to nothing, and compute the bits of double.
#include "explicit_scalar.hpp"  // before the filters, which find its functions by overload

#include <doctest/doctest.h>

#include <initializer_list>
#include <vector>

#include "auvest/auvest.hpp"

namespace {

template <class Scalar>
struct Tracker {
  using Process = auvest::ExactAcceleration<Scalar>;
  using Sonar = auvest::RangeBearing<Scalar, 6>;

  template <class Filter>
  static auvest::Vector<Scalar, 6> run(Filter filter) {
    auvest::Vector<Scalar, 6> x;
    auvest::Matrix<Scalar, 6, 6> P;
    const double start[6] = {3, -4, 0.2, 0.1, 0, 0.01};
    for (int i = 0; i < 6; ++i) {
      x(i) = Scalar(start[i]);
      for (int j = 0; j < 6; ++j) P(i, j) = Scalar(i == j ? 0.5 : 0.0);
    }
    REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
    const Sonar sonar;
    for (int k = 0; k < 20; ++k) {
      REQUIRE(filter.predict(filter.interval()) == auvest::Status::kOk);
      auvest::Vector<Scalar, 2> z;
      z(0) = Scalar(6.6 + 0.05 * k);
      z(1) = Scalar(-1.1 + 0.01 * k);
      REQUIRE(filter.update(z, sonar).status == auvest::Status::kOk);
      auvest::Vector<Scalar, 2> reference;
      reference(0) = Scalar(3 + 0.1 * k);
      reference(1) = Scalar(-4 + 0.05 * k);
      REQUIRE(filter.feedback(reference) == auvest::Status::kOk);
    }
    return filter.x();
  }

  static auvest::Vector<Scalar, 6> aukf() {
    return run(auvest::Aukf<Process>(auvest::Ukf<Process>(Process())));
  }

  static auvest::Vector<Scalar, 6> budgeted_ekf() {
    using Policy = auvest::CovarianceBudget<Scalar>;
    return run(
        auvest::AdaptiveInterval<auvest::Ekf<Process>, Policy>(auvest::Ekf<Process>(Process())));
  }
};

/// The generic paths: deviations by subtraction, a nonlinear process, linear models, restore.
template <class Scalar>
struct Drift : auvest::ProcessModel<Drift<Scalar>, Scalar, 2> {
  using State = auvest::Vector<Scalar, 2>;
  using Covariance = auvest::Matrix<Scalar, 2, 2>;
  State f(const State& x, Scalar dt) const {
    State next;
    next(0) = x(0) + dt * x(1) * x(1);
    next(1) = x(1);
    return next;
  }
  Covariance Q(Scalar dt) const {
    Covariance q;
    q(0, 0) = q(1, 1) = dt;
    q(1, 0) = q(0, 1) = Scalar(0);
    return q;
  }
};

template <class Scalar>
auvest::Vector<Scalar, 2> run_generic() {
  auvest::Vector<Scalar, 2> x;
  auvest::Matrix<Scalar, 2, 2> p;
  auvest::Matrix<Scalar, 1, 2> h;
  auvest::Matrix<Scalar, 1, 1> r;
  x(0) = Scalar(1);
  x(1) = Scalar(2);
  p(0, 0) = p(1, 1) = Scalar(1);
  p(1, 0) = p(0, 1) = Scalar(0.5);
  h(0, 0) = h(0, 1) = Scalar(1);
  r(0, 0) = Scalar(0.25);
  const auvest::LinearMeasurement<Scalar, 2, 1> sensor(h, r);
  auvest::Vector<Scalar, 1> z;
  z(0) = Scalar(4);
  auvest::Ukf<Drift<Scalar>> filter{Drift<Scalar>()};
  REQUIRE(filter.reset(x, p) == auvest::Status::kOk);
  REQUIRE(filter.predict(Scalar(0.5)) == auvest::Status::kOk);
  REQUIRE(filter.update(z, sensor).status == auvest::Status::kOk);
  REQUIRE(filter.restore(filter.belief()) == auvest::Status::kOk);

  using Linear = auvest::LinearProcess<Scalar, 2>;
  using Policy = auvest::FixedInterval<Scalar>;
  auvest::AdaptiveInterval<auvest::Ekf<Linear>, Policy> ekf{auvest::Ekf<Linear>(Linear(p, p))};
  REQUIRE(ekf.reset(filter.x(), filter.P()) == auvest::Status::kOk);
  REQUIRE(ekf.predict(ekf.interval()) == auvest::Status::kOk);
  REQUIRE(ekf.update(z, sensor).status == auvest::Status::kOk);
  REQUIRE(ekf.feedback(ekf.x()) == auvest::Status::kOk);
  return ekf.x();
}

TEST_CASE("explicit scalar: the generic paths too") {
  const auto a = run_generic<ExplicitDouble>();
  const auto b = run_generic<double>();
  for (int i = 0; i < 2; ++i) CHECK(double(a(i)) == b(i));
}

/// The robust filters on what they are made for, with outliers, a lock-out and its recovery.
template <class Scalar, template <class> class Filter, class Kernel>
auvest::Vector<Scalar, 4> run_robust(auvest::Residual residual) {
  using Process = auvest::SpeedHeading<Scalar, true, true>;
  using Rule = auvest::RobustUpdate<Kernel, auvest::RejectionStreak<Scalar>>;
  using Range = auvest::LeaderRange<Scalar, 4>;
  Rule rule;
  rule.params.residual = residual;
  auvest::Robust<Filter<Process>, Rule> filter(Filter<Process>(Process()), rule);
  auvest::Vector<Scalar, 4> x;
  auvest::Matrix<Scalar, 4, 4> p;
  for (int i = 0; i < 4; ++i) {
    x(i) = Scalar(0);
    for (int j = 0; j < 4; ++j) p(i, j) = Scalar(i == j ? (i < 2 ? 1.0 : 1e-4) : 0.0);
  }
  REQUIRE(filter.reset(x, p) == auvest::Status::kOk);
  int recoveries = 0;
  for (int k = 0; k < 60; ++k) {
    auvest::Vector<Scalar, 3> input;
    input(0) = Scalar(1.5);
    input(1) = Scalar(0.1);
    input(2) = Scalar(0.02 * k);
    REQUIRE(filter.predict(Scalar(5), input) == auvest::Status::kOk);
    typename Range::Params params;
    params.leader_x_m = Scalar(k % 2 == 0 ? 300 : -100);
    params.leader_y_m = Scalar(k % 2 == 0 ? 0 : 250);
    params.sigma_leader_m = Scalar(0.5);
    auvest::Vector<Scalar, 1> z;
    z(0) = Scalar(k % 2 == 0 ? 300 : 270);
    if (k > 20) z(0) = z(0) + Scalar(80);
    const auto correction = filter.update(z, Range(params));
    REQUIRE(correction.status == auvest::Status::kOk);
    recoveries += correction.recovered ? 1 : 0;
  }
  CHECK((recoveries > 0) == (Kernel().weight(Scalar(1e9)) < Scalar(1e-10)));  // Huber never rejects
  return filter.x();
}

template <template <class> class Filter, template <class> class Kernel>
void check_robust(auvest::Residual residual) {
  const auto a = run_robust<ExplicitDouble, Filter, Kernel<ExplicitDouble>>(residual);
  const auto b = run_robust<double, Filter, Kernel<double>>(residual);
  for (int i = 0; i < 4; ++i) CHECK(double(a(i)) == b(i));
}

TEST_CASE("explicit scalar: the robust filters too") {
  for (const auto residual : {auvest::Residual::kInnovation, auvest::Residual::kPostFit}) {
    check_robust<auvest::Ekf, auvest::Igg>(residual);
    check_robust<auvest::Ekf, auvest::Huber>(residual);
    check_robust<auvest::Ukf, auvest::Hampel>(residual);
  }
}

TEST_CASE("explicit scalar: same bits as double") {
  const auto a = Tracker<ExplicitDouble>::aukf();
  const auto b = Tracker<double>::aukf();
  const auto c = Tracker<ExplicitDouble>::budgeted_ekf();
  const auto d = Tracker<double>::budgeted_ekf();
  for (int i = 0; i < 6; ++i) {
    CHECK(double(a(i)) == b(i));
    CHECK(double(c(i)) == d(i));
  }
}

/// A vehicle in space: its motion and its sensors.
template <class Scalar, template <class> class Filter>
auvest::Vector<Scalar, 6> run_in_space() {
  using Process = auvest::WhiteAcceleration<Scalar, 3>;
  Filter<Process> filter{Process()};
  auvest::Vector<Scalar, 6> x;
  auvest::Matrix<Scalar, 6, 6> p;
  const double start[6] = {30, -40, 20, 0.5, 0.2, 0.1};
  for (int i = 0; i < 6; ++i) {
    x(i) = Scalar(start[i]);
    for (int j = 0; j < 6; ++j) p(i, j) = Scalar(i == j ? 0.5 : 0.0);
  }
  REQUIRE(filter.reset(x, p) == auvest::Status::kOk);
  typename auvest::BodyVelocity<Scalar, 6, 3>::Params at;
  at.heading_rad = Scalar(0.3);
  for (int k = 0; k < 20; ++k) {
    REQUIRE(filter.predict(Scalar(1)) == auvest::Status::kOk);
    auvest::Vector<Scalar, 3> fix;
    fix(0) = Scalar(30 + 0.6 * k);
    fix(1) = Scalar(-40.5 + 0.1 * k);
    fix(2) = Scalar(19);
    auvest::Vector<Scalar, 1> depth;
    depth(0) = Scalar(20 + 0.1 * k);
    auvest::Vector<Scalar, 3> velocity;
    velocity(0) = Scalar(0.6);
    velocity(1) = Scalar(0.02 * k);
    velocity(2) = Scalar(-0.1);
    const auvest::BodyVelocity<Scalar, 6, 3> log(at);
    REQUIRE(log.check() == auvest::Status::kOk);
    REQUIRE(auvest::Position<Scalar, 6, 3>().check() == auvest::Status::kOk);
    REQUIRE(filter.update(fix, auvest::Position<Scalar, 6, 3>()).status == auvest::Status::kOk);
    REQUIRE(filter.update(depth, auvest::Depth<Scalar, 6>()).status == auvest::Status::kOk);
    REQUIRE(filter.update(velocity, log).status == auvest::Status::kOk);
    auvest::RangeBearingElevation<Scalar, 6> usbl;
    usbl.params.near_field = Scalar(k % 2 == 0 ? 5 : 1000);  // far and near
    REQUIRE(usbl.check() == auvest::Status::kOk);
    auvest::Vector<Scalar, 3> angles;
    angles(0) = Scalar(54);
    angles(1) = Scalar(-0.9 + 0.005 * k);
    angles(2) = Scalar(0.38);
    const auto seen = filter.update(angles, usbl);
    REQUIRE(seen.status == auvest::Status::kOk);
    CHECK(seen.near_field == (k % 2 != 0));
  }
  return filter.x();
}

TEST_CASE("explicit scalar: a vehicle in space too") {
  const auto a = run_in_space<ExplicitDouble, auvest::Ukf>();
  const auto b = run_in_space<double, auvest::Ukf>();
  const auto c = run_in_space<ExplicitDouble, auvest::Ekf>();
  const auto d = run_in_space<double, auvest::Ekf>();
  for (int i = 0; i < 6; ++i) {
    CHECK(double(a(i)) == b(i));
    CHECK(double(c(i)) == d(i));
  }
}

/// SLATF, SlatfJoint, EKF-SLAT and dead reckoning over a few steps; the slave's estimates one after
/// the other.
template <class Scalar>
struct Slat {
  template <class Filter>
  static void run(Filter& filter, std::vector<double>& numbers) {
    constexpr int pose = Filter::kPose;
    auvest::math::Random random(1);
    typename Filter::SlaveBelief start;
    typename Filter::MasterBelief master;
    auvest::math::set_zero(start.x);
    auvest::math::set_zero(start.P);
    auvest::math::set_zero(master.x);
    auvest::math::set_zero(master.P);
    for (int i = 0; i < pose; ++i) start.P(i, i) = Scalar(0.01);
    for (int i = 0; i < 6; ++i) master.P(i, i) = Scalar(0.5);
    master.x(1) = Scalar(50);
    REQUIRE(filter.reset(start, random) == auvest::Status::kOk);
    REQUIRE(filter.add_master(master) == auvest::Status::kOk);
    typename Filter::VelocityChange change;
    change(0) = change(1) = Scalar(0.01);
    for (int k = 0; k < 10; ++k) {
      typename Filter::Control u;
      u(0) = Scalar(2);
      u(1) = Scalar(0.1);
      REQUIRE(filter.predict(Scalar(1), u, random, &change) == auvest::Status::kOk);
      auvest::Echo<Scalar> seen;
      seen.master = 0;
      seen.z(0) = Scalar(50 - k);
      seen.z(1) = Scalar(-1.5);
      REQUIRE(filter.update(&seen, 1, auvest::Sonar<Scalar>(), random) == auvest::Status::kOk);
      const auto slave = filter.slave();
      for (int i = 0; i < pose; ++i) {
        numbers.push_back(double(slave.x(i)));
        numbers.push_back(double(slave.P(i, i)));
      }
    }
  }

  template <class Filter>
  static void particles(std::vector<double>& numbers) {
    typename Filter::template Storage<20> storage;
    Filter filter(typename Filter::Motion(), typename Filter::Master(), typename Filter::Params(),
                  storage);
    run(filter, numbers);
    numbers.push_back(double(filter.master(0).P(5, 5)));
    numbers.push_back(double(filter.log_likelihood()));
  }

  static std::vector<double> all() {
    using Compass = auvest::CompassMotion<Scalar>;
    using Unicycle = auvest::UnicycleMotion<Scalar>;
    std::vector<double> numbers;
    using Master = auvest::PiecewiseAcceleration<Scalar>;
    particles<auvest::Slatf1<Compass, Master, 1>>(numbers);
    particles<auvest::Slatf2<Compass, Master, 1>>(numbers);
    particles<auvest::SlatfJoint<Compass, Master, 1>>(numbers);
    particles<auvest::Slatf1<Unicycle, Master, 1>>(numbers);
    particles<auvest::Slatf2<Unicycle, Master, 1>>(numbers);
    particles<auvest::SlatfJoint<Unicycle, Master, 1>>(numbers);
    auvest::EkfSlat<Unicycle, Master, 1> ekf((Unicycle()), Master());
    run(ekf, numbers);
    auvest::DeadReckoning<Compass> reckoning((Compass()));
    run(reckoning, numbers);
    return numbers;
  }
};

TEST_CASE("explicit scalar: the SLAT filters compute the bits of double") {
  CHECK(Slat<ExplicitDouble>::all() == Slat<double>::all());
}

/// Two steps of each kind, and the largest step there.
template <class Hull>
void fly(const Hull& hull, typename Hull::Command command, std::vector<double>& numbers) {
  using Scalar = typename Hull::Scalar;
  typename Hull::Current current;
  current(0) = Scalar(0.3);
  current(1) = Scalar(-0.2);
  current(2) = Scalar(0.1);
  REQUIRE(hull.check() == auvest::Status::kOk);
  typename Hull::State x = hull.at_rest(current);
  const Scalar h(0.05);
  for (int k = 0; k < 2; ++k) {
    REQUIRE(auvest::advance<auvest::Rk4>(hull, x, command, current, h) == auvest::Status::kOk);
    REQUIRE(auvest::advance<auvest::SemiImplicit>(hull, x, command, current, h) ==
            auvest::Status::kOk);
  }
  for (int i = 0; i < Hull::kStates; ++i) numbers.push_back(double(x(i)));
  numbers.push_back(double(auvest::largest_stable_step<auvest::Rk4>(hull, x, command)));
}

template <class Scalar>
std::vector<double> fly_vehicles() {
  std::vector<double> numbers;
  using Keel = auvest::Keel<Scalar>;
  using Torpedo = auvest::Torpedo<Scalar, Keel>;
  typename Torpedo::Params torpedo = auvest::remus100<Scalar, Keel>();
  torpedo.keel.foil.area_m2 = Scalar(0.02);
  auvest::Vector<Scalar, 3> fins;
  fins(0) = fins(1) = Scalar(0.1);
  fins(2) = Scalar(15);
  fly(auvest::Hull<Torpedo>(torpedo), fins, numbers);
  fly(auvest::Hull<Torpedo, auvest::ThreeDof>(torpedo), fins, numbers);

  const auvest::Hull<auvest::Rov<Scalar, 8>> rov(auvest::bluerov2_heavy<Scalar>());
  const auto& thrusters = rov.vehicle().thrusters;
  auvest::Vector<Scalar, 6> demand;
  for (int i = 0; i < 6; ++i) demand(i) = Scalar(i < 3 ? 90 : 1);
  const auto allocated = auvest::allocation_of(thrusters).allocate(demand);
  CHECK(allocated.saturated);
  auvest::Vector<Scalar, 8> inputs;
  for (int i = 0; i < 8; ++i) inputs(i) = thrusters.curve.input(allocated.thrust(i));
  fly(rov, inputs, numbers);
  auvest::Vector<Scalar, 8> thrust;
  numbers.push_back(auvest::redistribute(thrusters.matrix(), demand, thrusters.curve.lowest(),
                                         thrusters.curve.highest(), thrust));
  numbers.push_back(double(auvest::Torpedo<Scalar>(auvest::remus100<Scalar>())
                               .propeller.speed_for(Scalar(5), Scalar(1))));
  const auvest::Spheroid<Scalar> shape = {Scalar(0.8), Scalar(0.1), Scalar(1026)};
  numbers.push_back(double(shape.added_mass().sway_kg));
  return numbers;
}

TEST_CASE("explicit scalar: the vehicles") {
  CHECK(fly_vehicles<ExplicitDouble>() == fly_vehicles<double>());
}

/// The hull as a process, corrected by compass and log.
template <class Scalar>
std::vector<double> run_planar_hull() {
  using Process = auvest::PlanarHull<Scalar>;
  auvest::Ekf<Process> filter{Process()};
  typename Process::State x;
  typename Process::Covariance P;
  for (int i = 0; i < 8; ++i) {
    x(i) = Scalar(i == 3 ? 1.5 : 0);
    for (int j = 0; j < 8; ++j) P(i, j) = Scalar(i == j ? 1 : 0);
  }
  REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
  typename Process::Input input;
  input(0) = Scalar(0.1);
  input(1) = Scalar(15);
  auvest::Vector<Scalar, 3> z;
  z(0) = Scalar(0.05);
  z(1) = Scalar(1.4);
  z(2) = Scalar(0.1);
  std::vector<double> numbers;
  for (int k = 0; k < 5; ++k) {
    REQUIRE(filter.predict(Scalar(0.25), input) == auvest::Status::kOk);
    REQUIRE(filter.update(z, auvest::HeadingSpeed<Scalar, 8>()).status == auvest::Status::kOk);
    for (int i = 0; i < 8; ++i) numbers.push_back(double(filter.x()(i)));
  }
  return numbers;
}

TEST_CASE("explicit scalar: a hull as a process") {
  CHECK(run_planar_hull<ExplicitDouble>() == run_planar_hull<double>());
}

/// Odometry whose speed and ranges are off by a constant each.
template <class Scalar>
std::vector<double> run_constants() {
  using Process = auvest::OdometryConstants<Scalar>;
  typename Process::Params params;
  params.speed_state = Scalar(3);
  params.turn_state = Scalar(4);
  auvest::Ekf<Process> filter{Process(params)};
  typename Process::State x;
  typename Process::Covariance P;
  for (int i = 0; i < 8; ++i) {
    x(i) = Scalar(0);
    for (int j = 0; j < 8; ++j) P(i, j) = Scalar(i == j ? 0.1 : 0);
  }
  REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
  typename Process::Input input;
  input(0) = Scalar(1);
  input(1) = Scalar(0.1);
  input(2) = Scalar(0.05);
  typename auvest::ScaledRange<Scalar, 8>::Params range;
  range.leader_x_m = Scalar(20);
  range.scale_state = Scalar(5);
  range.offset_state = Scalar(6);
  std::vector<double> numbers;
  for (int k = 0; k < 5; ++k) {
    REQUIRE(filter.predict(Scalar(0.5), input) == auvest::Status::kOk);
    const auto report = filter.update(Scalar(19 - k), auvest::ScaledRange<Scalar, 8>(range));
    REQUIRE(report.status == auvest::Status::kOk);
    for (int i = 0; i < 8; ++i) numbers.push_back(double(filter.x()(i)));
  }
  return numbers;
}

TEST_CASE("explicit scalar: odometry with constants") {
  CHECK(run_constants<ExplicitDouble>() == run_constants<double>());
}

/// Guidance and control over a plan, with the model-aided filter between them.
template <class Scalar>
std::vector<double> run_guidance() {
  using Process = auvest::SpeedHeadingCurrent<Scalar>;
  std::vector<double> numbers;
  const auvest::Waypoint<Scalar> plan[] = {
      {Scalar(0), Scalar(0)}, {Scalar(60), Scalar(0)}, {Scalar(60), Scalar(50)}};
  typename auvest::Waypoints<Scalar>::Params p;
  p.arc_m = Scalar(18);
  p.end_radius_m = Scalar(-20);
  auvest::Waypoints<Scalar> path(p);
  REQUIRE(path.start(plan, 3) == auvest::Status::kOk);
  auvest::Ekf<Process> filter{Process()};
  auvest::Vector<Scalar, 4> x;
  auvest::Matrix<Scalar, 4, 4> P;
  for (int i = 0; i < 4; ++i) {
    x(i) = Scalar(0);
    for (int j = 0; j < 4; ++j) P(i, j) = Scalar(i == j ? 1 : 0);
  }
  REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
  auvest::LineOfSight<Scalar> sight;
  auvest::IntegralLineOfSight<Scalar> integral;
  auvest::AdaptiveLineOfSight<Scalar> adaptive;
  auvest::CrabFeedForward<Scalar> crab;
  auvest::VectorField<Scalar> field;
  auvest::VerticalLineOfSight<Scalar> vertical;
  auvest::ReferenceModel<Scalar> model;
  auvest::HeadingSlidingMode<Scalar> sliding;
  auvest::HeadingFilter<Scalar> heading;
  auvest::Autopilot<Scalar> autopilot;
  auvest::PoseControl<Scalar> pose;
  REQUIRE(heading.restart(Scalar(0.1)) == auvest::Status::kOk);
  auvest::PathPoint<Scalar> point;
  auvest::GuidanceCommand<Scalar> wanted;
  auvest::AutopilotReadings<Scalar> now;
  auvest::TorpedoCommand<Scalar> out;
  auvest::Reference<Scalar> reference;
  auvest::Vector<Scalar, 6> pose_now, rest, tau;
  for (int i = 0; i < 6; ++i) {
    pose_now(i) = Scalar(0.1 * i);
    rest(i) = Scalar(0);
  }
  Scalar pitch = Scalar(0);
  Scalar rudder = Scalar(0);
  const Scalar dt = Scalar(0.1);
  const Scalar speed = Scalar(1.5);
  for (int k = 0; k < 900; ++k) {
    auvest::Vector<Scalar, 3> motion;
    motion(0) = speed;
    motion(1) = Scalar(0.02);
    motion(2) = heading.heading_rad();
    REQUIRE(filter.predict(dt, motion) == auvest::Status::kOk);
    REQUIRE(path.locate(filter.x()(0), filter.x()(1), point) == auvest::Status::kOk);
    REQUIRE(crab.set_current(filter.x()(2), filter.x()(3)) == auvest::Status::kOk);
    const auvest::Status laws[] = {sight.update(point, speed, dt, wanted),
                                   integral.update(point, speed, dt, wanted),
                                   field.update(point, speed, dt, wanted),
                                   crab.update(point, speed, dt, wanted),
                                   adaptive.update(point, speed, dt, wanted),
                                   vertical.update(Scalar(0.1), point.cross_m, dt, pitch),
                                   model.update(wanted.heading_rad, dt, reference)};
    for (const auto status : laws) REQUIRE(status == auvest::Status::kOk);
    now.heading_rad = heading.heading_rad();
    now.speed_m_s = speed;
    now.depth_m = Scalar(5.1);
    REQUIRE(autopilot.update(wanted, speed, Scalar(5), now, dt, out) == auvest::Status::kOk);
    REQUIRE(sliding.update(reference, now.heading_rad, now.yaw_rate_rad_s, speed, dt, rudder) ==
            auvest::Status::kOk);
    REQUIRE(pose.update(rest, pose_now, rest, rest, k % 2 == 0, dt, tau) == auvest::Status::kOk);
    now.yaw_rate_rad_s =
        now.yaw_rate_rad_s + dt * (Scalar(0.6) * out.rudder_rad - now.yaw_rate_rad_s);
    REQUIRE(heading.predict(now.yaw_rate_rad_s, dt) == auvest::Status::kOk);
    REQUIRE(heading.update(heading.heading_rad()) == auvest::Status::kOk);
    if (k % 50 != 0) continue;
    for (const Scalar number :
         {filter.x()(0), filter.x()(1), out.rudder_rad, out.propeller_rev_s, out.stern_planes_rad,
          rudder, pitch, tau(4), adaptive.crab_rad(), integral.integral()}) {
      numbers.push_back(double(number));
    }
  }
  CHECK(path.finished());
  return numbers;
}

TEST_CASE("explicit scalar: guidance and control too") {
  CHECK(run_guidance<ExplicitDouble>() == run_guidance<double>());
}

}  // namespace
