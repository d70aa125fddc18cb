// `remus100_prestero`: REMUS by the coefficients of Prestero (2001), as several public
// transcriptions give them; the thesis was not at hand. Origin at the centre of buoyancy.
//
// Two sets circulate. The other has the theoretical values Y_v|v| = -131, K_p|p| = -0.0013, K_pdot
// = -0.0141, M_q|q| = -9.40 and N_r|r| = -9.40. Those here are 10, 100, 5, 20 and 10 times as
// large: adjusted to runs at sea. The hull is unstable on a straight course in its linear terms;
// the quadratic ones hold it. Thrust and torque are those of 1500 rpm at 1.54 m/s, scaled with
// n|n|, and know no inflow.
#pragma once

#include "auvest/vehicle/coefficient_torpedo.hpp"

namespace auvest {

template <class Scalar>
typename CoefficientTorpedo<Scalar>::Params remus100_prestero() {
  typename CoefficientTorpedo<Scalar>::Params p;
  p.body.mass_kg = Scalar(30.48);
  p.body.ixx_kg_m2 = Scalar(0.177);
  p.body.iyy_kg_m2 = p.body.izz_kg_m2 = Scalar(3.45);
  p.body.zg_m = Scalar(0.0196);
  p.restoring.weight_n = Scalar(299);
  p.restoring.buoyancy_n = Scalar(306);

  p.added_mass.surge_kg = Scalar(0.930);
  p.added_mass.sway_kg = p.added_mass.heave_kg = Scalar(35.5);
  p.added_mass.roll_kg_m2 = Scalar(0.0704);
  p.added_mass.pitch_kg_m2 = p.added_mass.yaw_kg_m2 = Scalar(4.88);
  p.added_mass.sway_yaw_kg_m = Scalar(-1.93);
  p.added_mass.heave_pitch_kg_m = Scalar(1.93);

  p.x_uu = Scalar(-1.62);
  p.x_wq = Scalar(-35.5);
  p.x_qq = Scalar(-1.93);
  p.x_vr = Scalar(35.5);
  p.x_rr = Scalar(-1.93);
  p.y_vv = Scalar(-1310);
  p.y_rr = Scalar(0.632);
  p.y_uv = Scalar(-28.6);
  p.y_ur = Scalar(5.22);
  p.y_wp = Scalar(35.5);
  p.y_pq = Scalar(1.93);
  p.z_ww = Scalar(-131);
  p.z_qq = Scalar(-0.632);
  p.z_uw = Scalar(-28.6);
  p.z_uq = Scalar(-5.22);
  p.z_vp = Scalar(-35.5);
  p.z_rp = Scalar(1.93);
  p.k_pp = Scalar(-0.130);
  p.m_ww = Scalar(3.18);
  p.m_qq = Scalar(-188);
  p.m_uw = Scalar(24.0);
  p.m_uq = Scalar(-2.00);
  p.m_vp = Scalar(-1.93);
  p.m_rp = Scalar(4.86);
  p.n_vv = Scalar(-3.18);
  p.n_rr = Scalar(-94.0);
  p.n_uv = Scalar(-24.0);
  p.n_ur = Scalar(-2.00);
  p.n_wp = Scalar(-1.93);
  p.n_pq = Scalar(-4.86);

  // The rudder's sign is turned: here a positive one turns to starboard.
  p.y_uu_rudder = Scalar(-9.64);
  p.n_uu_rudder = Scalar(6.15);
  p.z_uu_stern = Scalar(-9.64);
  p.m_uu_stern = Scalar(-6.15);

  p.thrust_n_s2 = Scalar(0.006176);      // 3.86 N at 25 rev/s
  p.torque_n_m_s2 = Scalar(-0.0008688);  // -0.543 N m
  // Limits and lags of remus100.
  p.rudder = Lag<Scalar>::Params::symmetric(Scalar(0.26179938779914946), Scalar(0.1));
  p.stern_planes = p.rudder;
  p.shaft = Lag<Scalar>::Params::symmetric(Scalar(1525) / Scalar(60), Scalar(1));
  return p;
}

}  // namespace auvest
