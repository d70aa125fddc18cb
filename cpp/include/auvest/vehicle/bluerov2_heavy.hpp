// `bluerov2_heavy`: a BlueROV2 with the heavy kit, eight thrusters. From von Benzon et al. (2022),
// J. Mar. Sci. Eng. 10, 1898, Table A1; the thrusters' time constant is ours.
//
// The horizontal thrusters sit 8.5 cm below the origin, and the righting arm is 1 cm: 15.5 N of
// surge by them alone tips the vehicle over. So a demand is allocated in all six axes.
#pragma once

#include "auvest/vehicle/rov.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace detail {

template <class Mount, class Scalar>
void place_thruster(Mount& mount, Scalar x, Scalar y, Scalar z, Scalar forward, Scalar starboard,
                    Scalar down) {
  mount.x_m = x;
  mount.y_m = y;
  mount.z_m = z;
  mount.forward = forward;
  mount.starboard = starboard;
  mount.down = down;
}

/// What both BlueROV2 have: weight, hull, four horizontal thrusters and their curve.
template <class Scalar, class Params>
void bluerov2_frame(Params& p) {
  p.restoring.zb_m = Scalar(-0.01);
  p.body.mass_kg = Scalar(13.5);
  p.body.ixx_kg_m2 = Scalar(0.26);
  p.body.iyy_kg_m2 = Scalar(0.23);
  p.body.izz_kg_m2 = Scalar(0.37);
  // As numbers, so that they are the same floats wherever they are rounded: g = 9.82 m/s^2 times
  // the mass, and times 0.0134 m^3 of fresh water, 1000 kg/m^3.
  p.restoring.weight_n = Scalar(132.57);
  p.restoring.buoyancy_n = Scalar(131.588);
  p.added_mass.surge_kg = Scalar(6.36);
  p.added_mass.sway_kg = Scalar(7.12);
  p.added_mass.heave_kg = Scalar(18.68);
  p.added_mass.roll_kg_m2 = Scalar(0.189);
  p.added_mass.pitch_kg_m2 = Scalar(0.135);
  p.added_mass.yaw_kg_m2 = Scalar(0.222);
  p.added_mass.munk = true;
  p.linear_damping.surge_kg_s = Scalar(13.7);
  p.linear_damping.heave_kg_s = Scalar(33);
  p.linear_damping.pitch_kg_m2_s = Scalar(0.8);
  p.quadratic_damping.surge_kg_m = Scalar(141);
  p.quadratic_damping.sway_kg_m = Scalar(217);
  p.quadratic_damping.heave_kg_m = Scalar(190);
  p.quadratic_damping.roll_kg_m2 = Scalar(1.19);
  p.quadratic_damping.pitch_kg_m2 = Scalar(0.47);
  p.quadratic_damping.yaw_kg_m2 = Scalar(1.5);

  // Front right, front left, rear right, rear left.
  const Scalar s = Scalar(0.70710678118654752);
  const Scalar x = Scalar(0.156), y = Scalar(0.111), z = Scalar(0.085), none = Scalar(0);
  place_thruster(p.thrusters.mounts[0], x, y, z, s, -s, none);
  place_thruster(p.thrusters.mounts[1], x, -y, z, s, s, none);
  place_thruster(p.thrusters.mounts[2], -x, y, z, -s, -s, none);
  place_thruster(p.thrusters.mounts[3], -x, -y, z, -s, s, none);
  p.thrusters.curve.c1_n = Scalar(8.9);
  p.thrusters.curve.c3_n = Scalar(176);
  p.thrusters.curve.c5_n = Scalar(-404.1);
  p.thrusters.curve.c7_n = Scalar(389.9);
  p.thrusters.curve.c9_n = Scalar(-140.3);
  p.thrusters.curve.limit = Scalar(0.9716);  // the maximum, 30.62 N, is at 0.97166
  p.thrusters.time_constant_s = Scalar(0.1);
}

}  // namespace detail

template <class Scalar>
typename Rov<Scalar, 8>::Params bluerov2_heavy() {
  typename Rov<Scalar, 8>::Params p;
  detail::bluerov2_frame<Scalar>(p);
  // Vertical thrusters in the same order; a positive input lifts.
  const Scalar x = Scalar(0.120), y = Scalar(0.218), none = Scalar(0), up = Scalar(-1);
  detail::place_thruster(p.thrusters.mounts[4], x, y, none, none, none, up);
  detail::place_thruster(p.thrusters.mounts[5], x, -y, none, none, none, up);
  detail::place_thruster(p.thrusters.mounts[6], -x, y, none, none, none, up);
  detail::place_thruster(p.thrusters.mounts[7], -x, -y, none, none, none, up);
  return p;
}

/// The standard BlueROV2, with two vertical thrusters: it cannot pitch by itself. The same hull;
/// the arm of its vertical thrusters, 0.11 m, comes from no primary source.
template <class Scalar>
typename Rov<Scalar, 6>::Params bluerov2() {
  typename Rov<Scalar, 6>::Params p;
  detail::bluerov2_frame<Scalar>(p);
  const Scalar y = Scalar(0.11), none = Scalar(0), up = Scalar(-1);
  detail::place_thruster(p.thrusters.mounts[4], none, y, none, none, none, up);
  detail::place_thruster(p.thrusters.mounts[5], none, -y, none, none, none, up);
  return p;
}

/// The same thrusters with the older, lighter hull of Wu (2018), with which many simulators fly.
template <class Scalar>
typename Rov<Scalar, 8>::Params bluerov2_heavy_wu2018() {
  typename Rov<Scalar, 8>::Params p = bluerov2_heavy<Scalar>();
  p.body.mass_kg = Scalar(11.5);
  p.body.ixx_kg_m2 = p.body.iyy_kg_m2 = p.body.izz_kg_m2 = Scalar(0.16);
  p.body.zg_m = Scalar(0.02);
  p.restoring.zb_m = Scalar(0);
  p.restoring.weight_n = Scalar(112.8);
  p.restoring.buoyancy_n = Scalar(114.8);
  p.added_mass.surge_kg = Scalar(5.5);
  p.added_mass.sway_kg = Scalar(12.7);
  p.added_mass.heave_kg = Scalar(14.57);
  p.added_mass.roll_kg_m2 = p.added_mass.pitch_kg_m2 = p.added_mass.yaw_kg_m2 = Scalar(0.12);
  p.linear_damping.surge_kg_s = Scalar(4.03);
  p.linear_damping.sway_kg_s = Scalar(6.22);
  p.linear_damping.heave_kg_s = Scalar(5.18);
  p.linear_damping.roll_kg_m2_s = p.linear_damping.pitch_kg_m2_s = p.linear_damping.yaw_kg_m2_s =
      Scalar(0.07);
  p.quadratic_damping.surge_kg_m = Scalar(18.18);
  p.quadratic_damping.sway_kg_m = Scalar(21.66);
  p.quadratic_damping.heave_kg_m = Scalar(36.99);
  p.quadratic_damping.roll_kg_m2 = p.quadratic_damping.pitch_kg_m2 = p.quadratic_damping.yaw_kg_m2 =
      Scalar(1.55);
  return p;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
