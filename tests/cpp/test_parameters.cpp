// Parameters as they are made: every member has the value that its documentation says, and visit()
// names each of them once, in the order of stored records.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <new>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "auvest/auvest.hpp"
#include "auvest/registry.hpp"
#include "auvest/vehicle/remus100_prestero.hpp"

namespace {

using namespace auvest;

/// The name of a number with its value, 0 if nothing is said; of a group, the name alone.
struct Member {
  std::string name;
  double value;

  Member(const char* of, double is = 0) : name(of), value(is) {}
};

/// Takes what visit() names.
struct Seen {
  const char* begin;
  std::vector<Member> members;
  std::set<std::size_t> places;
  std::size_t bytes = 0;  ///< in all members
  std::size_t end = 0;    ///< of the last one
  int steps_back = 0;     ///< members that stand before their predecessor

  explicit Seen(const void* params) : begin(static_cast<const char*>(params)) {}

  void operator()(const char* name, const double& number) { add(name, number, number); }
  void operator()(const char* name, const std::uint8_t& number) { add(name, number, number); }
  void operator()(const char* name, const bool& flag) { add(name, flag, flag ? 1 : 0); }
  template <class Group>
  void operator()(const char* name, const Group& group) {
    add(name, group, 0);
  }

 private:
  template <class Kind>
  void add(const char* name, const Kind& member, double value) {
    const std::size_t at = std::size_t(reinterpret_cast<const char*>(&member) - begin);
    if (at < end) ++steps_back;
    places.insert(at);
    end = at + sizeof member;
    bytes += sizeof member;
    members.push_back(Member(name, value));
  }
};

/// Made in memory that is not 0: a member that is forgotten has no value of its own.
template <class Params>
struct Made {
  typename std::aligned_storage<sizeof(Params), alignof(Params)>::type memory;
  Params* params;

