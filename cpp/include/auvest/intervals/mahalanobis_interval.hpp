// The interval law of the AUKF paper (Deng, Yin, Duan 2019), [AUKF 7] to [AUKF 12].
//
// Order inside one step: measurement update, M(k), T(k) with the tau in hand, d(k), tau(k+1). T(k)
// is the interval to the next sample; read literally, [AUKF 7] and [AUKF 8] are circular. What the
// law can and cannot do: docs/algorithms/aukf.md.
#pragma once

#include "auvest/intervals/interval_limits.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct MahalanobisInterval {
  using Scalar = Scalar_;
  using Position = Vector<Scalar, 2>;

  /// The defaults are the preset figure3.
  struct Params : IntervalLimits<Scalar> {
    Scalar tau0 = Scalar(0.5);        ///< tau(0), in (0, 1); the paper studies 0.1, 0.3, 0.5, 0.9
    Scalar scale = Scalar(0.1);       ///< phi of [AUKF 8], Table 1
    Scalar epsilon = Scalar(1.6);     ///< eps of [AUKF 12], Table 1
    Scalar gamma1_m2 = Scalar(1e-4);  ///< gamma1 of [AUKF 7] [m^2]
    Scalar gamma2 = Scalar(1);        ///< gamma2 of [AUKF 12]
    Scalar ratio_max = Scalar(0.9);   ///< upper end of M(k): the text says 0 < M < 0.9
    Scalar tau_min = Scalar(0.01);    ///< the text says tau in (0, 1): clamped to
    Scalar tau_max = Scalar(0.99);    ///< [tau_min, tau_max]

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      v("initial_s", this->initial_s);
      v("min_s", this->min_s);
      v("max_s", this->max_s);
      v("tau0", tau0);
      v("scale", scale);
      v("epsilon", epsilon);
      v("gamma1_m2", gamma1_m2);
      v("gamma2", gamma2);
      v("ratio_max", ratio_max);
      v("tau_min", tau_min);
      v("tau_max", tau_max);
    }

    /// gamma1 and gamma2 with which the law does what the paper's Fig. 3 shows.
    static Params figure3() { return Params(); }

    /// Table 1 to the letter: gamma1 = 10, gamma2 = 100. Contradicts Fig. 3: T falls to T_min.
    static Params table1() {
      Params p;
      p.gamma1_m2 = Scalar(10);
      p.gamma2 = Scalar(100);
      p.min_s = Scalar(0.01);
      return p;
    }
  };

  /// What the law carries from step to step; plain data, to be saved and restored as it is.
  struct Memory {
    Scalar tau;                  ///< tau(k+1)
    Scalar interval;             ///< T(k) [s]
    Scalar ratio;                ///< M(k)
    Scalar mahalanobis_squared;  ///< d(k)^2
    Position last_estimate;      ///< X(k) [m]
    Position last_reference;     ///< R(k) [m]
  };

  Params params;
  Memory memory;

  explicit MahalanobisInterval(const Params& p = defaults()) : params(p) {
    Position origin;
    origin(0) = origin(1) = Scalar(0);
    restart(origin, origin);
  }

  Scalar initial() const { return params.initial_s; }

  AUVEST_OUTLINE void restart(const Position& estimate, const Position& reference) {
    memory.tau = params.tau0;
    memory.interval = params.initial_s;
    memory.ratio = memory.mahalanobis_squared = Scalar(0);
    math::copy(estimate, memory.last_estimate);
    math::copy(reference, memory.last_reference);
  }

  template <class Filter>
  AUVEST_OUTLINE_HOT Scalar next(const Filter& filter, const Position& reference) {
    Memory& m = memory;
    Steps steps;  // [AUKF 9]
    for (int i = 0; i < 2; ++i) {
      const Scalar error = m.last_estimate(i) - m.last_reference(i);
      steps[0][i] = step(m.last_estimate(i), coordinate(filter.x(), i));
      steps[1][i] = step(m.last_reference(i), reference(i));
      steps[2][i] = (m.last_estimate(i) - m.last_reference(i)) + error;
    }
    const Scalar aa = dot(steps[0], steps[0]);
    const Scalar bb = dot(steps[1], steps[1]);
    m.ratio = clamp(bb / (aa + params.gamma1_m2), Scalar(0), params.ratio_max);  // [AUKF 7]
    // [AUKF 8]
    m.interval =
        clamp((Scalar(1) - m.tau) * params.scale * m.interval + m.tau * m.ratio * params.max_s,
              params.min_s, params.max_s);
    m.mahalanobis_squared = squared_distance(steps, aa, bb);
    // [AUKF 12]: tau(k+1)
    m.tau = clamp(params.epsilon / (m.mahalanobis_squared + params.gamma2), params.tau_min,
                  params.tau_max);
    return m.interval;
  }

  /// Parameters, and a memory that the law may have: one that is restored may be damaged.
  Status check() const {
    const Params& p = params;
    const Memory& m = memory;
    const Scalar one = Scalar(1);
    const bool legal = math::is_positive(m.tau) && m.tau < one && math::is_positive(m.interval) &&
                       math::within(m.ratio, Scalar(0), one) &&
                       math::is_nonnegative(m.mahalanobis_squared) &&
                       math::all_finite(m.last_estimate) && math::all_finite(m.last_reference);
    const bool valid = legal && p.valid() && math::is_positive(p.tau_min) &&
                       math::within(p.tau0, p.tau_min, p.tau_max) && p.tau_max < one &&
                       math::within(p.scale, Scalar(0), one) && math::is_positive(p.epsilon) &&
                       math::is_positive(p.gamma1_m2) && math::is_positive(p.gamma2) &&
                       math::is_positive(p.ratio_max) && !(p.ratio_max > one);
    return valid ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// x or y; of a state of one number, that number.
  template <int N>
  static Scalar coordinate(const Vector<Scalar, N>& x, int i) {
    return x(i < N ? i : 0);
  }

  /// Params() as a constant to copy: on a chip, half the flash of assignments.
  static const Params& defaults() {
    static const Params params;
    return params;
  }

  /// Not a number counts as low.
  AUVEST_OUTLINE static Scalar clamp(Scalar value, Scalar low, Scalar high) {
    if (!(value > low)) return low;
    return value > high ? high : value;
  }

  /// The four points of [AUKF 9], X(k), R(k), X(k-1) and R(k-1), without their mean:
  ///     a = X(k) - X(k-1)                      its length is d_e of [AUKF 7]
  ///     b = R(k) - R(k-1)                      its length is d_t
  ///     c = X(k) + X(k-1) - R(k) - R(k-1)
  using Steps = Scalar[3][2];

  /// Moves `last` to `now`, and says by how much.
  static Scalar step(Scalar& last, Scalar now) {
    const Scalar change = now - last;
    last = now;
    return change;
  }

  static Scalar dot(const Scalar* u, const Scalar* v) { return math::dot(u, v, 2); }

  /// Squared Mahalanobis distance of the estimate from the four points, [AUKF 9] to [AUKF 11].
  ///
  /// We read the print's (d)_2 as d^2 and take the divisor N - 1 = 3 for cov. The mean of the four
  /// points drops out of a / sqrt 2, b / sqrt 2 and c / 2, which are orthogonal contrasts of them:
  /// 3 S = (a a' + b b') / 2 + c c' / 4, and X(k) - mean = a / 2 + c / 4. By Cauchy and Binet
  ///
  ///     d^2 = v' S^-1 v = 3/4 (3 (a x c)^2 + (2 a x b - b x c)^2)
  ///                           / (2 (a x b)^2 + (a x c)^2 + (b x c)^2),
  ///
  /// sums of squares, in which nothing cancels. S is singular when the points are collinear, as at
  /// the start, where X(0) = R(0), and on noise-free straight legs: epsilon times its trace is
  /// added to its diagonal, which gives the pseudo-inverse's distance along the line there. It is
  /// felt where the points are closer to a line than some sqrt(epsilon) of their spread (1e-3 in
  /// float), and nowhere else. If all four points coincide (or the squares of their distances
  /// under- or overflow), d^2 = 0.
  static Scalar squared_distance(Steps& steps, Scalar aa, Scalar bb) {
    using math::cross;
    const Scalar two = Scalar(2);
    Scalar* const a = steps[0];
    Scalar* const b = steps[1];
    Scalar* const c = steps[2];
    Scalar trace = two * (aa + bb) + dot(c, c);  // of 12 S
    // d^2 does not change with the unit of length: take one in which fourth powers fit.
    if (!(trace > Scalar(1e-8) && trace < Scalar(1e8))) {
      if (!math::is_positive(trace)) return Scalar(0);
      const Scalar unit = Scalar(1) / math::sqrt(trace);
      for (auto& step : steps) {
        for (Scalar& component : step) component = component * unit;
      }
      trace = Scalar(1);
    }
    const Scalar ab = two * cross(a, b);
    const Scalar by_c[2] = {cross(a, c), cross(b, c)};
    const Scalar sine = ab - by_c[1];
    math::add_scaled(two, a, c, 2);  // [AUKF 10]: 4 (X(k) - mean)
    const Scalar ridge = Scalar(0.5) * math::machine_epsilon<Scalar>() * trace;
    const Scalar form = (Scalar(3) * (by_c[0] * by_c[0]) + sine * sine) + ridge * dot(c, c);
    // [AUKF 10]: 72 det S
    const Scalar determinant = (Scalar(0.5) * (ab * ab) + dot(by_c, by_c)) + ridge * trace;
    return Scalar(0.75) * (form / determinant);  // [AUKF 11]
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
