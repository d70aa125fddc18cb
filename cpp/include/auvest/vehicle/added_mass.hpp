// The water that moves with a hull: M_A, and the Coriolis and centripetal forces of both masses.
//
// A symmetric M has the momenta P = M11 nu1 + M12 nu2 and H = M21 nu1 + M22 nu2 (3 x 3 blocks), and
//
//     C(nu) nu = [-P x nu2; -P x nu1 - H x nu2]          (Fossen 2021, Theorem 3.2)
//
// so nu' C nu = 0 whatever the bits of M. No matrix C is formed.
//
// Munk moment. A slender body that moves obliquely is turned further by its added mass,
// (A22 - A11) u v, and in a real flow held by its own lift and wake. Without a validated damping of
// rotation the hull of `remus100` would be unstable in yaw above 0.316 m/s. By default the pairs
// (5,1), (5,3), (6,1), (6,2) of C_A and their mirrors are left out, as in MSS; `munk` keeps them.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/freedom.hpp"

namespace auvest {

template <class Scalar_>
struct AddedMass {
  using Scalar = Scalar_;

  struct Params {
    Scalar surge_kg = Scalar(0);          ///< A11 = -X_udot
    Scalar sway_kg = Scalar(0);           ///< A22 = -Y_vdot
    Scalar heave_kg = Scalar(0);          ///< A33 = -Z_wdot
    Scalar roll_kg_m2 = Scalar(0);        ///< A44 = -K_pdot
    Scalar pitch_kg_m2 = Scalar(0);       ///< A55 = -M_qdot
    Scalar yaw_kg_m2 = Scalar(0);         ///< A66 = -N_rdot
    Scalar sway_yaw_kg_m = Scalar(0);     ///< A26 = -Y_rdot
    Scalar heave_pitch_kg_m = Scalar(0);  ///< A35 = -Z_qdot
    bool munk = false;                    ///< all of C_A, with the Munk moment

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("surge_kg", surge_kg);
      v("sway_kg", sway_kg);
      v("heave_kg", heave_kg);
      v("roll_kg_m2", roll_kg_m2);
      v("pitch_kg_m2", pitch_kg_m2);
      v("yaw_kg_m2", yaw_kg_m2);
      v("sway_yaw_kg_m", sway_yaw_kg_m);
      v("heave_pitch_kg_m", heave_pitch_kg_m);
      v("munk", munk);
    }
  };

  Params params;

  explicit AddedMass(const Params& p) : params(p) {}

  /// M <- M + M_A.
  AUVEST_OUTLINE void add_to(Matrix<Scalar, 6, 6>& M) const {
    const Scalar diagonal[6] = {params.surge_kg,   params.sway_kg,     params.heave_kg,
                                params.roll_kg_m2, params.pitch_kg_m2, params.yaw_kg_m2};
    // [HULL M2]
    for (int i = 0; i < 6; ++i) M(i, i) = M(i, i) + diagonal[i];
    M(5, 1) = M(1, 5) = M(1, 5) + params.sway_yaw_kg_m;
    M(4, 2) = M(2, 4) = M(2, 4) + params.heave_pitch_kg_m;
  }

  /// tau <- tau - C_A nu, of what is left without the Munk moment.
  template <class Freedom, class Value>
  AUVEST_INLINE void subtract_reduced_coriolis(const Value* nu, Value* tau, Freedom) const {
    if (!Freedom::keeps(kRoll)) return;  // each term has p or is a roll moment
    const Value p = nu[kRoll];
    // [HULL C3]
    if (Freedom::keeps(kHeave)) {
      tau[kSway] = tau[kSway] + Value(params.heave_kg) * nu[kHeave] * p;
      tau[kHeave] = tau[kHeave] - Value(params.sway_kg) * nu[kSway] * p;
    }
    if (Freedom::keeps(kPitch)) {
      tau[kPitch] = tau[kPitch] - Value(params.roll_kg_m2 - params.yaw_kg_m2) * p * nu[kYaw];
      tau[kYaw] = tau[kYaw] - Value(params.pitch_kg_m2 - params.roll_kg_m2) * p * nu[kPitch];
    }
  }

  /// Finite. (What it may be in sign, the mass matrix says: it must be positive definite.)
  Status check() const {
    Params copy = params;
    Finite finite = {true};
    copy.visit(finite);
    return finite.all ? Status::kOk : Status::kBadParameter;
  }

 private:
  struct Finite {
    bool all;
    void operator()(const char*, const Scalar& value) { all = all && math::is_finite(value); }
    void operator()(const char*, const bool&) {}
  };
};

/// sum_j row[j] v[j] over the axes that a projection keeps, in the order of j. Coefficients that
/// are 0, as most are in a hull with planes of symmetry, cost no arithmetic.
template <class Freedom, class Scalar, class Value>
AUVEST_INLINE Value row_times(const Scalar* row, const Value* v, Freedom) {
  Value sum = Value(0);
  AUVEST_UNROLL
  for (int j = 0; j < 6; ++j) {
    if (Freedom::keeps(j) && row[j] != Scalar(0)) sum = sum + Value(row[j]) * v[j];
  }
  return sum;
}

/// tau <- tau - C(nu) nu for a symmetric M; `nu` has 0 where a projection drops the axis.
template <class Freedom, class Scalar, class Value>
AUVEST_OUTLINE void subtract_coriolis(const Matrix<Scalar, 6, 6>& M, const Value* nu, Value* tau,
                                      Freedom freedom) {
  // A hull that only yaws meets P in x and y, and no H.
  const bool tilts = Freedom::keeps(kRoll) || Freedom::keeps(kPitch);
  const int rows = tilts ? 6 : 2;
  Value momentum[6];  // P, H
  AUVEST_UNROLL
  for (int i = 0; i < rows; ++i) momentum[i] = row_times(&M(i, 0), nu, freedom);  // [HULL C1]
  const Value* const P = momentum;
  const Value* const H = momentum + 3;
  AUVEST_UNROLL
  for (int i = 0; i < 3; ++i) {
    const int j = i < 2 ? i + 1 : 0;
    const int k = i > 0 ? i - 1 : 2;
    // [HULL C2]
    if (Freedom::keeps(i)) {
      if (Freedom::keeps(3 + k)) tau[i] = tau[i] + P[j] * nu[3 + k];
      if (Freedom::keeps(3 + j)) tau[i] = tau[i] - P[k] * nu[3 + j];
    }
    if (Freedom::keeps(3 + i)) {
      if (Freedom::keeps(k)) tau[3 + i] = tau[3 + i] + P[j] * nu[k];
      if (Freedom::keeps(j)) tau[3 + i] = tau[3 + i] - P[k] * nu[j];
      if (Freedom::keeps(3 + k)) tau[3 + i] = tau[3 + i] + H[j] * nu[3 + k];
      if (Freedom::keeps(3 + j)) tau[3 + i] = tau[3 + i] - H[k] * nu[3 + j];
    }
  }
}

}  // namespace auvest
