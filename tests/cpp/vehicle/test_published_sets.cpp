// The parameter sets that are transcribed: every number as its source has it, and no other.
#include <doctest/doctest.h>

#include <map>
#include <string>

#include "auvest/vehicle/bluerov2_heavy.hpp"
#include "auvest/vehicle/remus100_prestero.hpp"

namespace {

using Numbers = std::map<std::string, double>;

/// All numbers of a set by their names, those of a group behind its name.
struct Flat {
  Numbers& numbers;
  std::string before;

  void operator()(const std::string& name, double number) { numbers[before + name] = number; }
  void operator()(const std::string& name, bool flag) { numbers[before + name] = flag ? 1 : 0; }
  template <class Group>
  void operator()(const std::string& name, Group& group) {
    group.visit(Flat{numbers, before + name + "."});
  }
};

/// The numbers that are not those of a set to which nobody has given a value.
template <class Params>
Numbers given(Params params) {
  Numbers numbers, none;
  params.visit(Flat{numbers, ""});
  Params().visit(Flat{none, ""});
  for (const auto& number : none) {
    if (numbers[number.first] == number.second) numbers.erase(number.first);
  }
  return numbers;
}

void check_same(const Numbers& numbers, const Numbers& expected) {
  for (const auto& number : numbers) {
    CAPTURE(number.first);
    REQUIRE(expected.count(number.first) == 1);
    CHECK(number.second == expected.at(number.first));
  }
  CHECK(numbers.size() == expected.size());
}

/// Thruster 1..: place [m] and direction; from 0 where nothing is said.
void mount(Numbers& numbers, int thruster, double x, double y, double z, double forward,
           double starboard, double down) {
  const std::string at = "thrusters.thruster_" + std::to_string(thruster) + ".";
  const Numbers all = {
      {"x_m", x},    {"y_m", y}, {"z_m", z}, {"forward", forward}, {"starboard", starboard},
      {"down", down}};
  for (const auto& number : all) {
    if (number.second != 0) numbers[at + number.first] = number.second;
  }
}

/// Von Benzon et al. (2022), Table A1, where both BlueROV2 have it: derivatives with the sign
/// turned, W = 13.5 kg of 9.82 m/s^2, B = 0.0134 m^3 of 1000 kg/m^3; 0.1 s is ours.
Numbers frame() {
  Numbers n = {{"body.mass_kg", 13.5},
               {"body.ixx_kg_m2", 0.26},
               {"body.iyy_kg_m2", 0.23},
               {"body.izz_kg_m2", 0.37},
               {"restoring.weight_n", 132.57},
               {"restoring.buoyancy_n", 131.588},
               {"restoring.zb_m", -0.01},
               {"added_mass.surge_kg", 6.36},
               {"added_mass.sway_kg", 7.12},
               {"added_mass.heave_kg", 18.68},
               {"added_mass.roll_kg_m2", 0.189},
               {"added_mass.pitch_kg_m2", 0.135},
               {"added_mass.yaw_kg_m2", 0.222},
               {"added_mass.munk", 1},
               {"linear_damping.surge_kg_s", 13.7},
               {"linear_damping.heave_kg_s", 33},
               {"linear_damping.pitch_kg_m2_s", 0.8},
               {"quadratic_damping.surge_kg_m", 141},
               {"quadratic_damping.sway_kg_m", 217},
               {"quadratic_damping.heave_kg_m", 190},
               {"quadratic_damping.roll_kg_m2", 1.19},
               {"quadratic_damping.pitch_kg_m2", 0.47},
               {"quadratic_damping.yaw_kg_m2", 1.5},
               {"thrusters.curve.c1_n", 8.9},
               {"thrusters.curve.c3_n", 176},
               {"thrusters.curve.c5_n", -404.1},
               {"thrusters.curve.c7_n", 389.9},
               {"thrusters.curve.c9_n", -140.3},
               {"thrusters.curve.limit", 0.9716},
               {"thrusters.time_constant_s", 0.1}};
  // Front right, front left, rear right, rear left: each pushes at 45 degrees to the axes.
  const double s = 0.70710678118654752;
  mount(n, 1, 0.156, 0.111, 0.085, s, -s, 0);
  mount(n, 2, 0.156, -0.111, 0.085, s, s, 0);
  mount(n, 3, -0.156, 0.111, 0.085, -s, -s, 0);
  mount(n, 4, -0.156, -0.111, 0.085, -s, s, 0);
  return n;
}

void mount_vertical_four(Numbers& n) {
  mount(n, 5, 0.12, 0.218, 0, 0, 0, -1);
  mount(n, 6, 0.12, -0.218, 0, 0, 0, -1);
  mount(n, 7, -0.12, 0.218, 0, 0, 0, -1);
  mount(n, 8, -0.12, -0.218, 0, 0, 0, -1);
}

TEST_CASE("BlueROV2: heavy, standard, and the older hull, number by number") {
  Numbers heavy = frame();
  mount_vertical_four(heavy);
  check_same(given(auvest::bluerov2_heavy<double>()), heavy);

  Numbers standard = frame();
  mount(standard, 5, 0, 0.11, 0, 0, 0, -1);
  mount(standard, 6, 0, -0.11, 0, 0, 0, -1);
  check_same(given(auvest::bluerov2<double>()), standard);

  // Wu (2018): the buoyancy's centre is the origin, and the weight's 2 cm below it.
  Numbers wu = heavy;
  wu.erase("restoring.zb_m");
  const Numbers hull = {{"body.mass_kg", 11.5},
                        {"body.ixx_kg_m2", 0.16},
                        {"body.iyy_kg_m2", 0.16},
                        {"body.izz_kg_m2", 0.16},
                        {"body.zg_m", 0.02},
                        {"restoring.weight_n", 112.8},
                        {"restoring.buoyancy_n", 114.8},
                        {"added_mass.surge_kg", 5.5},
                        {"added_mass.sway_kg", 12.7},
                        {"added_mass.heave_kg", 14.57},
                        {"added_mass.roll_kg_m2", 0.12},
                        {"added_mass.pitch_kg_m2", 0.12},
                        {"added_mass.yaw_kg_m2", 0.12},
                        {"linear_damping.surge_kg_s", 4.03},
                        {"linear_damping.sway_kg_s", 6.22},
                        {"linear_damping.heave_kg_s", 5.18},
                        {"linear_damping.roll_kg_m2_s", 0.07},
                        {"linear_damping.pitch_kg_m2_s", 0.07},
                        {"linear_damping.yaw_kg_m2_s", 0.07},
                        {"quadratic_damping.surge_kg_m", 18.18},
                        {"quadratic_damping.sway_kg_m", 21.66},
                        {"quadratic_damping.heave_kg_m", 36.99},
                        {"quadratic_damping.roll_kg_m2", 1.55},
                        {"quadratic_damping.pitch_kg_m2", 1.55},
                        {"quadratic_damping.yaw_kg_m2", 1.55}};
  for (const auto& number : hull) wu[number.first] = number.second;
  check_same(given(auvest::bluerov2_heavy_wu2018<double>()), wu);
}

TEST_CASE("remus100_prestero: number by number") {
  Numbers n = {{"body.mass_kg", 30.48},
               {"body.ixx_kg_m2", 0.177},
               {"body.iyy_kg_m2", 3.45},
               {"body.izz_kg_m2", 3.45},
               {"body.zg_m", 0.0196},
               {"restoring.weight_n", 299},
               {"restoring.buoyancy_n", 306},
               {"added_mass.surge_kg", 0.93},
               {"added_mass.sway_kg", 35.5},
               {"added_mass.heave_kg", 35.5},
               {"added_mass.roll_kg_m2", 0.0704},
               {"added_mass.pitch_kg_m2", 4.88},
               {"added_mass.yaw_kg_m2", 4.88},
               {"added_mass.sway_yaw_kg_m", -1.93},
               {"added_mass.heave_pitch_kg_m", 1.93},
               {"x_uu", -1.62},
               {"x_wq", -35.5},
               {"x_qq", -1.93},
               {"x_vr", 35.5},
               {"x_rr", -1.93},
               {"y_vv", -131.0 * 10},  // as much larger as the runs at sea ask
               {"y_rr", 0.632},
               {"y_uv", -28.6},
               {"y_ur", 5.22},
               {"y_wp", 35.5},
               {"y_pq", 1.93},
               {"z_ww", -131},
               {"z_qq", -0.632},
               {"z_uw", -28.6},
               {"z_uq", -5.22},
               {"z_vp", -35.5},
               {"z_rp", 1.93},
               {"k_pp", -0.13},
               {"m_ww", 3.18},
               {"m_qq", -9.4 * 20},
               {"m_uw", 24},
               {"m_uq", -2},
               {"m_vp", -1.93},
               {"m_rp", 4.86},
               {"n_vv", -3.18},
               {"n_rr", -9.4 * 10},
               {"n_uv", -24},
               {"n_ur", -2},
               {"n_wp", -1.93},
               {"n_pq", -4.86},
               {"y_uu_rudder", -9.64},
               {"n_uu_rudder", 6.15},
               {"z_uu_stern", -9.64},
               {"m_uu_stern", -6.15},
               {"thrust_n_s2", 0.006176},
               {"torque_n_m_s2", -0.0008688}};
  // Fins to 15 degrees in 0.1 s; 1525 rpm in 1 s.
  const double fin = 0.26179938779914946, shaft = 1525 / 60.0;
  for (const char* name : {"rudder.", "stern_planes.", "shaft."}) {
    const bool turns = name[1] == 'h';
    n[std::string(name) + "low"] = turns ? -shaft : -fin;
    n[std::string(name) + "high"] = turns ? shaft : fin;
    n[std::string(name) + "time_constant_s"] = turns ? 1 : 0.1;
  }
  check_same(given(auvest::remus100_prestero<double>()), n);
}

}  // namespace