  Made() {
    std::memset(&memory, 0xA5, sizeof memory);
    params = new (&memory) Params;
  }
};

template <class Params>
void check_visit(const std::string& what, const std::vector<Member>& expected) {
  CAPTURE(what);
  Made<Params> made;
  Seen seen(made.params);
  made.params->visit(seen);
  REQUIRE(seen.members.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CAPTURE(expected[i].name);
    CHECK(seen.members[i].name == expected[i].name);
    CHECK(seen.members[i].value == expected[i].value);
  }
  // Each member once: in the order of the struct, of which none is left over. Limits of a range are
  // the beginning of a struct, and are named after the sensor's own.
  const std::size_t unit = alignof(Params);
  CHECK((seen.bytes + unit - 1) / unit * unit == sizeof(Params));
  CHECK(seen.steps_back == (std::is_base_of<RangeLimits<double>, Params>::value &&
                                    !std::is_same<RangeLimits<double>, Params>::value
                                ? 1
                                : 0));
}

std::vector<Member> with(std::vector<Member> first, const std::vector<Member>& then) {
  first.insert(first.end(), then.begin(), then.end());
  return first;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kDegree = 3.14159265358979323846 / 180;

TEST_CASE("parameters of vehicles: each by its name, absent until somebody gives a value") {
  check_visit<Lag<double>::Params>("Lag",
                                   {"low", "high", "dead_band", "time_constant_s", "rate_limit"});
  check_visit<RigidBody<double>::Params>(
      "RigidBody", {"mass_kg", "ixx_kg_m2", "iyy_kg_m2", "izz_kg_m2", "xg_m", "yg_m", "zg_m"});
  check_visit<AddedMass<double>::Params>(
      "AddedMass", {"surge_kg", "sway_kg", "heave_kg", "roll_kg_m2", "pitch_kg_m2", "yaw_kg_m2",
                    "sway_yaw_kg_m", "heave_pitch_kg_m", "munk"});
  check_visit<Restoring<double>::Params>("Restoring",
                                         {"weight_n", "buoyancy_n", "xb_m", "yb_m", "zb_m"});
  check_visit<LinearDamping<double, true>::Params>(
      "LinearDamping", {"surge_kg_s", "sway_kg_s", "heave_kg_s", "roll_kg_m2_s", "pitch_kg_m2_s",
                        "yaw_kg_m2_s", "fading_s_m"});
  check_visit<QuadraticDamping<double>::Params>(
      "QuadraticDamping",
      {"surge_kg_m", "sway_kg_m", "heave_kg_m", "roll_kg_m2", "pitch_kg_m2", "yaw_kg_m2"});
  check_visit<LiftDrag<double>::Params>(
      "LiftDrag", {"area_m2", {"aspect_ratio", 1}, "drag", "lift_slope", {"oswald", 0.7}});
  check_visit<CrossFlow<double>::Params>("CrossFlow", {"length_m", "diameter_m", "drag"});
  check_visit<Keel<double>::Params>("Keel", {"foil", "x_m", "z_m"});
  check_visit<Propeller<double>::Params>("Propeller", {"diameter_m",
                                                       "thrust_0",
                                                       "thrust_1",
                                                       "torque_0",
                                                       "torque_1",
                                                       {"advance_1", 1},
                                                       {"thrust_deduction", 1},
                                                       {"wake", 1},
                                                       "roll_torque",
                                                       "shaft"});
  check_visit<Fin<double, kSway>::Params>("Fin", {"area_m2", "lift_slope", "x_m", "servo"});
  check_visit<OddThrust<double>::Params>("OddThrust",
                                         {"c1_n", "c3_n", "c5_n", "c7_n", "c9_n", {"limit", 1}});
  check_visit<QuadraticThrust<double>::Params>("QuadraticThrust",
                                               {"ahead_n", "astern_n", "dead_band"});
  using Eight = Thrusters<double, 8, OddThrust<double>>;
  check_visit<Eight::Mount>("Mount", {"x_m", "y_m", "z_m", "forward", "starboard", "down"});
  check_visit<Eight::Params>("Thrusters", {"thruster_1", "thruster_2", "thruster_3", "thruster_4",
                                           "thruster_5", "thruster_6", "thruster_7", "thruster_8",
                                           "curve", "time_constant_s", "rate_limit_n_s"});
  check_visit<Torpedo<double>::Params>(
      "Torpedo", {"body", "added_mass", "restoring", "density_kg_m3", "linear_damping", "lift_drag",
                  "cross_flow", "keel", "propeller", "rudder", "stern_planes"});
  check_visit<Rov<double, 8>::Params>("Rov", {"body", "added_mass", "restoring", "linear_damping",
                                              "quadratic_damping", "thrusters"});
  check_visit<CoefficientTorpedo<double>::Params>(
      "CoefficientTorpedo",
      {"body",        "added_mass",  "restoring",     "x_uu",       "x_wq",         "x_qq",
       "x_vr",        "x_rr",        "y_vv",          "y_rr",       "y_uv",         "y_ur",
       "y_wp",        "y_pq",        "y_uu_rudder",   "z_ww",       "z_qq",         "z_uw",
       "z_uq",        "z_vp",        "z_rp",          "z_uu_stern", "k_pp",         "m_ww",
       "m_qq",        "m_uw",        "m_uq",          "m_vp",       "m_rp",         "m_uu_stern",
       "n_vv",        "n_rr",        "n_uv",          "n_ur",       "n_wp",         "n_pq",
       "n_uu_rudder", "thrust_n_s2", "torque_n_m_s2", "rudder",     "stern_planes", "shaft"});
  // Surge and sway last, then heave; attitude and heading first.
  check_visit<Allocation<double, 8>::Params>("Allocation", {"lowest_n",
                                                            "highest_n",
                                                            {"surge_priority", 2},
                                                            {"sway_priority", 2},
                                                            {"heave_priority", 1},
                                                            "roll_priority",
                                                            "pitch_priority",
                                                            "yaw_priority"});
}

TEST_CASE("parameters of guidance and control: documented defaults, each by its name") {
  check_visit<LineOfSight<double>::Params>("LineOfSight", {{"lookahead_m", 10}});
  check_visit<IntegralLineOfSight<double>::Params>("IntegralLineOfSight",
                                                   {{"lookahead_m", 10}, {"gain_m_s", 0.5}});
  check_visit<AdaptiveLineOfSight<double>::Params>(
      "AdaptiveLineOfSight", {{"lookahead_m", 10}, {"adaptation", 0.008}, {"limit_rad", 0.5}});
  check_visit<VerticalLineOfSight<double>::Params>(
      "VerticalLineOfSight", {{"lookahead_m", 10}, {"adaptation", 0.008}, {"limit_rad", 0.5}});
  check_visit<CrabFeedForward<double>::Params>("CrabFeedForward",
                                               {{"lookahead_m", 10}, {"limit", 0.9}});
  check_visit<VectorField<double>::Params>("VectorField",
                                           {{"approach_rad", 90 * kDegree}, {"gain", 0.1}});
  check_visit<Waypoints<double>::Params>("Waypoints",
                                         {{"switch_m", 10}, "arc_m", "hull_m", "end_radius_m"});
  check_visit<DubinsPath<double>::Params>("DubinsPath", {{"radius_m", 20}, "hull_m"});
  check_visit<SplinePath<double>::Params>("SplinePath", {"hull_m"});

  const std::vector<Member> steering = {{"time_constant_s", 1},
                                        {"gain", 0.6},
                                        {"speed_m_s", 1.5},
                                        "slowest_m_s",
                                        {"max_rudder_rad", 15 * kDegree}};
  check_visit<Steering<double>>("Steering", steering);
  check_visit<HeadingControl<double>::Params>(
      "HeadingControl", with(steering, {{"frequency_rad_s", 0.8}, {"damping", 1}, "share"}));
  check_visit<HeadingSlidingMode<double>::Params>("HeadingSlidingMode",
                                                  with(steering, {{"bandwidth_rad_s", 0.3},
                                                                  {"damping", 0.5},
                                                                  {"switching_rad_s", 0.05},
                                                                  {"boundary_rad_s", 0.1}}));
  check_visit<HeadingReference<double>::Params>("HeadingReference",
                                                {{"gain", 1}, {"max_rate_rad_s", 6 * kDegree}});
  check_visit<ReferenceModel<double>::Params>(
      "ReferenceModel", {{"frequency_rad_s", 0.5}, {"damping", 1}, {"max_rate", 6 * kDegree}});
  check_visit<HeadingFilter<double>::Params>("HeadingFilter", {{"share", 0.05}});
  check_visit<SpeedControl<double>::Params>(
      "SpeedControl",
      {{"advance_m", 0.1}, {"proportional", 5}, {"integral", 1}, {"max_rev_s", 1525 / 60.0}});
  check_visit<DepthControl<double>::Params>(
      "DepthControl",
      {{"proportional", 0.1}, {"integral", 0.005}, {"max_pitch_rad", 20 * kDegree}});
  check_visit<PitchControl<double>::Params>("PitchControl", {{"proportional", 1.5},
                                                             {"derivative", 1},
                                                             {"integral", 0.2},
                                                             {"max_plane_rad", 15 * kDegree}});
  check_visit<Autopilot<double>::Params>("Autopilot",
                                         {"reference", "heading", "speed", "depth", "pitch"});
  check_visit<PoseControl<double>::Params>("PoseControl", {"inertia", "frequency"});
  // Mass and added mass of `bluerov2_heavy`; roll and pitch are three times as fast.
  const PoseControl<double>::Params pose;
  const Rov<double, 8>::Params rov = bluerov2_heavy<double>();
  const double inertia[6] = {rov.body.mass_kg + rov.added_mass.surge_kg,
                             rov.body.mass_kg + rov.added_mass.sway_kg,
                             rov.body.mass_kg + rov.added_mass.heave_kg,
                             rov.body.ixx_kg_m2 + rov.added_mass.roll_kg_m2,
                             rov.body.iyy_kg_m2 + rov.added_mass.pitch_kg_m2,
                             rov.body.izz_kg_m2 + rov.added_mass.yaw_kg_m2};
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i);
    CHECK(pose.inertia(i) == close_to(inertia[i], 1e-12));
    CHECK(pose.frequency(i) == (i == 3 || i == 4 ? 3 : 1));
  }
}

