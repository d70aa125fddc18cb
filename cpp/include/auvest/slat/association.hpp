// Whose echo is it? What an echo would say in a particle, were it that of a master at some place.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/particles/lanes.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The position of a master: mean, and root of its covariance.
template <class Value>
struct Place {
  Vector<Value, 2> x;
  Matrix<Value, 2, 2> root;
};

/// The place of a master whose belief of six states lies in the fields from `from` on
/// (mixture.hpp).
template <class Lanes>
AUVEST_INLINE Place<typename Lanes::Value> load_place(const typename Lanes::Scalar* from) {
  using Value = typename Lanes::Value;
  Place<Value> place;
  Matrix<Value, 2, 2> p;
  Matrix<Value, 1, 2> no_others;
  place.x(0) = Lanes::load(from);
  place.x(1) = Lanes::load(from + kBlock);
  p(0, 0) = Lanes::load(from + 6 * kBlock);
  p(1, 0) = Lanes::load(from + 7 * kBlock);
  p(1, 1) = Lanes::load(from + 8 * kBlock);
  math::factor_leading(p, place.root, no_others);
  return place;
}

template <class Value>
struct Score {
  Value nis;
  Value log_density;
};

/// NIS and density of an echo z of a master at `place`: by S of [SLATF 23], or where the pose has
/// a covariance (`uncertain`, 2.0) by L of [SLATF 65].
template <class Scalar, class Value, int Pose>
AUVEST_INLINE Score<Value> score(const Sonar<Scalar>& sonar, const Vector<Scalar, 2>& z,
                                 const Place<Value>& place, const Belief<Value, Pose>& pose,
                                 bool uncertain) {
  typename Sonar<Scalar>::template View<Value, Pose> view;
  sonar.look(pose.x, place.x(0), place.x(1), z, view);
  Matrix<Value, 2, 2> noise = sonar.template R<Value>();
  if (uncertain) {
    Matrix<Value, Pose, Pose> root;
    Matrix<Value, 1, Pose> no_others;
    Matrix<Value, 2, Pose> by_slave;
    math::factor_leading<math::DropLostPivots>(pose.P, root, no_others);
    project(view.by_slave, root, by_slave);
    Matrix<Value, 2, 2> spread;
    innovation_covariance(by_slave, noise, spread);  // [SLATF 65]
    noise = spread;
    math::ldlt(noise);
  }
  Matrix<Value, 2, 2> by_master;
  project(view.by_master, place.root, by_master);
  Posterior<Value, 2> posterior;
  // [SLATF 23]: S = A A' + R as a product of variances
  const math::Mask<Value> valid = potter(by_master, noise, view.innovation, posterior);
  Score<Value> result;
  result.nis = posterior.nis;
  result.log_density = log_density(valid, posterior, noise);
  return result;
}

/// True where the number `chosen` of a master is n.
template <class Value>
AUVEST_INLINE math::Mask<Value> is_master(const Value& chosen, int n) {
  using Scalar = typename math::ScalarOf<Value>::Type;
  return chosen > Value(Scalar(n) - Scalar(0.5)) && chosen < Value(Scalar(n) + Scalar(0.5));
}

/// The place where an echo z comes from that is heard at `pose`.
template <class Scalar, class Value, int Pose>
AUVEST_INLINE Vector<Value, 2> place_of(const Sonar<Scalar>& sonar, const Vector<Scalar, 2>& z,
                                        const Vector<Value, Pose>& pose) {
  using math::sincos;
  const Scalar range = sonar.params.bearing == Bearing::kMasterToSlave ? -z(0) : z(0);
  Value direction(z(1));
  if (sonar.params.bearing == Bearing::kFromHeading) direction = direction + pose(Pose - 1);
  Value sine, cosine;
  sincos(direction, sine, cosine);
  Vector<Value, 2> place;
  place(0) = pose(0) + range * cosine;
  place(1) = pose(1) + range * sine;
  return place;
}

/// The belief of a master that is born where an echo z comes from, heard at `pose`: the covariance
/// of range and bearing there, for an `uncertain` pose plus the pose's; velocity and acceleration
/// zero with the given variances.
template <class Scalar, class Value, int Pose>
AUVEST_INLINE void give_birth(const Sonar<Scalar>& sonar, const Vector<Scalar, 2>& z,
                              const Belief<Value, Pose>& pose, bool uncertain, Scalar velocity,
                              Scalar acceleration, Belief<Value, 6>& master) {
  using math::sincos;
  const typename Sonar<Scalar>::Params& params = sonar.params;
  const Scalar along = params.sigma_range_m * params.sigma_range_m;
  const Scalar across = z(0) * z(0) * params.sigma_bearing_rad * params.sigma_bearing_rad;
  const Scalar range = params.bearing == Bearing::kMasterToSlave ? -z(0) : z(0);
  Value direction(z(1));
  if (params.bearing == Bearing::kFromHeading) direction = direction + pose.x(Pose - 1);
  Value sine, cosine;
  sincos(direction, sine, cosine);
  math::set_zero(master.x);
  math::set_zero(master.P);
  master.x(0) = pose.x(0) + range * cosine;
  master.x(1) = pose.x(1) + range * sine;
  master.P(0, 0) = along * (cosine * cosine) + across * (sine * sine);
  master.P(1, 0) = (along - across) * (cosine * sine);
  master.P(1, 1) = along * (sine * sine) + across * (cosine * cosine);
  for (int k = 0; k < 2; ++k) {
    for (int l = 0; uncertain && l <= k; ++l) master.P(k, l) = master.P(k, l) + pose.P(k, l);
    master.P(2 + k, 2 + k) = Value(velocity);
    master.P(4 + k, 4 + k) = Value(acceleration);
  }
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
