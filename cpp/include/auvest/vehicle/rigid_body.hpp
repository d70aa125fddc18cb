// The mass of a rigid body: M_RB about the origin of the body's frame.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct RigidBody {
  using Scalar = Scalar_;

  struct Params {
    Scalar mass_kg = Scalar(0);    ///< m
    Scalar ixx_kg_m2 = Scalar(0);  ///< I_x about the centre of gravity
    Scalar iyy_kg_m2 = Scalar(0);  ///< I_y about the centre of gravity
    Scalar izz_kg_m2 = Scalar(0);  ///< I_z about the centre of gravity
    Scalar xg_m = Scalar(0);       ///< r_g, the centre of gravity: forward
    Scalar yg_m = Scalar(0);       ///< to starboard
    Scalar zg_m = Scalar(0);       ///< down

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("mass_kg", mass_kg);
      v("ixx_kg_m2", ixx_kg_m2);
      v("iyy_kg_m2", iyy_kg_m2);
      v("izz_kg_m2", izz_kg_m2);
      v("xg_m", xg_m);
      v("yg_m", yg_m);
      v("zg_m", zg_m);
    }
  };

  Params params;

  explicit RigidBody(const Params& p) : params(p) {}

  /// M <- M + M_RB.
  AUVEST_OUTLINE void add_to(Matrix<Scalar, 6, 6>& M) const {
    const Scalar m = params.mass_kg;
    const Scalar x = params.xg_m, y = params.yg_m, z = params.zg_m;
    const Scalar mx = m * x, my = m * y, mz = m * z;
    // [HULL M1]: [m I, -m S(r); m S(r), I_g - m S(r)^2]
    for (int i = 0; i < 3; ++i) M(i, i) = M(i, i) + m;
    M(3, 3) = M(3, 3) + (params.ixx_kg_m2 + (my * y + mz * z));
    M(4, 4) = M(4, 4) + (params.iyy_kg_m2 + (mx * x + mz * z));
    M(5, 5) = M(5, 5) + (params.izz_kg_m2 + (mx * x + my * y));
    add_pair(M, 4, 3, -(mx * y));
    add_pair(M, 5, 3, -(mx * z));
    add_pair(M, 5, 4, -(my * z));
    add_pair(M, 4, 0, mz);
    add_pair(M, 5, 0, -my);
    add_pair(M, 3, 1, -mz);
    add_pair(M, 5, 1, mx);
    add_pair(M, 3, 2, my);
    add_pair(M, 4, 2, -mx);
  }

  Status check() const {
    const bool valid = math::is_positive(params.mass_kg) && math::is_positive(params.ixx_kg_m2) &&
                       math::is_positive(params.iyy_kg_m2) && math::is_positive(params.izz_kg_m2) &&
                       math::is_finite(params.xg_m) && math::is_finite(params.yg_m) &&
                       math::is_finite(params.zg_m);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  static void add_pair(Matrix<Scalar, 6, 6>& M, int i, int j, Scalar value) {
    M(i, j) = M(j, i) = M(i, j) + value;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
