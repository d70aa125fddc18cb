// From the force that a controller wants to thrusts: the weighted pseudo-inverse (Fossen 2021,
// 11.2.2), and what happens where a thruster cannot give its share.
//
//     f = B tau,   B = W^-1 T' (T W^-1 T')^-1
//
// B is computed once, on the desk or at the start; 6 x 8 floats are 192 bytes. A demand that is out
// of reach is not clipped thruster by thruster, which would turn it: the axes are served by
// priority (by default attitude, then heave, then surge and sway), and of the first level that does
// not fit and of those behind it, as much as there is room for, without change of direction.
#pragma once

#include <cstdint>
#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/freedom.hpp"
#include "auvest/vehicle/lag.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace detail {

/// An axis that depends on those before it is given up: its demand counts for nothing.
struct DropDependentAxes {
  template <class Value>
  static Value keep(const Value& pivot, const Value& floor, Value& inverse) {
    return math::DropLostPivots::keep(pivot, Value(Value(64) * floor), inverse);
  }
};

}  // namespace detail

/// B of the thrust matrix T, with the inverse weight of each thruster (0: it is not used).
template <class Scalar, int Count>
Matrix<Scalar, Count, 6> pseudo_inverse(const Matrix<Scalar, 6, Count>& T,
                                        const Vector<Scalar, Count>& inverse_weights) {
  Matrix<Scalar, 6, 6> l;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      l(i, j) = Scalar(0);
      for (int k = 0; k < Count; ++k) l(i, j) = l(i, j) + T(i, k) * inverse_weights(k) * T(j, k);
    }
  }
  Vector<Scalar, 6> pivots;
  const Scalar any_size(std::numeric_limits<Scalar>::lowest());
  math::ldlt<detail::DropDependentAxes>(l.data(), 6, any_size, pivots.data());
  Matrix<Scalar, Count, 6> B;
  for (int column = 0; column < 6; ++column) {
    Vector<Scalar, 6> y;
    for (int i = 0; i < 6; ++i) {
      y(i) = Scalar(i == column ? 1 : 0);
      for (int k = 0; k < i; ++k) y(i) = y(i) - l(i, k) * y(k);
    }
    for (int i = 5; i >= 0; --i) {
      y(i) = y(i) * pivots(i);
      for (int k = i + 1; k < 6; ++k) y(i) = y(i) - l(k, i) * y(k);
    }
    for (int k = 0; k < Count; ++k) {
      Scalar sum = Scalar(0);
      for (int i = 0; i < 6; ++i) sum = sum + T(i, k) * y(i);
      B(k, column) = inverse_weights(k) * sum;  // [HULL A2]
    }
  }
  return B;
}

template <class Scalar_, int Count>
class Allocation {
 public:
  using Scalar = Scalar_;
  using Force = Vector<Scalar, 6>;
  using Thrust = Vector<Scalar, Count>;
  using Inverse = Matrix<Scalar, Count, 6>;
  static constexpr int kLevels = 6;