TEST_CASE("parameters of models: documented defaults, each by its name") {
  const std::vector<Member> limits = {"smallest_range_m", {"largest_range_m", kInfinity}};
  check_visit<RangeLimits<double>>("RangeLimits", limits);
  check_visit<EulerAcceleration<double>::Params>(
      "EulerAcceleration",
      {{"position_psd", 1e-6}, {"velocity_psd", 1e-4}, {"acceleration_psd", 1e-5}});
  check_visit<SpeedHeading<double>::Params>("SpeedHeading", {{"sigma_forward", 0.1},
                                                             "sigma_starboard",
                                                             {"sigma_heading", 0.0174533},
                                                             {"bias_walk", 1e-4},
                                                             {"scale_walk", 1e-4}});
  check_visit<SpeedHeadingCurrent<double>::Params>(
      "SpeedHeadingCurrent", {{"position_psd", 0.004}, {"current_psd", 1e-5}});
  check_visit<Odometry<double>::Params>(
      "Odometry",
      {{"sigma_distance", 0.05}, {"sigma_drift", 0.1}, {"sigma_turn", 0.001}, "sigma_turned"});
  check_visit<OdometryConstants<double>::Params>("OdometryConstants", {{"sigma_distance", 0.05},
                                                                       {"sigma_drift", 0.1},
                                                                       {"sigma_turn", 0.001},
                                                                       "sigma_turned",
                                                                       "speed_state",
                                                                       "turn_state",
                                                                       "walk_0",
                                                                       "walk_1",
                                                                       "walk_2",
                                                                       "walk_3",
                                                                       "walk_4"});
  check_visit<WhiteAcceleration<double, 3>::Params>(
      "WhiteAcceleration", {{"velocity_psd", 1e-4}, {"vertical_velocity_psd", 1e-4}});
  check_visit<PlanarHull<double>::Params>("PlanarHull", {{"surge_psd", 1},
                                                         {"sway_psd", 1},
                                                         {"yaw_psd", 0.1},
                                                         {"position_psd", 1e-3},
                                                         {"current_psd", 1e-5},
                                                         {"step_s", 0.1}});
  check_visit<RangeBearing<double, 6>::Params>("RangeBearing", with({{"station_x_m", 0.2},
                                                                     {"station_y_m", 2},
                                                                     {"sigma_range_m", 0.05},
                                                                     {"sigma_bearing_rad", 0.01},
                                                                     {"near_field", 5}},
                                                                    limits));
  check_visit<RangeBearingElevation<double, 6>::Params>("RangeBearingElevation",
                                                        with({"station_x_m",
                                                              "station_y_m",
                                                              "station_z_m",
                                                              {"sigma_range_m", 0.5},
                                                              {"sigma_bearing_rad", 0.01},
                                                              {"sigma_elevation_rad", 0.01},
                                                              {"near_field", 5}},
                                                             limits));
  const std::vector<Member> leader =
      with({"leader_x_m", "leader_y_m", {"sigma_range_m", 1}, "sigma_leader_m"}, limits);
  check_visit<LeaderRange<double, 6>::Params>("LeaderRange", leader);
  check_visit<ScaledRange<double, 8>::Params>("ScaledRange",
                                              with(leader, {"scale_state", "offset_state"}));
  check_visit<Depth<double, 6>::Params>("Depth", {{"sigma_m", 0.1}});
  check_visit<BodyVelocity<double, 6, 3>::Params>("BodyVelocity", {"heading_rad",
                                                                   {"sigma_forward_m_s", 0.02},
                                                                   {"sigma_sideways_m_s", 0.02},
                                                                   {"sigma_vertical_m_s", 0.02}});
  check_visit<HeadingSpeed<double, 8>::Params>("HeadingSpeed", {{"sigma_heading_rad", 0.0174533},
                                                                {"sigma_forward_m_s", 0.05},
                                                                {"sigma_starboard_m_s", 0.05}});
}

