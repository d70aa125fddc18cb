// A prolate spheroid in water: mass, inertia and added mass from its two semi-axes, for hulls of
// revolution that nobody has towed (Lamb; Imlay; Fossen 2021, 8.4.2).
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/vehicle/added_mass.hpp"
#include "auvest/vehicle/rigid_body.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar>
struct Spheroid {
  Scalar a_m;            ///< semi-axis along the hull, longer than b
  Scalar b_m;            ///< semi-axis across it
  Scalar density_kg_m3;  ///< rho of the water, which it displaces by its own mass

  /// Of a homogeneous body, its centre of gravity at the origin.
  typename RigidBody<Scalar>::Params body() const {
    typename RigidBody<Scalar>::Params p;
    const Scalar bb = b_m * b_m;
    // [HULL E1]
    p.mass_kg = Scalar(4) / Scalar(3) * math::pi<Scalar>() * density_kg_m3 * a_m * bb;
    p.ixx_kg_m2 = Scalar(0.4) * p.mass_kg * bb;
    p.iyy_kg_m2 = Scalar(0.2) * p.mass_kg * (a_m * a_m + bb);
    p.izz_kg_m2 = p.iyy_kg_m2;
    return p;
  }

  /// That of roll is 0: the water slips.
  typename AddedMass<Scalar>::Params added_mass() const {
    const Scalar one = Scalar(1), two = Scalar(2);
    const Scalar ratio = b_m / a_m;
    const Scalar flat = ratio * ratio;  // 1 - e^2
    const Scalar ee = one - flat;
    const Scalar e = math::sqrt(ee);
    const Scalar l = math::log((one + e) / (one - e));
    // [HULL E2]
    const Scalar alpha = two * flat / (ee * e) * (l / two - e);
    const Scalar beta = one / ee - flat * l / (two * ee * e);
    const Scalar difference = beta - alpha;
    const Scalar k1 = alpha / (two - alpha);
    const Scalar k2 = beta / (two - beta);
    const Scalar k3 = ee * ee * difference / ((two - ee) * (two * ee - (two - ee) * difference));
    const typename RigidBody<Scalar>::Params solid = body();
    typename AddedMass<Scalar>::Params p;
    p.surge_kg = k1 * solid.mass_kg;
    p.sway_kg = p.heave_kg = k2 * solid.mass_kg;
    p.pitch_kg_m2 = p.yaw_kg_m2 = k3 * solid.iyy_kg_m2;
    return p;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