  struct Params {
    Scalar lowest_n = Scalar(0);   ///< thrust that each thruster reaches astern, < 0
    Scalar highest_n = Scalar(0);  ///< and ahead
    /// Per axis, 0 first; axes of one level share one scale.
    std::uint8_t priority[6] = {2, 2, 1, 0, 0, 0};

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("lowest_n", lowest_n);
      v("highest_n", highest_n);
      v("surge_priority", priority[0]);
      v("sway_priority", priority[1]);
      v("heave_priority", priority[2]);
      v("roll_priority", priority[3]);
      v("pitch_priority", priority[4]);
      v("yaw_priority", priority[5]);
    }
  };

  struct Result {
    Thrust thrust;          ///< f [N], within the limits
    Scalar scale[kLevels];  ///< what was given of each level, 0 to 1; 1 of those without demand
    bool saturated;         ///< the demand was out of reach: a controller holds its integrals
  };

  Params params;

  Allocation(const Inverse& B, const Params& p) : params(p) { math::copy(B, inverse_); }

  const Inverse& inverse() const { return inverse_; }

  Result allocate(const Force& demand) const {
    Result result;
    math::set_zero(result.thrust);
    result.saturated = false;
    for (std::uint8_t level = 0; level < kLevels; ++level) {
      result.scale[level] = Scalar(1);
      if (!serves(level)) continue;
      Thrust share;
      math::set_zero(share);
      for (int i = 0; i < Count; ++i) {
        for (int j = 0; j < 6; ++j) {
          if (params.priority[j] == level) share(i) = share(i) + inverse_(i, j) * demand(j);
        }
      }
      Scalar scale = Scalar(1);
      for (int i = 0; i < Count; ++i) {
        const Scalar limit = share(i) > Scalar(0) ? params.highest_n : params.lowest_n;
        const Scalar room = limit - result.thrust(i);
        const bool beyond = math::absolute(share(i)) * scale > math::absolute(room);
        if (beyond) scale = room / share(i);
      }
      result.saturated = result.saturated || scale < Scalar(1);
      result.scale[level] = scale;
      for (int i = 0; i < Count; ++i) {
        const Scalar sum = result.thrust(i) + scale * share(i);  // [HULL A3]
        result.thrust(i) = clamp_to(sum, params.lowest_n, params.highest_n);
      }
    }
    return result;
  }

  Status check() const {
    bool valid = math::is_positive(params.highest_n) && math::is_positive(-params.lowest_n) &&
                 math::all_finite(inverse_);
    for (const std::uint8_t level : params.priority) valid = valid && level < kLevels;
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// True if an axis is of this level.
  bool serves(std::uint8_t level) const {
    for (const std::uint8_t own : params.priority) {
      if (own == level) return true;
    }
    return false;
  }

  Inverse inverse_;
};

/// The allocation of a vehicle with thrusters: equal weights, the limits of their curve.
template <class Thrusters>
Allocation<typename Thrusters::Scalar, Thrusters::kCount> allocation_of(
    const Thrusters& thrusters) {
  using Scalar = typename Thrusters::Scalar;
  using Result = Allocation<Scalar, Thrusters::kCount>;
  typename Result::Params params;
  params.lowest_n = thrusters.curve.lowest();
  params.highest_n = thrusters.curve.highest();
  Vector<Scalar, Thrusters::kCount> equal;
  for (int i = 0; i < Thrusters::kCount; ++i) equal(i) = Scalar(1);
  return Result(pseudo_inverse(thrusters.matrix(), equal), params);
}

/// Redistribution: thrusters that would exceed a limit are held there, and the others give the rest
/// if they can. True if T f = tau within the limits was found so; otherwise f is of no use, and the
/// scaled allocation is what remains. A matrix is factored per pass: for the desk.
template <class Scalar, int Count>
bool redistribute(const Matrix<Scalar, 6, Count>& T, const Vector<Scalar, 6>& demand, Scalar lowest,
                  Scalar highest, Vector<Scalar, Count>& f) {
  Vector<Scalar, Count> free;
  for (int i = 0; i < Count; ++i) {
    free(i) = Scalar(1);
    f(i) = Scalar(0);
  }
  Scalar size = Scalar(0);
  for (int i = 0; i < 6; ++i) size = size + math::absolute(demand(i));
  for (int pass = 0; pass < Count; ++pass) {
    Vector<Scalar, 6> rest;  // what the held ones do not give
    for (int i = 0; i < 6; ++i) {
      rest(i) = demand(i);
      for (int k = 0; k < Count; ++k) {
        if (free(k) == Scalar(0)) rest(i) = rest(i) - T(i, k) * f(k);
      }
    }
    const Matrix<Scalar, Count, 6> B = pseudo_inverse(T, free);
    bool held = false;
    for (int k = 0; k < Count; ++k) {
      if (free(k) == Scalar(0)) continue;
      Scalar wanted = Scalar(0);
      for (int j = 0; j < 6; ++j) wanted = wanted + B(k, j) * rest(j);
      f(k) = clamp_to(wanted, lowest, highest);  // [HULL A4]
      if (f(k) != wanted) {
        free(k) = Scalar(0);
        held = true;
      }
    }
    if (held) continue;
    for (int i = 0; i < 6; ++i) {
      Scalar error = demand(i);
      for (int k = 0; k < Count; ++k) error = error - T(i, k) * f(k);
      if (!(math::absolute(error) <= Scalar(256) * math::machine_epsilon<Scalar>() * size)) {
        return false;
      }
    }
    return true;
  }
  return false;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