TEST_CASE("parameters of filters, kernels and policies: documented defaults, each by its name") {
  check_visit<SigmaPoints<double>::Params>("SigmaPoints",
                                           {{"alpha", 1}, {"beta", 2}, {"kappa", -3}});
  check_visit<Huber<double>::Params>("Huber", {{"k", 1.345}});
  check_visit<Hampel<double>::Params>("Hampel", {{"a", 1.7}, {"b", 3.4}, {"c", 8.5}});
  check_visit<Igg<double>::Params>("Igg", {{"k0", 1.5}, {"k1", 3}});
  check_visit<FixedInterval<double>::Params>("FixedInterval", {{"interval_s", 0.5}});
  check_visit<CovarianceBudget<double>::Params>(
      "CovarianceBudget",
      {{"initial_s", 0.5}, {"min_s", 0.02}, {"max_s", 1}, {"position_sigma_m", 0.1}});
  check_visit<MahalanobisInterval<double>::Params>("MahalanobisInterval", {{"initial_s", 0.5},
                                                                           {"min_s", 0.02},
                                                                           {"max_s", 1},
                                                                           {"tau0", 0.5},
                                                                           {"scale", 0.1},
                                                                           {"epsilon", 1.6},
                                                                           {"gamma1_m2", 1e-4},
                                                                           {"gamma2", 1},
                                                                           {"ratio_max", 0.9},
                                                                           {"tau_min", 0.01},
                                                                           {"tau_max", 0.99}});
}

