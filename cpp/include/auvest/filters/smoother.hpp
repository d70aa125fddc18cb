// The way back: what later measurements say about earlier states, [SMO 1] to [SMO 5]
// (docs/algorithms/smoother.md). Rauch, Tung, Striebel, "Maximum likelihood estimates of linear
// dynamic systems", AIAA Journal 3(8), 1965; for points: Sarkka, "Unscented Rauch-Tung-Striebel
// smoother", IEEE Transactions on Automatic Control 53(3), 2008.
//
// Seen from the belief N(x, P) before a prediction, P = L L', the state before and the state after
// are, in the coordinates y ~ N(0, I) that the update has too,
//
//     before = x + L y,   after = x- + T y + e,   e ~ N(0, E),   P- = T T' + E.
//
// T is Phi L where the filter linearises, and has the t_i of its sigma points in its columns else.
// What is then known of the state after, N(xs+, Ps+), says of the one before
//
//     G = L T' (P-)^-1                    x_s = x + G (xs+ - x-)
//     D = (L - G T)(L - G T)' + G E G'    P_s = D + G Ps+ G'.
//
// D is P - G P- G' as a sum of squares, as the Joseph form is of an update: P_s stays positive
// definite in 32 bits too. Measurements, their weights and recoveries are in the beliefs: the way
// back asks for none of them. A recovery has widened P before the next prediction, and G is that of
// the widened P, which lets later ranges move the states before it.
//
// A fixed interval takes all predictions of a record back, from the last belief to the first; a
// fixed lag takes the last few back at any time.
#pragma once

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/sigma_point_filter.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What a prediction makes of the coordinates y of the belief before it.
template <class Scalar, int N>
struct Spread {
  Matrix<Scalar, N, N> root;   ///< L
  Matrix<Scalar, N, N> moved;  ///< T
  Matrix<Scalar, N, N> noise;  ///< E, lower triangle
};

/// A prediction as the way back needs it.
template <class Scalar, int N>
struct BackwardStep {
  Vector<Scalar, N> x;          ///< before it
  Vector<Scalar, N> predicted;  ///< x-
  Matrix<Scalar, N, N> gain;    ///< G
  Matrix<Scalar, N, N> rest;    ///< D, lower triangle

  /// Of the prediction that made `after` of the belief at `mean`. kNotPositiveDefinite where the
  /// covariance of `after` is indefinite. Uses up `spread`.
  AUVEST_OUTLINE Status make(const Vector<Scalar, N>& mean, const Belief<Scalar, N>& after,
                             Spread<Scalar, N>& spread) {
    begin(mean, after.x);
    correlate(spread);
    if (!divide(after.P)) return Status::kNotPositiveDefinite;
    add_rest(spread);
    return check();
  }

  // make() in its parts, for a belief that is made of several.

  void begin(const Vector<Scalar, N>& mean, const Vector<Scalar, N>& after) {
    math::copy(mean, x);
    math::copy(after, predicted);
    math::set_zero(gain);
    math::set_zero(rest);
  }

