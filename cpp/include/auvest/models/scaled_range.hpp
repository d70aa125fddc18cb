// Range to a leader or a beacon of known position whose instrument is off by a scale (speed of
// sound) or an offset (delay of an antenna) that are constants among the states
// (odometry_constants.hpp).
//
//     z = (1 + s) |(x, y) - leader| + o + e,   var e as of leader_range.hpp
//
// Which states s and o are the parameters say, by their places; 0: none. So each beacon may have an
// offset of its own.
//
// While little is known of a constant, a range that is an outlier looks like an error of that
// constant; no kernel sees it, and a constant that was learnt from it locks all others out. So the
// EKF gives a range less weight than it has, as Lear (1985) did where much is uncertain: what the
// constants' uncertainty makes of the range counts as noise, too, and one range at most halves
// their variance. Once they are known that is nothing.
#pragma once

#include "auvest/models/leader_range.hpp"
#include "auvest/models/odometry_constants.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Whatever the number of states.
template <class Scalar>
struct ScaledRangeParams : LeaderRangeParams<Scalar> {
  Scalar scale_state = Scalar(0);   ///< place of s
  Scalar offset_state = Scalar(0);  ///< place of o [m]

  /// Names every member, in the order of stored records.
  template <class Visitor>
  void visit(Visitor&& v) {
    LeaderRangeParams<Scalar>::visit(v);
    v("scale_state", scale_state);
    v("offset_state", offset_state);
  }
};

template <class Scalar_, int N>
struct ScaledRange : MeasurementModel<ScaledRange<Scalar_, N>, Scalar_, N, 1> {
  using Base = MeasurementModel<ScaledRange<Scalar_, N>, Scalar_, N, 1>;
  using Scalar = Scalar_;
  using typename Base::Jacobian;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::State;
  using True = LeaderRange<Scalar, N>;
  static constexpr int kPlace = True::kPlace;

  using Params = ScaledRangeParams<Scalar>;

  Params params;

  explicit ScaledRange(const Params& p = Params()) : params(p) {}

  /// Moves the leader to (p[0], p[1]) [m].
  void place(const Scalar* p) {
    params.leader_x_m = p[0];
    params.leader_y_m = p[1];
  }

  /// The range without noise.
  Measurement h(const State& x) const {
    Measurement range = seen(x).centre;
    range(0) = factor(x) * range(0) + (offset() > 0 ? x(offset()) : Scalar(0));
    return range;
  }

  Jacobian H(const State& x) const {
    const typename True::Expansion point = seen(x);
    Jacobian jacobian;
    math::set_zero(jacobian);
    jacobian(0, 0) = factor(x) * point.ux;
    jacobian(0, 1) = factor(x) * point.uy;
    if (scale() > 0) jacobian(0, scale()) = point.range;
    if (offset() > 0) jacobian(0, offset()) = Scalar(1);
    return jacobian;
  }

  Noise R() const { return True(params).R(); }

  Status admits(const Measurement& z) const { return params.admits(z(0)); }

  /// As of leader_range.hpp; and what is not known of the constants counts as noise once more.
  template <class Point>
  void second_order(const Point& point, const Matrix<Scalar, N, N>& root, Measurement& innovation,
                    Noise& noise) const {
    const typename True::Expansion exact = seen(point.x);
    Matrix<Scalar, 2, 2> of_position;
    math::set_zero(of_position);
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j <= i; ++j) of_position(i, j) = root(i, j);
    }
    True(params).second_order(exact, of_position, innovation, noise);
    Scalar variance = Scalar(0);
    for (int k = 0; k < N; ++k) {
      Scalar part = Scalar(0);
      if (scale() >= k && scale() > 0) part = part + exact.range * root(scale(), k);
      if (offset() >= k && offset() > 0) part = part + root(offset(), k);
      variance = variance + part * part;
    }
    noise(0, 0) = noise(0, 0) + variance;
  }

  Status check() const {
    const bool valid = is_constant<N>(params.scale_state) && is_constant<N>(params.offset_state);
    return valid ? True(params).check() : Status::kBadParameter;
  }

 private:
  int scale() const { return place_of<N>(params.scale_state); }
  int offset() const { return place_of<N>(params.offset_state); }

  Scalar factor(const State& x) const { return scale() > 0 ? Scalar(1) + x(scale()) : Scalar(1); }

  typename True::Expansion seen(const State& x) const { return True(params).about(x); }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