void check_echoes(const EchoParams<double>& p) {
  CHECK(p.gate == 13.8);
  CHECK(p.recover_after == 6);
  CHECK(p.recover_of == 8);
  CHECK(p.fastest_m_s == 10);
  CHECK(p.forget_after_s == 0);
  CHECK(p.rebirth_velocity_m_s == 3);
  CHECK(p.rebirth_acceleration_m_s2 == 0.01);
  CHECK(p.longest_step_s == 3600);
}

TEST_CASE("parameters that visit() does not name: documented defaults") {
  const Made<SlatfParams<double>> slatf;
  check_echoes(*slatf.params);
  CHECK(slatf.params->resample_below == 0.5);
  CHECK(!slatf.params->carry_covariance);
  CHECK(slatf.params->birth_velocity_m_s == 0);
  CHECK(slatf.params->birth_acceleration_m_s2 == 0.01);
  CHECK(slatf.params->monte_carlo);
  const Made<SlatfSharedParams<double>> shared;
  check_echoes(*shared.params);
  CHECK(shared.params->resample_below == 0.5);
  CHECK(shared.params->kept == 0.8);
  const Made<SlatfJointParams<double>> joint;
  check_echoes(*joint.params);
  CHECK(joint.params->resample_below == 0.5);
  CHECK(joint.params->kept == 0.5);
  const Made<EkfSlatParams<double>> ekf;
  check_echoes(*ekf.params);
  CHECK(!ekf.params->consider);

  const Made<CompassMotion<double>::Params> compass;
  CHECK(compass.params->sigma_speed_m_s == 2);
  CHECK(compass.params->sigma_heading_rad == 0.3);
  CHECK(compass.params->compensate_bias);
  const Made<UnicycleMotion<double>::Params> unicycle;
  CHECK(unicycle.params->sigma_speed_m_s == 0.1);
  CHECK(unicycle.params->sigma_yaw_rate_rad_s == 0.01);
  const Made<Sonar<double>::Params> sonar;
  CHECK(sonar.params->sigma_range_m == 1);
  CHECK(sonar.params->sigma_bearing_rad == 0.06);
  CHECK(sonar.params->bearing == Bearing::kMasterToSlave);
  CHECK(sonar.params->smallest_range_m == 0);
  CHECK(sonar.params->largest_range_m == kInfinity);
  const Made<ConstantVelocity<double>::Params> velocity;
  CHECK(velocity.params->velocity == 1e-4);
  CHECK(velocity.params->sigma_acceleration_m_s2 == 0.1);
  const Made<PiecewiseAcceleration<double>::Params> piecewise;
  CHECK(piecewise.params->acceleration_m_s2 == 1e-4);
  CHECK(piecewise.params->position_psd == 0);

  using Plain = RobustEkf<ExactAcceleration<double>, Huber<double>>;
  const Made<GaussianSum<Plain>::Params> sum;
  CHECK(sum.params->outlier_share == 0.1);
  CHECK(sum.params->outlier_width == 50);
  CHECK(int(sum.params->components) == 32);  // all that there is room for
  const Made<RejectionStreak<double>::Params> streak;
  CHECK(int(streak.params->rejections) == 6);
  const Made<RobustUpdate<Huber<double>>::Params> robust;
  CHECK(robust.params->residual == Residual::kInnovation);
  CHECK(int(robust.params->max_iterations) == 10);
  CHECK(robust.params->tolerance == 1e-3);

  const Made<Pilot<double>::Params> pilot;
  CHECK(pilot.params->period_s == 0.1);
  CHECK(pilot.params->speed_m_s == 1.5);
  CHECK(pilot.params->depth_m == 5);
  CHECK(pilot.params->end_m == 2);
  CHECK(pilot.params->start_sigma_m == 1);
  CHECK(pilot.params->current_sigma_m_s == 0.3);
  CHECK(pilot.params->hold_s == 1);
  CHECK(pilot.params->compass_s == 30);
  CHECK(pilot.params->lost_m == 20);
  CHECK(pilot.params->most_angle_rad == close_to(360 * kDegree, 1e-7));
  CHECK(pilot.params->most_pitch_rad == 1.4);
  CHECK(pilot.params->most_rate_rad_s == 2);
  CHECK(pilot.params->most_speed_m_s == 5);
  CHECK(pilot.params->least_depth_m == -2);
  CHECK(pilot.params->most_depth_m == 200);
  CHECK(pilot.params->most_range_m == 2000);
}

