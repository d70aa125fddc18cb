// The slave's sonar, [SLATF 5] and [SLATF 6]: range and bearing between slave and master.
//
//     r = |S - M| + dr,   theta = atan2(y_S - y_M, x_S - x_M) + dtheta
//
// The paper's bearing points from the master to the slave and is absolute. The other readings that
// are met in practice are options. Differs from [SLATF 5]: atan2 where the paper prints arctan, and
// the innovation is wrapped.
#pragma once

#include <cstdint>

#include "auvest/math/angle.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/range_limits.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

enum class Bearing : std::uint8_t {
  kMasterToSlave,  ///< from the x axis, from the master to the slave: the paper's
  kSlaveToMaster,  ///< from the x axis, from the slave to the master
  kFromHeading     ///< from the slave's heading to the master; the heading must be a state
};

template <class Scalar_>
struct Sonar {
  using Scalar = Scalar_;

  struct Params : RangeLimits<Scalar> {
    Scalar sigma_range_m = Scalar(1);         ///< of dr, > 1e-6; section 7: 0.3 to 15
    Scalar sigma_bearing_rad = Scalar(0.06);  ///< of dtheta, > 1e-6; section 7: 0.015 to 0.4
    Bearing bearing = Bearing::kMasterToSlave;
  };

  Params params;

  explicit Sonar(const Params& p = Params()) : params(p) {}

  /// A measurement z about given places of slave and master, linearised in both.
  template <class Value, int Pose>
  struct View {
    Vector<Value, 2> innovation;      ///< V of [SLATF 22], wrapped
    Matrix<Value, 2, 2> by_master;    ///< G_M with respect to the master's position
    Matrix<Value, 2, Pose> by_slave;  ///< G_S of [SLATF 51]
  };

  template <class Value, int Pose>
  AUVEST_INLINE void look(const Vector<Value, Pose>& slave, const Value& master_x,
                          const Value& master_y, const Vector<Scalar, 2>& z,
                          View<Value, Pose>& view) const {
    using math::atan2;
    using math::larger;
    using math::sqrt;
    using math::wrap;
    const Value dx = master_x - slave(0);
    const Value dy = master_y - slave(1);
    // [SLATF 5] [SLATF 18]: z^ = g(slave, master)
    const Value square = larger(dx * dx + dy * dy, Value(1e-20));  // at one place: finite
    const Value range = sqrt(square);
    const Value inverse = Value(1) / range;
    const Value inverse_square = Value(1) / square;
    const Scalar sign = Scalar(params.bearing == Bearing::kMasterToSlave ? -1 : 1);
    Value bearing = atan2(Value(sign * dy), Value(sign * dx));
    if (Pose > 2 && params.bearing == Bearing::kFromHeading) bearing = bearing - slave(Pose - 1);
    view.innovation(0) = z(0) - range;  // [SLATF 22]
    view.innovation(1) = wrap(Value(z(1) - bearing));
    view.by_master(0, 0) = dx * inverse;  // [SLATF 20]
    view.by_master(0, 1) = dy * inverse;
    view.by_master(1, 0) = -(dy * inverse_square);
    view.by_master(1, 1) = dx * inverse_square;
    AUVEST_UNROLL
    for (int i = 0; i < 2; ++i) {
      AUVEST_UNROLL
      for (int j = 0; j < 2; ++j) view.by_slave(i, j) = -view.by_master(i, j);  // [SLATF 51]
      if (Pose > 2) view.by_slave(i, Pose - 1) = Value(0);
    }
    if (Pose > 2 && params.bearing == Bearing::kFromHeading) {
      view.by_slave(1, Pose - 1) = Value(-1);
    }
  }

  template <class Value>
  AUVEST_INLINE Matrix<Value, 2, 2> R() const {
    Matrix<Value, 2, 2> noise;
    // [SLATF 6]
    noise(0, 0) = Value(params.sigma_range_m * params.sigma_range_m);
    noise(1, 0) = noise(0, 1) = Value(0);
    noise(1, 1) = Value(params.sigma_bearing_rad * params.sigma_bearing_rad);
    return noise;
  }

  /// kBadParameter also where the bearing needs a heading that a pose of `pose_states` has not.
  Status check(int pose_states) const {
    const bool valid =
        params.RangeLimits<Scalar>::valid() && math::is_finite(params.sigma_range_m) &&
        params.sigma_range_m > Scalar(1e-6) && math::is_finite(params.sigma_bearing_rad) &&
        params.sigma_bearing_rad > Scalar(1e-6) &&
        (params.bearing != Bearing::kFromHeading || pose_states > 2);
    return valid ? Status::kOk : Status::kBadParameter;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
