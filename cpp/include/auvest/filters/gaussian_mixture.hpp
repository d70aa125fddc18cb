// A Gaussian mixture of few components: the belief of a range filter that does not know where it
// is. Derived in docs/algorithms/unknown_start.md.
//
// The first two states are the position. Sums go in the order of the index and ties to the lower
// one, so that the bits are the same everywhere. Covariances are lower triangles, as in Belief.
#pragma once

#include <cstdint>

#include "auvest/math/exponential.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The larger eigenvalue of the position's covariance, and its unit eigenvector.
template <class Scalar>
struct LongAxis {
  Scalar variance;
  Scalar x, y;

  template <int N>
  AUVEST_OUTLINE explicit LongAxis(const Matrix<Scalar, N, N>& p) {
    using math::sqrt;
    // In parts of the trace, so that no square overflows.
    const Scalar trace = p(0, 0) + p(1, 1);
    const Scalar half = Scalar(0.5) * ((p(0, 0) - p(1, 1)) / trace);
    const Scalar across = p(1, 0) / trace;
    const Scalar radius = sqrt(half * half + across * across);
    variance = trace * (Scalar(0.5) + radius);
    x = half < Scalar(0) ? across : radius + half;
    y = half < Scalar(0) ? radius - half : across;
    const Scalar length = sqrt(x * x + y * y);
    x = length > Scalar(0) ? x / length : Scalar(1);
    y = length > Scalar(0) ? y / length : Scalar(0);
  }
};

/// The variance of the position along (x, y).
template <class Scalar, int N>
AUVEST_OUTLINE Scalar variance_along(const Matrix<Scalar, N, N>& p, Scalar x, Scalar y) {
  return x * (x * p(0, 0) + y * p(1, 0)) + y * (x * p(1, 0) + y * p(1, 1));
}

/// A range in the plane, as rules about circles ask for it.
template <class Scalar>
struct RangeCircle {
  Scalar centre[2];
  Scalar radius;  ///< at least `sigma`: a range of nothing says no more than that
  Scalar sigma;
};

/// Where the components are: in place.
template <class Scalar, int N, int K>
struct ComponentArrays {
  std::uint8_t size;  ///< n, 1..K
  Scalar weight[K];   ///< of the first n: positive, their sum is 1
  Belief<Scalar, N> component[K];

  /// Makes room for so many, at most K.
  void reserve(int) {}
};

/// `Components`: as ComponentArrays, of at most K.
template <class Scalar, int N, int K, class Components = ComponentArrays<Scalar, N, K>>
struct GaussianMixture : Components {
  using Components::component;
  using Components::size;
  using Components::weight;

  /// One Gaussian.
  void assign(const Belief<Scalar, N>& belief) {
    size = 1;
    weight[0] = Scalar(1);
    math::copy(belief, component[0]);
  }

  /// The first two moments.
  AUVEST_OUTLINE void moments(Belief<Scalar, N>& whole) const {
    math::copy(component[0], whole);
    if (size == 1) return;
    // About the first, so that digits that all have in common are not lost.
    for (int i = 0; i < N; ++i) {
      Scalar shift = Scalar(0);
      for (int k = 1; k < size; ++k) {
        shift = shift + weight[k] * (component[k].x(i) - component[0].x(i));
      }
      whole.x(i) = component[0].x(i) + shift;
    }
    math::set_zero(whole.P);
    for (int k = 0; k < size; ++k) {
      Vector<Scalar, N> d;
      for (int i = 0; i < N; ++i) {
        d(i) = component[k].x(i) - whole.x(i);
        for (int j = 0; j <= i; ++j) {
          whole.P(i, j) = whole.P(i, j) + weight[k] * (component[k].P(i, j) + d(i) * d(j));
        }
      }
    }
  }

  /// The mean of the components' own traces of the position.
  Scalar trace_within() const {
    Scalar within = Scalar(0);
    for (int k = 0; k < size; ++k) {
      within = within + weight[k] * (component[k].P(0, 0) + component[k].P(1, 1));
    }
    return within;
  }

  /// True if the weight lies on `most` components or fewer: their effective number is 1 / sum w^2.
  bool few(int most) const {
    Scalar squares = Scalar(0);
    for (int k = 0; k < size; ++k) squares = squares + weight[k] * weight[k];
    return squares * Scalar(most) > Scalar(0.999);
  }

  /// Makes the sum of the weights 1; components below `least` of the heaviest leave.
  AUVEST_OUTLINE void prune(Scalar least) {
    Scalar heaviest = Scalar(0);
    for (int k = 0; k < size; ++k) heaviest = math::larger(heaviest, weight[k]);
    const Scalar limit = least * heaviest;
    int kept = 0;
    Scalar sum = Scalar(0);
    for (int k = 0; k < size; ++k) {
      if (weight[k] < limit) continue;
      sum = sum + weight[k];
      if (kept != k) {
        weight[kept] = weight[k];
        math::copy(component[k], component[kept]);
      }
      ++kept;
    }
    size = static_cast<std::uint8_t>(kept);
    for (int k = 0; k < size; ++k) weight[k] = weight[k] / sum;
  }