  /// `gain`, before divide(): the covariance of both states, which grows by L T'.
  void correlate(const Spread<Scalar, N>& spread) {
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j < N; ++j) {
        gain(i, j) =
            math::plus_dot(gain(i, j), &spread.root(i, 0), &spread.moved(j, 0), i + 1);  // [SMO 2]
      }
    }
  }

  /// Divides `gain` by P- (lower triangle). False where that is indefinite.
  bool divide(Matrix<Scalar, N, N> p) {
    if (!math::ldlt(p)) return false;
    for (int i = 0; i < N; ++i) {
      Scalar* const g = &gain(i, 0);
      for (int j = 1; j < N; ++j) g[j] = math::minus_dot(g[j], &p(j, 0), g, j);
      for (int j = 0; j < N; ++j) g[j] = g[j] / p(j, j);
      for (int j = N - 1; j >= 0; --j) {
        for (int k = j + 1; k < N; ++k) g[j] = g[j] - p(k, j) * g[k];  // [SMO 2]
      }
    }
    return true;
  }

  /// Adds what this says of D. Uses up `spread`.
  void add_rest(Spread<Scalar, N>& spread) {
    math::mirror_lower(spread.noise);
    const Matrix<Scalar, N, N> noise = math::symmetric_product(gain, spread.noise);
    Matrix<Scalar, N, N>& left = spread.root;  // L - G T
    for (int k = 0; k < N; ++k) {
      for (int i = 0; i < N; ++i) {
        for (int j = 0; j < N; ++j) left(i, k) = left(i, k) - gain(i, j) * spread.moved(j, k);
      }
    }
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Scalar sum = rest(i, j) + noise(i, j);
        rest(i, j) = math::plus_dot(sum, &left(i, 0), &left(j, 0), N);  // [SMO 4]
      }
    }
  }

  Status check() const {
    return math::all_finite(gain) && math::lower_finite(rest) ? Status::kOk : Status::kOverflow;
  }

  /// Takes what is known of the state after the prediction back to the one before it.
  template <class Process>
  AUVEST_OUTLINE void back(const Process& process, Belief<Scalar, N>& belief) const {
    const Vector<Scalar, N> moved = process.residual(belief.x, predicted);
    belief.P = math::symmetric_product(gain, belief.P);
    for (int i = 0; i < N; ++i) {
      belief.x(i) = math::plus_dot(x(i), &gain(i, 0), moved.data(), N);           // [SMO 3]
      for (int j = 0; j <= i; ++j) belief.P(i, j) = belief.P(i, j) + rest(i, j);  // [SMO 5]
    }
  }
};

/// T = Phi L and E = Q: a process linearised at the mean.
template <class Scalar, int N>
void spread_by_jacobian(const Matrix<Scalar, N, N>& phi, const Matrix<Scalar, N, N>& noise,
                        Spread<Scalar, N>& spread) {
  project(phi, spread.root, spread.moved);  // [SMO 1]
  math::copy(noise, spread.noise);
}

/// T and E of points: those of sigma_points.hpp, with Q in `spread.noise` before.
template <class Points, class Point, class Scalar, int N>
void spread_by_points(const Points& points, const Point& point, Spread<Scalar, N>& spread) {
  Vector<Scalar, N> shift;
  points.transform(point, spread.root, spread.moved, shift, spread.noise);  // [SMO 1]
}

/// Of the prediction over dt that `filter` has just done, from `before`; by the kind of the filter.
template <class Process, class Scalar, int N>
Status spread_of(const GaussianFilter<Ekf<Process>, Process>& filter,
                 const Belief<Scalar, N>& before, Scalar dt, Spread<Scalar, N>& spread) {
  Matrix<Scalar, 1, N> no_others;
  if (!math::factor_leading(before.P, spread.root, no_others)) return Status::kNotPositiveDefinite;
  const Process& process = filter.process();
  spread_by_jacobian<Scalar, N>(process.Phi(before.x, dt), process.Q(dt), spread);
  return Status::kOk;
}

namespace detail {

template <class Points, class Process, class Scalar, int N>
void spread_points(const Points&, const Process& process, const Belief<Scalar, N>& before,
                   Scalar dt, Spread<Scalar, N>& spread, IsLinear<true>) {
  spread_by_jacobian<Scalar, N>(process.Phi(before.x, dt), process.Q(dt), spread);
}
template <class Points, class Process, class Scalar, int N>
void spread_points(const Points& points, const Process& process, const Belief<Scalar, N>& before,
                   Scalar dt, Spread<Scalar, N>& spread, IsLinear<false>) {
  math::copy(process.Q(dt), spread.noise);
  spread_by_points(points, process.about(before.x, dt), spread);
}

}  // namespace detail

template <class Process, class Points, class Scalar, int N>
Status spread_of(const GaussianFilter<SigmaPointFilter<Process, Points>, Process>& filter,
                 const Belief<Scalar, N>& before, Scalar dt, Spread<Scalar, N>& spread) {
  Matrix<Scalar, 1, N> no_others;
  if (!math::factor_leading(before.P, spread.root, no_others)) return Status::kNotPositiveDefinite;
  const auto& points = static_cast<const SigmaPointFilter<Process, Points>&>(filter).points();
  detail::spread_points(points, filter.process(), before, dt, spread, IsLinear<Process::kLinear>());
  return Status::kOk;
}

