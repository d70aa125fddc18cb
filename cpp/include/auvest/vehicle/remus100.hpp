// `remus100`: a torpedo of 1.6 m and 0.19 m, like REMUS 100. From MSS and PythonVehicleSimulator
// (`remus100`, T. I. Fossen) and Allen et al. (2000), without the defects that docs/algorithms/
// vehicle.md names.
#pragma once

#include "auvest/vehicle/torpedo.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// `Keel_`: Keel<Scalar> for a set with a keel, of area 0 until you give it one.
template <class Scalar, class Keel_ = NoKeel<Scalar>>
typename Torpedo<Scalar, Keel_>::Params remus100() {
  typename Torpedo<Scalar, Keel_>::Params p;
  const Scalar revolutions = Scalar(60);  // per minute, in a rev/s
  p.density_kg_m3 = Scalar(1026);         // sea water

  // A spheroid of semi-axes 1.0096 L/2 and 1.0096 d/2 (spheroid.hpp); the factor gives the
  // published 31.9 kg.
  p.body.mass_kg = Scalar(31.931637720275358);
  p.body.ixx_kg_m2 = Scalar(0.11749708142309541);
  p.body.iyy_kg_m2 = p.body.izz_kg_m2 = Scalar(4.224850042693878);
  p.body.zg_m = Scalar(0.02);
  p.added_mass.surge_kg = Scalar(0.8633018444864125);
  p.added_mass.sway_kg = p.added_mass.heave_kg = Scalar(30.2936055125789);
  p.added_mass.roll_kg_m2 = Scalar(0.035249124426928624);  // 0.3 I_x: fins and fittings
  p.added_mass.pitch_kg_m2 = p.added_mass.yaw_kg_m2 = Scalar(3.5938562541677506);

  // Neutral: W = B, the mass times 9.81 m/s^2.
  p.restoring.weight_n = Scalar(313.2493660359013);
  p.restoring.buoyancy_n = p.restoring.weight_n;

  // Time constants of 20 s in surge, sway and heave and of 1 s in yaw; damping ratios of 0.3 in
  // roll and 0.8 in pitch: M_ii / T and 2 zeta w_i M_ii, w_i^2 = W z_g / M_ii.
  p.linear_damping.surge_kg_s = Scalar(1.6397469782380885);
  p.linear_damping.sway_kg_s = p.linear_damping.heave_kg_s = Scalar(3.1112621616427125);
  p.linear_damping.roll_kg_m2_s = Scalar(0.6109913939182419);
  p.linear_damping.pitch_kg_m2_s = Scalar(11.207325185844931);
  p.linear_damping.yaw_kg_m2_s = Scalar(7.818706296861628);
  p.linear_damping.fading_s_m = Scalar(3);

  // S = 0.7 L d and A = d^2 / S; C_D0 from the drag area 0.42 pi b^2 (Allen et al. 2000).
  p.lift_drag.area_m2 = Scalar(0.2128);
  p.lift_drag.aspect_ratio = Scalar(0.16964285714285715);
  p.lift_drag.drag = Scalar(0.05703920106809605);
  p.lift_drag.lift_slope = Scalar(0.2659967942359403);  // pi A / (1 + sqrt(1 + A^2/4))
  p.lift_drag.oswald = Scalar(0.7);

  p.cross_flow.length_m = Scalar(1.6);
  p.cross_flow.diameter_m = Scalar(0.19);
  p.cross_flow.drag = Scalar(1.1977288343558283);  // Hoerner's curve at B/2T = 0.5

  // Allen et al. (2000), with the coefficients at J = 0 and J = 0.6632.
  p.propeller.diameter_m = Scalar(0.14);
  p.propeller.thrust_0 = Scalar(0.4566);
  p.propeller.thrust_1 = Scalar(0.1798);
  p.propeller.torque_0 = Scalar(0.0700);
  p.propeller.torque_1 = Scalar(0.0312);
  p.propeller.advance_1 = Scalar(0.6632);
  p.propeller.thrust_deduction = Scalar(0.9);
  p.propeller.wake = Scalar(0.944);
  p.propeller.roll_torque = Scalar(0.1);
  p.propeller.shaft = Lag<Scalar>::Params::symmetric(Scalar(1525) / revolutions, Scalar(1));

  // Two fins each, at the stern of the spheroid; 15 degrees.
  p.rudder.area_m2 = Scalar(0.0133);
  p.rudder.lift_slope = Scalar(0.5);
  p.rudder.x_m = Scalar(-0.80768);
  p.rudder.servo = Lag<Scalar>::Params::symmetric(Scalar(0.26179938779914946), Scalar(0.1));
  p.stern_planes.area_m2 = p.rudder.area_m2;
  p.stern_planes.lift_slope = Scalar(0.7);
  p.stern_planes.x_m = p.rudder.x_m;
  p.stern_planes.servo = p.rudder.servo;
  return p;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
