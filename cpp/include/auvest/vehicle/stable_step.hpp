// The largest time step with which a hull stays stable, for the desk: before a simulation starts.
//
// About a state and a command, attitude, velocities and actuators follow y' = A y (position and
// heading act on nothing). A step multiplies y by
//
//     Rk4           Phi(h) = I + hA + (hA)^2/2 + (hA)^3/6 + (hA)^4/24
//     SemiImplicit  Phi(h) of its two halves
//
// and is stable while Phi(h) has no more modes outside the unit circle than the hull has that grow
// by themselves (none, but for a Munk moment that nothing holds). A comes from central differences
// of the rates. Modes are counted, not computed: mu lies outside the circle where (mu - 1)/(mu + 1)
// has a positive real part, and the trace of the matrix sign function is the number of those with a
// positive real part less the number of the others.
//
// This says where a simulation explodes, not where it is accurate: the lag of a fin of 0.1 s alone
// bounds Rk4 by 0.278 s, but a tenth of a second is a good step for it.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "auvest/vehicle/integrate.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace detail {

/// The hull linearised about a state.
template <class Hull>
class LinearHull {
 public:
  using Scalar = typename Hull::Scalar;
  /// Roll and pitch, where they are kept.
  static constexpr int kAngles =
      (Hull::Freedom::keeps(kRoll) ? 1 : 0) + (Hull::Freedom::keeps(kPitch) ? 1 : 0);
  static constexpr int kSize = kAngles + Hull::kVelocities + Hull::kActuators;
  using Square = Matrix<Scalar, kSize, kSize>;

  LinearHull(const Hull& hull, const typename Hull::State& x,
             const typename Hull::Command& command) {
    const typename Hull::Command demand = hull.demands(command);
    typename Hull::Current still;
    math::set_zero(still);
    // The cube root of epsilon balances rounding and curvature.
    const Scalar delta = math::exp(math::log(math::machine_epsilon<Scalar>()) / Scalar(3));
    for (int j = 0; j < kSize; ++j) {
      typename Hull::State shifted = x;
      typename Hull::State above, below;
      shifted(place(j)) = x(place(j)) + delta;
      hull.rate(shifted, demand, still, above);
      shifted(place(j)) = x(place(j)) - delta;
      hull.rate(shifted, demand, still, below);
      for (int i = 0; i < kSize; ++i) {
        a_(i, j) = (above(place(i)) - below(place(i))) / (delta + delta);
      }
    }
  }

  /// The largest row of |A|: no mode is faster.
  Scalar fastest() const {
    Scalar largest = Scalar(0);
    for (int i = 0; i < kSize; ++i) {
      Scalar sum = Scalar(0);
      for (int j = 0; j < kSize; ++j) sum = sum + math::absolute(a_(i, j));
      largest = math::larger(largest, sum);
    }
    return largest;
  }

  /// The modes of the hull itself that grow.
  int growing() const {
    Square shifted = a_;
    add_diagonal(shifted, -neutral());
    return positive_modes(shifted);
  }

  /// The modes that a step lets grow.
  template <class Method>
  int growing(Scalar h) const {
    const Square phi = propagator(h, Method());
    Square minus, plus;
    const Scalar shrink = math::exp(-(neutral() * h));
    for (int i = 0; i < kSize * kSize; ++i) {
      plus.data()[i] = minus.data()[i] = shrink * phi.data()[i];
    }
    add_diagonal(minus, Scalar(-1));
    add_diagonal(plus, Scalar(1));
    if (!invert(plus)) return kSize;  // a mode at -1: on the bound
    return positive_modes(product(minus, plus));
  }

 private:
  /// Rates of growth [1/s] below this count as none: a mode without damping is neutral.
  static Scalar neutral() { return Scalar(1e-3); }

  /// The number of eigenvalues with a positive real part, by Newton's iteration of the sign.
  static int positive_modes(Square s) {
    for (int k = 0; k < 60; ++k) {
      Square inverse = s;
      if (!invert(inverse)) return kSize;  // a neutral mode, in spite of the shift
      Scalar change = Scalar(0);
      for (int i = 0; i < kSize * kSize; ++i) {
        const Scalar mean = Scalar(0.5) * (s.data()[i] + inverse.data()[i]);
        change = change + math::absolute(mean - s.data()[i]);
        s.data()[i] = mean;
      }
      if (change < Scalar(0.01)) break;
    }
    Scalar trace = Scalar(0);
    for (int i = 0; i < kSize; ++i) trace = trace + s(i, i);
    if (!math::is_finite(trace)) return kSize;  // too large to tell
    int count = 0;
    while (count < kSize && Scalar(2 * count - kSize) < trace - Scalar(1)) ++count;
    return count;
  }