/// A filter that also says where the craft was a while ago, with what it has learned since: any
/// Gaussian filter, and the last `Lag` predictions. An estimate of then takes a product of matrices
/// per prediction since.
///
///     FixedLagSmoother<RobustEkf<SpeedHeading<float>>, 20> smoother;   // 960 bytes for the lag
///     smoother.predict(dt, input);
///     smoother.update(z, range);
///     Belief<float, 2> then = smoother.lagged();   // lag() predictions ago
template <class Filter, int Lag>
class FixedLagSmoother {
  static_assert(Lag >= 1, "without a lag there is nothing to smooth: use the filter");
  static_assert(sizeof(int) > 2 || Lag < 256, "an 8-bit chip counts to 255");

 public:
  using Scalar = typename Filter::Scalar;
  using Process = typename Filter::Process;
  using State = typename Filter::State;
  using Covariance = typename Filter::Covariance;
  using BeliefType = typename Filter::BeliefType;
  using Step = BackwardStep<Scalar, Filter::kStates>;
  static constexpr int kLag = Lag;

  /// Goes on from where `filter` is.
  explicit FixedLagSmoother(const Filter& filter) : filter_(filter), newest_(0), count_(0) {}

  /// With a filter that needs no parameters: reset() gives it its belief.
  FixedLagSmoother() : newest_(0), count_(0) {}

  /// Sets the belief, as the filter does; everything before is forgotten.
  Status reset(const State& x0, const Covariance& P0) {
    const Status status = filter_.reset(x0, P0);
    if (status == Status::kOk) count_ = 0;
    return status;
  }

  /// Carries the filter dt >= 0 seconds forward. On anything but kOk nothing has changed.
  Status predict(Scalar dt) {
    const Forward forward = {filter_, dt};
    return step(dt, forward);
  }
  /// The same for a process that has an input, which is `input` during these dt seconds.
  template <class Input>
  Status predict(Scalar dt, const Input& input) {
    const DrivenForward<Input> forward = {filter_, dt, input};
    return step(dt, forward);
  }

  /// Corrects the present belief, as the filter does.
  template <class Z, class Model>
  auto update(const Z& z, const Model& model)
      -> decltype(static_cast<Filter*>(nullptr)->update(z, model)) {
    return filter_.update(z, model);
  }

  /// How many predictions lie between lagged() and now: Lag, and fewer at the start.
  int lag() const { return count_; }

  /// The belief lag() predictions ago, with all that was measured since; both triangles.
  BeliefType lagged() const { return smoothed(count_); }

  /// The same `predictions` ago, 0 to lag().
  AUVEST_OUTLINE BeliefType smoothed(int predictions) const {
    BeliefType belief;
    math::copy(filter_.belief(), belief);
    int k = newest_;
    for (int done = 0; done < predictions && done < count_; ++done) {
      steps_[k].back(filter_.process(), belief);
      k = k > 0 ? k - 1 : Lag - 1;
    }
    math::mirror_lower(belief.P);
    return belief;
  }

  const Filter& filter() const { return filter_; }

 private:
  struct Forward {
    Filter& filter;
    Scalar dt;
    Status operator()() const { return filter.predict(dt); }
  };
  template <class Input>
  struct DrivenForward {
    Filter& filter;
    Scalar dt;
    const Input& input;
    Status operator()() const { return filter.predict(dt, input); }
  };

  template <class Predict>
  Status step(Scalar dt, const Predict& forward) {
    const Filter as_it_was = filter_;
    Status status = forward();
    if (status != Status::kOk) return status;
    const BeliefType& before = as_it_was.belief();
    Spread<Scalar, Filter::kStates> spread;
    status = spread_of(filter_, before, dt, spread);
    Step next;
    if (status == Status::kOk) status = next.make(before.x, filter_.belief(), spread);
    if (status != Status::kOk) {
      filter_ = as_it_was;
      return status;
    }
    if (count_ > 0) newest_ = newest_ + 1 < Lag ? newest_ + 1 : 0;
    if (count_ < Lag) ++count_;
    steps_[newest_] = next;
    return status;
  }

  Filter filter_;
  Step steps_[Lag];
  int newest_;  // of steps_
  int count_;   // of those that are there
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