/// Of a model that suits: no number without a name but the upper triangle of a covariance.
template <bool Suits, class Model>
struct Check {
  static int run(const std::string& name) {
    CAPTURE(name);
    const Made<typename Model::Params> made;
    Seen seen(made.params);
    made.params->visit(seen);
    std::set<std::string> names;
    for (const Member& member : seen.members) names.insert(member.name);
    CHECK(names.size() == seen.members.size());
    CHECK(seen.places.size() == seen.members.size());
    if (name.substr(0, 8) != "Position") CHECK(seen.bytes == sizeof(typename Model::Params));
    return 1;
  }
};

template <class Model>
struct Check<false, Model> {
  static int run(const std::string&) { return 0; }
};

template <int N>
int check_sensors() {
  using Scalar = double;
  int models = 0;
#define CHECK_SENSOR(name, suits, ...) models += Check<(suits), __VA_ARGS__>::run(name);
  AUVEST_SENSORS(CHECK_SENSOR)
#undef CHECK_SENSOR
  return models;
}

TEST_CASE("parameters of registered models: every name is that of another number") {
  using Scalar = double;
  int models = 0;
#define CHECK_PROCESS(name, ...) models += Check<true, __VA_ARGS__>::run(name);
  AUVEST_PROCESSES(CHECK_PROCESS)
#undef CHECK_PROCESS
  CHECK(models == 12);
  CHECK(check_sensors<6>() == 8);
  CHECK(check_sensors<8>() == 5);
}

// ---- What check() takes
// ---------------------------------------------------------------------------

/// Puts a value in the place of one of the numbers, those of groups among them.
struct Put {
  int which;
  double value;
  int& count;
  std::string& name;
  std::string before;

  void operator()(const std::string& of, double& number) {
    if (count++ != which) return;
    number = value;
    name = before + of;
  }
  void operator()(const std::string&, bool&) {}
  void operator()(const std::string&, std::uint8_t&) {}
  template <int Rows>
  void operator()(const std::string& of, Vector<double, Rows>& numbers) {
    for (int i = 0; i < Rows; ++i) (*this)(of, numbers(i));
  }
  template <class Group>
  void operator()(const std::string& of, Group& group) {
    group.visit(Put{which, value, count, name, before + of + "."});
  }
};

/// The members, by name and in order, that may have this value (or may not) where all others are
/// those of `params`; without the mounts of thrusters, of which three numbers make one length.
template <class Thing>
std::string members_where(bool taken, double value, const typename Thing::Params& params) {
  REQUIRE(Thing(params).check() == Status::kOk);
  std::string names;
  for (int which = 0;; ++which) {
    typename Thing::Params changed = params;
    std::string name;
    int count = 0;
    changed.visit(Put{which, value, count, name, ""});
    if (which >= count) return names;
    if (!std::isnan(value) && name.find(".thruster_") != std::string::npos) continue;
    if ((Thing(changed).check() == Status::kOk) == taken)
      names += (names.empty() ? "" : " ") + name;
  }
}

struct Range {
  std::string of, may_be_negative, may_not_be_zero;
};

template <class Thing>
void check_range(const Range& range,
                 const typename Thing::Params& params = typename Thing::Params()) {
  CAPTURE(range.of);
  CHECK(members_where<Thing>(true, std::numeric_limits<double>::quiet_NaN(), params) == "");
  CHECK(members_where<Thing>(true, -1, params) == range.may_be_negative);
  CHECK(members_where<Thing>(false, 0, params) == range.may_not_be_zero);
}