  /// By Gauss and Jordan, with pivots; false if the matrix is singular.
  static bool invert(Square& a) {
    Square b = identity();
    for (int k = 0; k < kSize; ++k) {
      int pivot = k;
      for (int i = k + 1; i < kSize; ++i) {
        if (math::absolute(a(i, k)) > math::absolute(a(pivot, k))) pivot = i;
      }
      const Scalar scale = Scalar(1) / a(pivot, k);
      if (!math::is_finite(scale)) return false;
      for (int j = 0; j < kSize; ++j) {
        swap_scaled(a(k, j), a(pivot, j), scale);
        swap_scaled(b(k, j), b(pivot, j), scale);
      }
      for (int i = 0; i < kSize; ++i) {
        if (i == k) continue;
        const Scalar factor = a(i, k);
        math::add_scaled(-factor, &a(k, 0), &a(i, 0), kSize);
        math::add_scaled(-factor, &b(k, 0), &b(i, 0), kSize);
      }
    }
    a = b;
    return true;
  }

  static void swap_scaled(Scalar& to, Scalar& from, Scalar scale) {
    const Scalar moved = scale * from;
    from = to;
    to = moved;
  }

  static void add_diagonal(Square& a, Scalar value) {
    for (int i = 0; i < kSize; ++i) a(i, i) = a(i, i) + value;
  }

  /// The place in the hull's state of component i.
  static int place(int i) {
    if (i >= kAngles) return Hull::kVelocities + i - kAngles;
    int seen = 0;
    for (int k = 0; k < Hull::kVelocities; ++k) {
      const int axis = Hull::Freedom::axis(k);
      if ((axis == kRoll || axis == kPitch) && seen++ == i) return k;
    }
    return 0;
  }

  static Square product(const Square& a, const Square& b) {
    Square c;
    for (int i = 0; i < kSize; ++i) {
      for (int j = 0; j < kSize; ++j) {
        Scalar sum = Scalar(0);
        for (int k = 0; k < kSize; ++k) sum = sum + a(i, k) * b(k, j);
        c(i, j) = sum;
      }
    }
    return c;
  }

  /// [HULL I1]: Horner's rule of the powers of hA.
  Square propagator(Scalar h, Rk4) const {
    Square phi = identity();
    for (int k = 4; k >= 1; --k) {
      phi = product(a_, phi);
      for (int i = 0; i < kSize * kSize; ++i) phi.data()[i] = phi.data()[i] * (h / Scalar(k));
      for (int i = 0; i < kSize; ++i) phi(i, i) = phi(i, i) + Scalar(1);
    }
    return phi;
  }

  /// [HULL I2]: the motion from the old state, then the angles from the new motion.
  Square propagator(Scalar h, SemiImplicit) const {
    Square motion = identity();
    Square angles = identity();
    for (int i = 0; i < kSize; ++i) {
      for (int j = 0; j < kSize; ++j) {
        Square& half = i < kAngles ? angles : motion;
        half(i, j) = half(i, j) + h * a_(i, j);
      }
    }
    return product(angles, motion);
  }

  static Square identity() {
    Square one;
    math::set_zero(one);
    for (int i = 0; i < kSize; ++i) one(i, i) = Scalar(1);
    return one;
  }

  Square a_;
};

}  // namespace detail

/// The largest stable step [s] of Rk4 or SemiImplicit about a state and a command, to 0.1 %. The
/// fastest that a hull will go asks for the shortest step.
template <class Method, class Hull>
typename Hull::Scalar largest_stable_step(const Hull& hull, const typename Hull::State& x,
                                          const typename Hull::Command& command) {
  using Scalar = typename Hull::Scalar;
  const detail::LinearHull<Hull> linear(hull, x, command);
  const int own = linear.growing();
  const auto stable = [&](Scalar h) { return linear.template growing<Method>(h) <= own; };
  Scalar low = Scalar(0.05) / linear.fastest();
  Scalar high = low;
  for (int i = 0; i < 80 && stable(high); ++i) {  // [HULL S1]
    low = high;
    high = Scalar(1.25) * high;
  }
  for (int i = 0; i < 12; ++i) {
    const Scalar middle = Scalar(0.5) * (low + high);
    if (stable(middle)) {
      low = middle;
    } else {
      high = middle;
    }
  }
  return low;
}

/// kUnstableStep if `h` is not a positive step up to largest_stable_step().
template <class Method, class Hull>
Status check_step(const Hull& hull, const typename Hull::State& x,
                  const typename Hull::Command& command, typename Hull::Scalar h) {
  if (!math::is_positive(h)) return Status::kUnstableStep;
  const bool stable = h <= largest_stable_step<Method>(hull, x, command);
  return stable ? Status::kOk : Status::kUnstableStep;
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
