// The interval law of the AUKF paper (Deng, Yin, Duan 2019), Eqs. (7) to (12).
//
// Order inside one step: measurement update, M(k) by Eq. (7), T(k) by Eq. (8) with the tau in hand,
// d(k) by Eqs. (9) to (11), tau(k+1) by Eq. (12). T(k) is the interval to the next sample; read
// literally, (7) and (8) are circular. What the law can and cannot do: docs/algorithms/aukf.md.
#pragma once

#include "auvest/intervals/interval_limits.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Scalar_>
struct MahalanobisInterval {
  using Scalar = Scalar_;
  using Position = Vector<Scalar, 2>;

  /// The defaults are the preset figure3.
  struct Params : IntervalLimits<Scalar> {
    Scalar tau0 = Scalar(0.5);        ///< tau(0), in (0, 1); the paper studies 0.1, 0.3, 0.5, 0.9
    Scalar scale = Scalar(0.1);       ///< phi of Eq. (8), Table 1
    Scalar epsilon = Scalar(1.6);     ///< eps of Eq. (12), Table 1
    Scalar gamma1_m2 = Scalar(1e-4);  ///< gamma1 of Eq. (7) [m^2]
    Scalar gamma2 = Scalar(1);        ///< gamma2 of Eq. (12)
    Scalar ratio_max = Scalar(0.9);   ///< upper end of M(k): the text says 0 < M < 0.9
    Scalar tau_min = Scalar(0.01);    ///< the text says tau in (0, 1): clamped to
    Scalar tau_max = Scalar(0.99);    ///< [tau_min, tau_max]

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

  explicit MahalanobisInterval(const Params& p = Params()) : params(p) {
    Position origin;
    origin(0) = origin(1) = Scalar(0);
    restart(origin, origin);
  }

  Scalar initial() const { return params.initial_s; }

  void restart(const Position& estimate, const Position& reference) {
    memory.tau = params.tau0;
    memory.interval = params.initial_s;
    memory.ratio = memory.mahalanobis_squared = Scalar(0);
    memory.last_estimate = estimate;
    memory.last_reference = reference;
  }

  template <class Filter>
  Scalar next(const Filter& filter, const Position& reference) {
    Position estimate;
    estimate(0) = filter.x()(0);
    estimate(1) = filter.x()(1);

    Memory& m = memory;
    m.ratio = trajectory_ratio(estimate, reference);
    m.interval =
        clamp((Scalar(1) - m.tau) * params.scale * m.interval + m.tau * m.ratio * params.max_s,
              params.min_s, params.max_s);  // Eq. (8)
    m.mahalanobis_squared = squared_distance(estimate, reference);
    m.tau = clamp(params.epsilon / (m.mahalanobis_squared + params.gamma2), params.tau_min,
                  params.tau_max);  // Eq. (12), for tau(k+1)
    m.last_estimate = estimate;
    m.last_reference = reference;
    return m.interval;
  }

  Status check() const {
    const Params& p = params;
    const bool finite = math::is_finite(p.tau0) && math::is_finite(p.scale) &&
                        math::is_finite(p.epsilon) && math::is_finite(p.gamma1_m2) &&
                        math::is_finite(p.gamma2) && math::is_finite(p.ratio_max);
    const bool tau = p.tau_min > Scalar(0) && p.tau0 >= p.tau_min && p.tau_max >= p.tau0 &&
                     p.tau_max < Scalar(1);
    const bool law = !(p.scale < Scalar(0)) && !(p.scale > Scalar(1)) && p.epsilon > Scalar(0) &&
                     p.gamma1_m2 > Scalar(0) && p.gamma2 > Scalar(0) && p.ratio_max > Scalar(0) &&
                     !(p.ratio_max > Scalar(1));
    return finite && p.valid() && tau && law ? Status::kOk : Status::kBadParameter;
  }

 private:
  /// Not a number counts as low.
  static Scalar clamp(Scalar value, Scalar low, Scalar high) {
    if (!(value > low)) return low;
    return value > high ? high : value;
  }

  /// Eq. (7): M(k) = d_t^2 / (d_e^2 + gamma1), at most ratio_max.
  Scalar trajectory_ratio(const Position& estimate, const Position& reference) const {
    Scalar desired = Scalar(0);
    Scalar estimated = Scalar(0);
    for (int i = 0; i < 2; ++i) {
      const Scalar d_t = reference(i) - memory.last_reference(i);
      const Scalar d_e = estimate(i) - memory.last_estimate(i);
      desired = desired + d_t * d_t;
      estimated = estimated + d_e * d_e;
    }
    return clamp(desired / (estimated + params.gamma1_m2), Scalar(0), params.ratio_max);
  }

  /// Eqs. (9) to (11): squared Mahalanobis distance of the estimate from the four points.
  ///
  /// We read the print's (d)_2 as d^2 and take the divisor N - 1 = 3 for cov. With v_i the points
  /// about their mean, S = sum v_i v_i' / 3, and by Cauchy and Binet
  ///
  ///     d^2 = v' S^-1 v = 3 sum_i (v x v_i)^2 / sum_(i<j) (v_i x v_j)^2,
  ///
  /// sums of squares, in which nothing cancels. S is singular when the points are collinear, as at
  /// the start, where X(0) = R(0), and on noise-free straight legs: epsilon times its trace is
  /// added to its diagonal, which gives the pseudo-inverse's distance along the line there. It is
  /// felt where the points are closer to a line than some sqrt(epsilon) of their spread (1e-3 in
  /// float), and nowhere else. If all four points coincide (or overflow), d^2 = 0.
  Scalar squared_distance(const Position& estimate, const Position& reference) const {
    const Position* points[4] = {&estimate, &reference, &memory.last_estimate,
                                 &memory.last_reference};  // Eq. (9)
    Scalar v[4][2];
    Scalar largest = Scalar(0);
    for (int axis = 0; axis < 2; ++axis) {
      const Scalar quarter = Scalar(0.25);
      const Scalar mean =
          (quarter * (*points[0])(axis) + quarter * (*points[1])(axis)) +
          (quarter * (*points[2])(axis) + quarter * (*points[3])(axis));  // Eq. (10)
      for (int i = 0; i < 4; ++i) {
        v[i][axis] = (*points[i])(axis)-mean;
        const Scalar size = v[i][axis] < Scalar(0) ? -v[i][axis] : v[i][axis];
        if (size > largest) largest = size;
      }
    }
    if (!(largest > Scalar(1e-30)) || !math::is_finite(largest)) return Scalar(0);

    // d^2 does not change with the unit of length: take the largest component, against overflow.
    const Scalar inverse = Scalar(1) / largest;
    Scalar trace = Scalar(0);
    for (int i = 0; i < 4; ++i) {
      for (int axis = 0; axis < 2; ++axis) {
        v[i][axis] = v[i][axis] * inverse;
        trace = trace + v[i][axis] * v[i][axis];
      }
    }
    const Scalar ridge = math::machine_epsilon<Scalar>() * trace;
    Scalar form = ridge * (v[0][0] * v[0][0] + v[0][1] * v[0][1]);
    Scalar determinant = ridge * trace;
    for (int i = 0; i < 4; ++i) {
      for (int j = i + 1; j < 4; ++j) {
        const Scalar cross = v[i][0] * v[j][1] - v[i][1] * v[j][0];
        determinant = determinant + cross * cross;
        if (i == 0) form = form + cross * cross;
      }
    }
    return Scalar(3) * (form / determinant);  // Eq. (11)
  }
};

}  // namespace auvest