  /// Component k becomes two of half the weight, 0.6 sigma to both sides along its long axis; their
  /// first two moments are its own. The second goes to the end.
  AUVEST_OUTLINE void split(int k) {
    using math::sqrt;
    Belief<Scalar, N>& one = component[k];
    Belief<Scalar, N>& other = component[size];
    const LongAxis<Scalar> axis(one.P);
    const Scalar scale = Scalar(0.6) / sqrt(axis.variance);
    Vector<Scalar, N> g;  // 0.6 P e / sqrt(e' P e)
    g(0) = scale * (one.P(0, 0) * axis.x + one.P(1, 0) * axis.y);
    g(1) = scale * (one.P(1, 0) * axis.x + one.P(1, 1) * axis.y);
    for (int i = 2; i < N; ++i) g(i) = scale * (one.P(i, 0) * axis.x + one.P(i, 1) * axis.y);
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) one.P(i, j) = one.P(i, j) - g(i) * g(j);
    }
    math::copy(one, other);
    for (int i = 0; i < N; ++i) {
      one.x(i) = one.x(i) - g(i);
      other.x(i) = other.x(i) + g(i);
    }
    weight[k] = Scalar(0.5) * weight[k];
    weight[size] = weight[k];
    ++size;
  }

  /// Merges the closest two, keeping the moments, for as long as their squared distance in their
  /// own mean covariance is below `limit`. Every further state counts for itself.
  AUVEST_OUTLINE void merge(Scalar limit) {
    Nearest nearest[K];  // of each, among those behind it
    for (int i = 0; i < size; ++i) nearest[i].reach = reach_of(i, limit);
    for (int i = 0; i < size; ++i) find_nearest(nearest, i, limit);
    while (size > 1) {
      int first = 0;
      for (int i = 1; i < size; ++i) {
        if (nearest[i].distance2 < nearest[first].distance2) first = i;
      }
      if (!(nearest[first].distance2 < limit)) return;
      const int second = nearest[first].index;
      join(first, second);
      // Only what was near to one of the two is looked for anew.
      for (int i = second; i < size; ++i) nearest[i] = nearest[i + 1];
      nearest[first].reach = reach_of(first, limit);
      for (int i = 0; i < size; ++i) {
        Nearest& known = nearest[i];
        const int index = known.index;
        if (index > second) --known.index;
        if (i == first || index == first || index == second) {
          find_nearest(nearest, i, limit);
        } else if (i < first) {
          const Scalar apart = distance2(i, first, known.reach + nearest[first].reach, limit);
          if (apart < known.distance2 || (apart == known.distance2 && first < known.index)) {
            known.distance2 = apart;
            known.index = static_cast<std::uint8_t>(first);
          }
        }
      }
    }
  }

  /// Replaces all by the product of N(m, P) = `prior` with a ring of `count` components
  ///
  ///     c_k = b + z (1 - s^2 / 2) u_k,   R_k = (sigma^2 + (s^2 z)^2 / 2) u_k u_k' + (s z)^2 t_k
  ///     t_k'
  ///
  /// with s = pi / count: what a range z says about the position. In the frame of u_k and t_k R is
  /// diagonal, and with P = [p_uu p_ut; p_ut p_tt] and S = P + R the posterior R - R S^-1 R is
  ///
  ///     P_uu = r_u a / (a + r_u),  P_tt = r_t b / (b + r_t),  P_ut = r_u r_t p_ut / det S,
  ///     a = p_uu - p_ut^2 / (p_tt + r_t),   b = p_tt - p_ut^2 / (p_uu + r_u),
  ///
  /// where no digit is lost, however wide the prior. Further states follow by their regression on
  /// the position. False if P is not positive definite: nothing has changed then.
  bool ring(const Belief<Scalar, N>& prior, const RangeCircle<Scalar>& circle, int count) {
    if (!lay_ring(prior, circle, count, 0, Scalar(0))) return false;
    size = static_cast<std::uint8_t>(count);
    weigh_logarithms();
    return true;
  }

  /// Replaces each component by its own product with a ring of `count`, as above. Components of one
  /// position and several headings are told apart by what follows, and not by their moments.
  bool rings(const RangeCircle<Scalar>& circle, int count) {
    for (int k = 0; k < size; ++k) {
      if (!(component[k].P(0, 0) > Scalar(0)) || !(component[k].P(1, 1) > Scalar(0))) return false;
    }
    for (int k = size - 1; k >= 0; --k) {  // a ring lies at its prior's place or behind it
      Belief<Scalar, N> prior;
      math::copy(component[k], prior);
      lay_ring(prior, circle, count, k * count, math::log(weight[k]));
    }
    size = static_cast<std::uint8_t>(size * count);
    weigh_logarithms();
    return true;
  }

  /// True if it can be what a filter left: so many components at most.
  bool valid(int most) const {
    if (size < 1 || size > most) return false;
    Scalar sum = Scalar(0);
    for (int k = 0; k < size; ++k) {
      if (!math::is_positive(weight[k])) return false;
      sum = sum + weight[k];
      if (!math::all_finite(component[k].x) || !math::lower_finite(component[k].P)) return false;
      Matrix<Scalar, N, N> p = component[k].P;
      if (!math::ldlt(p)) return false;
    }
    return math::within(sum, Scalar(0.999), Scalar(1.001));
  }

 private:
  /// The components of a ring from number `first` on, with the logarithms of their weights.
  AUVEST_OUTLINE bool lay_ring(const Belief<Scalar, N>& prior, const RangeCircle<Scalar>& circle,
                               int count, int first, Scalar log_prior) {
    using math::larger;
    using math::sqrt;
    Matrix<Scalar, 2, 2> root;
    Matrix<Scalar, math::other_states(N, 2), 2> slope;
    if (!math::factor_leading(prior.P, root, slope)) return false;
    const Scalar s = math::pi<Scalar>() / Scalar(count);
    const Scalar bend = s * s * circle.radius;
    const Scalar radius = circle.radius - Scalar(0.5) * bend;
    const Scalar r_u = circle.sigma * circle.sigma + Scalar(0.5) * (bend * bend);
    const Scalar r_t = (s * circle.radius) * (s * circle.radius);
    // From the centre to the mean: where the ring begins.
    const Scalar dx = prior.x(0) - circle.centre[0];
    const Scalar dy = prior.x(1) - circle.centre[1];
    const Scalar distance = sqrt(dx * dx + dy * dy);
    const Scalar first_x = distance > Scalar(0) ? dx / distance : Scalar(1);
    const Scalar first_y = distance > Scalar(0) ? dy / distance : Scalar(0);
    for (int k = 0; k < count; ++k) {
      Scalar sine, cosine;
      math::sincos(Scalar(2 * k) * s, sine, cosine);
      const Scalar ux = cosine * first_x - sine * first_y;
      const Scalar uy = sine * first_x + cosine * first_y;
      const Scalar p_uu = variance_along(prior.P, ux, uy);
      const Scalar p_tt = variance_along(prior.P, -uy, ux);
      const Scalar p_ut =
          ux * uy * (prior.P(1, 1) - prior.P(0, 0)) + (ux * ux - uy * uy) * prior.P(1, 0);
      const Scalar s_tt = p_tt + r_t;
      const Scalar q = p_ut / s_tt;
      const Scalar a = larger(p_uu - q * p_ut, math::pivot_floor(p_uu));
      const Scalar b = larger(p_tt - p_ut / (p_uu + r_u) * p_ut, math::pivot_floor(p_tt));
      const Scalar s_uu = a + r_u;  // of S, when the rest of it is known
      const Scalar d_u = radius - (dx * ux + dy * uy);
      const Scalar d_t = -(dy * ux - dx * uy);
      const Scalar y_u = (d_u - q * d_t) / s_uu;  // S^-1 (c - m)
      const Scalar y_t = (d_t - p_ut * y_u) / s_tt;
      const Scalar log_weight =
          Scalar(-0.5) * (d_u * y_u + d_t * y_t + math::log(s_uu) + math::log(s_tt));
      weight[first + k] = larger(Scalar(-1e30), log_prior + log_weight);

      const Scalar along = radius - r_u * y_u;
      const Scalar across = -(r_t * y_t);
      Belief<Scalar, N>& one = component[first + k];
      math::copy(prior, one);
      one.x(0) = circle.centre[0] + (along * ux - across * uy);
      one.x(1) = circle.centre[1] + (along * uy + across * ux);
      const Scalar left = r_u / s_uu;
      const Scalar new_uu = left * a;
      const Scalar new_tt = r_t * (b / (b + r_t));
      const Scalar new_ut = left * (r_t * q);
      const Scalar twice = (new_ut + new_ut) * (ux * uy);
      one.P(0, 0) = new_uu * (ux * ux) + new_tt * (uy * uy) - twice;
      one.P(1, 0) = (new_uu - new_tt) * (ux * uy) + new_ut * (ux * ux - uy * uy);
      one.P(0, 1) = one.P(1, 0);
      one.P(1, 1) = new_uu * (uy * uy) + new_tt * (ux * ux) + twice;
      carry(prior, slope, one);
    }
    return true;
  }

  /// From logarithms to weights, the heaviest 1.
  void weigh_logarithms() {
    Scalar most = weight[0];
    for (int k = 1; k < size; ++k) most = math::larger(most, weight[k]);
    for (int k = 0; k < size; ++k) {
      const Scalar relative = weight[k] - most;
      weight[k] = relative > Scalar(-80) ? math::exp(relative) : Scalar(0);
    }
  }

  struct Nearest {
    Scalar distance2;    ///< `limit` where none is nearer
    Scalar reach;        ///< of the component itself: see distance2()
    std::uint8_t index;  ///< its own where none is nearer
  };

  Scalar reach_of(int i, Scalar limit) const {
    return Scalar(0.5) * limit * (component[i].P(0, 0) + component[i].P(1, 1));
  }

  /// The lower index where two are as near.
  AUVEST_OUTLINE void find_nearest(Nearest* nearest, int i, Scalar limit) const {
    Nearest& own = nearest[i];
    own.distance2 = limit;
    own.index = static_cast<std::uint8_t>(i);
    for (int j = i + 1; j < size; ++j) {
      const Scalar apart = distance2(i, j, own.reach + nearest[j].reach, limit);
      if (apart < own.distance2) {
        own.distance2 = apart;
        own.index = static_cast<std::uint8_t>(j);
      }
    }
  }

  /// d' ((P_i + P_j) / 2)^-1 d of the position, and d^2 over the mean variance of every further
  /// state; `limit` where it is no less than that. `reach`: the sum of both. No direction is wider
  /// than the trace says, so that most pairs are done with at once.
  AUVEST_OUTLINE Scalar distance2(int i, int j, Scalar reach, Scalar limit) const {
    const Belief<Scalar, N>& one = component[i];
    const Belief<Scalar, N>& other = component[j];
    const Scalar dx = one.x(0) - other.x(0);
    if (dx * dx > reach) return limit;
    const Scalar dy = one.x(1) - other.x(1);
    if (dy * dy > reach) return limit;
    const Scalar s_xx = one.P(0, 0) + other.P(0, 0);
    const Scalar s_yy = one.P(1, 1) + other.P(1, 1);
    const Scalar s_yx = one.P(1, 0) + other.P(1, 0);
    const Scalar q = s_yx / s_xx;
    const Scalar rest = math::larger(s_yy - q * s_yx, math::pivot_floor(s_yy));
    const Scalar ey = dy - q * dx;
    Scalar sum = dx * (dx / s_xx) + ey * (ey / rest);
    for (int k = 2; k < N; ++k) {
      const Scalar d = one.x(k) - other.x(k);
      sum = sum + d * (d / (one.P(k, k) + other.P(k, k)));
    }
    sum = sum + sum;
    return sum < limit ? sum : limit;
  }

  /// The states behind the position, once that has become `one`'s: as [UKF S5].
  static void carry(const Belief<Scalar, N>& prior,
                    const Matrix<Scalar, math::other_states(N, 2), 2>& slope,
                    Belief<Scalar, N>& one) {
    for (int i = 2; i < N; ++i) {
      const Scalar* const b = &slope(i - 2, 0);
      one.x(i) = one.x(i) + (b[0] * (one.x(0) - prior.x(0)) + b[1] * (one.x(1) - prior.x(1)));
      Scalar change[2];
      for (int k = 0; k < 2; ++k) {
        const Scalar after = b[0] * one.P(0, k) + b[1] * one.P(1, k);
        change[k] = one.P(i, k) - after;
        one.P(i, k) = after;
      }
      const Scalar floor = math::pivot_floor(one.P(i, i));
      for (int j = 2; j <= i; ++j) {
        one.P(i, j) = one.P(i, j) - (change[0] * slope(j - 2, 0) + change[1] * slope(j - 2, 1));
      }
      one.P(i, i) = math::larger(one.P(i, i), floor);
    }
  }

  /// i becomes i and j together; those behind j move up.
  void join(int i, int j) {
    Belief<Scalar, N>& one = component[i];
    const Belief<Scalar, N>& other = component[j];
    const Scalar sum = weight[i] + weight[j];
    const Scalar part = weight[j] / sum;
    const Scalar rest = weight[i] / sum;
    Vector<Scalar, N> d;
    for (int k = 0; k < N; ++k) {
      d(k) = other.x(k) - one.x(k);
      one.x(k) = one.x(k) + part * d(k);
      for (int l = 0; l <= k; ++l) {
        one.P(k, l) = rest * one.P(k, l) + part * (other.P(k, l) + rest * (d(k) * d(l)));
      }
    }
    weight[i] = sum;
    for (int k = j + 1; k < size; ++k) {
      weight[k - 1] = weight[k];
      math::copy(component[k], component[k - 1]);
    }
    --size;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