TEST_CASE("parameters out of range: which may be negative, which 0, and none NaN") {
  check_range<LineOfSight<double>>({"LineOfSight", "", "lookahead_m"});
  check_range<IntegralLineOfSight<double>>({"IntegralLineOfSight", "", "lookahead_m gain_m_s"});
  check_range<AdaptiveLineOfSight<double>>({"AdaptiveLineOfSight", "", "lookahead_m"});
  check_range<VerticalLineOfSight<double>>({"VerticalLineOfSight", "", "lookahead_m"});
  check_range<CrabFeedForward<double>>({"CrabFeedForward", "", "lookahead_m"});
  check_range<VectorField<double>>({"VectorField", "", "approach_rad gain"});
  check_range<Waypoints<double>>({"Waypoints", "end_radius_m", ""});
  check_range<DubinsPath<double>>({"DubinsPath", "", "radius_m"});
  check_range<SplinePath<double>>({"SplinePath", "", ""});
  check_range<HeadingControl<double>>(
      {"HeadingControl", "",
       "time_constant_s gain speed_m_s max_rudder_rad frequency_rad_s damping"});
  check_range<HeadingSlidingMode<double>>(
      {"HeadingSlidingMode", "",
       "time_constant_s gain speed_m_s max_rudder_rad bandwidth_rad_s boundary_rad_s"});
  check_range<HeadingReference<double>>({"HeadingReference", "", "gain max_rate_rad_s"});
  check_range<ReferenceModel<double>>({"ReferenceModel", "", "frequency_rad_s damping max_rate"});
  check_range<HeadingFilter<double>>({"HeadingFilter", "", ""});
  check_range<SpeedControl<double>>({"SpeedControl", "", "advance_m max_rev_s"});
  check_range<DepthControl<double>>({"DepthControl", "", "max_pitch_rad"});
  check_range<PitchControl<double>>({"PitchControl", "", "max_plane_rad"});
  check_range<Autopilot<double>>(
      {"Autopilot", "",
       "reference.gain reference.max_rate_rad_s heading.time_constant_s heading.gain "
       "heading.speed_m_s heading.max_rudder_rad heading.frequency_rad_s heading.damping "
       "speed.advance_m speed.max_rev_s depth.max_pitch_rad pitch.max_plane_rad"});
  check_range<PoseControl<double>>({"PoseControl", "",
                                    "inertia inertia inertia inertia inertia inertia frequency "
                                    "frequency frequency frequency frequency frequency"});
  check_range<Hull<Torpedo<double, Keel<double>>>>(
      {"Torpedo",
       "body.xg_m body.yg_m body.zg_m added_mass.surge_kg added_mass.sway_kg added_mass.heave_kg "
       "added_mass.pitch_kg_m2 added_mass.yaw_kg_m2 added_mass.sway_yaw_kg_m "
       "added_mass.heave_pitch_kg_m restoring.xb_m restoring.yb_m restoring.zb_m keel.x_m keel.z_m "
       "propeller.thrust_1 propeller.torque_0 propeller.torque_1 propeller.roll_torque "
       "propeller.shaft.low rudder.x_m rudder.servo.low stern_planes.x_m stern_planes.servo.low",
       "body.mass_kg body.ixx_kg_m2 body.iyy_kg_m2 body.izz_kg_m2 density_kg_m3 "
       "lift_drag.aspect_ratio lift_drag.oswald cross_flow.length_m keel.foil.aspect_ratio "
       "keel.foil.oswald propeller.diameter_m propeller.thrust_0 propeller.advance_1 "
       "propeller.thrust_deduction propeller.shaft.time_constant_s rudder.servo.time_constant_s "
       "stern_planes.servo.time_constant_s"},
      remus100<double, Keel<double>>());
  check_range<Hull<Rov<double, 8>>>(
      {"Rov",
       "body.xg_m body.yg_m body.zg_m added_mass.surge_kg added_mass.sway_kg added_mass.heave_kg "
       "added_mass.sway_yaw_kg_m added_mass.heave_pitch_kg_m restoring.xb_m restoring.yb_m "
       "restoring.zb_m thrusters.curve.c5_n thrusters.curve.c9_n",
       "body.mass_kg body.ixx_kg_m2 body.iyy_kg_m2 body.izz_kg_m2 thrusters.curve.c1_n "
       "thrusters.curve.c3_n thrusters.curve.c7_n thrusters.curve.limit thrusters.time_constant_s"},
      bluerov2_heavy<double>());
  check_range<Hull<CoefficientTorpedo<double>>>(
      {"CoefficientTorpedo",
       "body.xg_m body.yg_m body.zg_m added_mass.surge_kg added_mass.sway_kg added_mass.heave_kg "
       "added_mass.pitch_kg_m2 added_mass.yaw_kg_m2 added_mass.sway_yaw_kg_m "
       "added_mass.heave_pitch_kg_m restoring.xb_m restoring.yb_m restoring.zb_m x_uu x_wq x_qq "
       "x_vr x_rr y_vv y_rr y_uv y_ur y_wp y_pq y_uu_rudder z_ww z_qq z_uw z_uq z_vp z_rp "
       "z_uu_stern k_pp m_ww m_qq m_uw m_uq m_vp m_rp m_uu_stern n_vv n_rr n_uv n_ur n_wp n_pq "
       "n_uu_rudder thrust_n_s2 torque_n_m_s2 rudder.low stern_planes.low shaft.low",
       "body.mass_kg body.ixx_kg_m2 body.iyy_kg_m2 body.izz_kg_m2 rudder.time_constant_s "
       "stern_planes.time_constant_s shaft.time_constant_s"},
      remus100_prestero<double>());
  QuadraticThrust<double>::Params thrust;
  thrust.ahead_n = 51, thrust.astern_n = 40, thrust.dead_band = 0.08;
  check_range<QuadraticThrust<double>>({"QuadraticThrust", "", "ahead_n astern_n"}, thrust);
  check_range<EulerAcceleration<double>>({"EulerAcceleration", "", ""});
  check_range<SpeedHeading<double, true, true>>({"SpeedHeading", "", ""});
  check_range<SpeedHeadingCurrent<double>>({"SpeedHeadingCurrent", "", ""});
  check_range<Odometry<double>>({"Odometry", "", ""});
  check_range<OdometryConstants<double>>({"OdometryConstants", "", ""});
  check_range<WhiteAcceleration<double, 3>>({"WhiteAcceleration", "", ""});
  check_range<PlanarHull<double>>({"PlanarHull", "", "step_s"});
  check_range<RangeBearing<double, 6>>({"RangeBearing", "station_x_m station_y_m smallest_range_m",
                                        "sigma_range_m sigma_bearing_rad largest_range_m"});
  check_range<RangeBearingElevation<double, 6>>(
      {"RangeBearingElevation", "station_x_m station_y_m station_z_m smallest_range_m",
       "sigma_range_m sigma_bearing_rad sigma_elevation_rad largest_range_m"});
  check_range<LeaderRange<double, 6>>(
      {"LeaderRange", "leader_x_m leader_y_m smallest_range_m", "sigma_range_m largest_range_m"});
  check_range<ScaledRange<double, 8>>(
      {"ScaledRange", "leader_x_m leader_y_m smallest_range_m", "sigma_range_m largest_range_m"});
  check_range<Depth<double, 6>>({"Depth", "", "sigma_m"});
  check_range<BodyVelocity<double, 6, 3>>(
      {"BodyVelocity", "heading_rad", "sigma_forward_m_s sigma_sideways_m_s sigma_vertical_m_s"});
  check_range<HeadingSpeed<double, 8>>(
      {"HeadingSpeed", "", "sigma_heading_rad sigma_forward_m_s sigma_starboard_m_s"});
  check_range<Huber<double>>({"Huber", "", "k"});
  check_range<Hampel<double>>({"Hampel", "", "a b c"});
  check_range<Igg<double>>({"Igg", "", "k0 k1"});
  check_range<FixedInterval<double>>({"FixedInterval", "", "interval_s"});
  check_range<CovarianceBudget<double>>(
      {"CovarianceBudget", "", "initial_s min_s max_s position_sigma_m"});
  check_range<MahalanobisInterval<double>>(
      {"MahalanobisInterval", "",
       "initial_s min_s max_s tau0 epsilon gamma1_m2 gamma2 ratio_max tau_min tau_max"});
}

}  // namespace
