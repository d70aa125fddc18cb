// The way back over a record, for filters put together at run time: any process, linearisation,
// kernel and recovery, one Gaussian or a sum of several, measurements of an earlier time.
//
// A filter as it was before some rows takes them once more, notes its predictions, and goes back
// over them. That takes the memory of these rows only: a record of any length is smoothed in blocks
// from its end, each from the filter as it was when it came there.
#pragma once

#include <utility>
#include <vector>

#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/smoother.hpp"
#include "desk/models.hpp"

namespace auvest {
namespace desk {

/// Where the smoothed beliefs go, and from where they come: rows of a block, and what is smoothed
/// at its two ends.
template <class Scalar>
struct Smoothed {
  std::size_t rows;     ///< of the block; the record may go on
  const Scalar* end_x;  ///< smoothed, after the last of these rows; null: what the filter says
  const Scalar* end_P;  ///< after the record
  Scalar* x;            ///< (rows, n)
  Scalar* P;            ///< (rows, n, n), or null
  Scalar* start_x;      ///< (n) before the first row
  Scalar* start_P;      ///< (n, n)
  double lag_s;         ///< each row has what came within this time after it; NaN: everything
};

/// A process as points see it, from its virtual f.
template <class Scalar, int N>
struct AnyExpansion {
  const RuntimeProcess<Scalar, N>& process;
  Vector<Scalar, N> x;
  Scalar dt;
  Vector<Scalar, N> centre;

  AnyExpansion(const RuntimeProcess<Scalar, N>& driven, const Vector<Scalar, N>& mean, Scalar step)
      : process(driven), x(mean), dt(step), centre(at(mean)) {}

  void deviations(const Vector<Scalar, N>& e, Vector<Scalar, N>& sum,
                  Vector<Scalar, N>& difference) const {
    const Vector<Scalar, N> plus = process.residual(at(x + e), centre);
    const Vector<Scalar, N> minus = process.residual(at(x - e), centre);
    sum = plus + minus;
    difference = plus - minus;
  }

 private:
  Vector<Scalar, N> at(const Vector<Scalar, N>& point) const {
    Vector<Scalar, N> moved;
    process.model->f(point.data(), dt, process.input.data(), moved.data());
    return moved;
  }
};

/// What the prediction over dt makes of `before`, as the filter that does it linearises.
template <class Scalar, int N>
Status spread_of(const AnyLinearisation<Scalar>& how, const RuntimeProcess<Scalar, N>& process,
                 const Belief<Scalar, N>& before, Scalar dt, Spread<Scalar, N>& spread) {
  using Kind = typename AnyLinearisation<Scalar>::Kind;
  Matrix<Scalar, 1, N> no_others;
  if (!math::factor_leading(before.P, spread.root, no_others)) return Status::kNotPositiveDefinite;
  process.model->Q(dt, process.input.data(), spread.noise.data());
  if (how.kind == Kind::kCkf && !process.model->linear) {
    spread_by_points(how.cubature, AnyExpansion<Scalar, N>(process, before.x, dt), spread);
    return Status::kOk;
  }
  // Points that lie so near that differences lose their digits say what the Jacobian says.
  if (how.kind == Kind::kUkf && !process.model->linear && !how.unscented.fine) {
    spread_by_points(how.unscented, AnyExpansion<Scalar, N>(process, before.x, dt), spread);
    return Status::kOk;
  }
  Matrix<Scalar, N, N> phi;
  process.model->Phi(before.x.data(), dt, process.input.data(), phi.data());
  const Matrix<Scalar, N, N> noise = spread.noise;
  spread_by_jacobian(phi, noise, spread);
  return Status::kOk;
}

/// What a filter notes while it takes rows.
template <class Robust>
class BackwardPass {
 public:
  using Scalar = typename Robust::Scalar;
  static constexpr int kStates = Robust::kStates;
  using BeliefType = typename Robust::BeliefType;
  using Input = typename Robust::Process::Input;
  using Step = BackwardStep<Scalar, kStates>;

  /// `beliefs`: whether every row's own is kept, for a lag.
  BackwardPass(const Robust& filter, bool beliefs) : filter_(filter), beliefs_(beliefs) {}

  const Robust& filter() const { return filter_; }
  Robust& filter() { return filter_; }
  std::size_t rows() const { return steps_.size(); }

  /// Carries the filter through the prediction of the next row.
  Status predict(Scalar dt, const Input& input) {
    if (beliefs_ && rows() > 0) filtered_.push_back(whole());
    const std::vector<std::pair<Scalar, BeliefType>> before = parts();
    const BeliefType mean = whole();
    Status status = filter_.predict(dt, input);
    if (status != Status::kOk) return status;
    Step step;
    const BeliefType after = whole();
    // Between two measurements of one time nothing is to go back over.
    const bool still = before.size() == 1 && mean.x == after.x && mean.P == after.P;
    if (!still) status = note(before, mean, after, dt, step);
    if (status != Status::kOk) return status;
    moved_.push_back(!still);
    steps_.push_back(step);
    return status;
  }

  /// After the last row.
  void finish() {
    if (beliefs_) filtered_.push_back(whole());
  }

  /// The belief of the filter, in both triangles.
  BeliefType whole() const {
    BeliefType belief = filter_.belief();
    math::mirror_lower(belief.P);
    return belief;
  }
  /// After a row.
  const BeliefType& filtered(std::size_t row) const { return filtered_[row]; }

  /// From what is known after row k to what is known before it. False where that is not finite.
  bool back(std::size_t k, BeliefType& belief) const {
    if (!moved_[k]) return true;
    steps_[k].back(filter_.process(), belief);
    math::mirror_lower(belief.P);
    return math::all_finite(belief.x) && math::all_finite(belief.P);
  }

 private:
  /// The Gaussians of the belief with their weights.
  std::vector<std::pair<Scalar, BeliefType>> parts() const {
    std::vector<std::pair<Scalar, BeliefType>> parts;
    if constexpr (kStates > 1) {
      for (int k = 0; filter_.size() > 1 && k < filter_.size(); ++k) {
        parts.emplace_back(filter_.weight(k), filter_.component(k));
      }
    }
    if (parts.empty()) parts.emplace_back(Scalar(1), filter_.belief());
    return parts;
  }

  /// Of several Gaussians: the regression of the mixture before on that after, by their moments.
  Status note(const std::vector<std::pair<Scalar, BeliefType>>& before, const BeliefType& mean,
              const BeliefType& after, Scalar dt, Step& step) const {
    const std::vector<std::pair<Scalar, BeliefType>> behind = parts();
    if (behind.size() != before.size()) return Status::kBadParameter;
    std::vector<Spread<Scalar, kStates>> spreads(before.size());
    for (std::size_t k = 0; k < before.size(); ++k) {
      const Status status =
          spread_of(filter_.linearisation(), filter_.process(), before[k].second, dt, spreads[k]);
      if (status != Status::kOk) return status;
    }
    if (before.size() == 1) return step.make(mean.x, after, spreads[0]);
    for (std::size_t k = 0; k < before.size(); ++k) {
      const Scalar root = math::sqrt(before[k].first);
      spreads[k].root *= root;
      spreads[k].moved *= root;
      spreads[k].noise *= before[k].first;
      Spread<Scalar, kStates> apart;  // of the means
      math::set_zero(apart.root);
      math::set_zero(apart.moved);
      math::set_zero(apart.noise);
      apart.root.col(0) = root * filter_.process().residual(before[k].second.x, mean.x);
      apart.moved.col(0) = root * filter_.process().residual(behind[k].second.x, after.x);
      spreads.push_back(apart);
    }
    step.begin(mean.x, after.x);
    for (const auto& spread : spreads) step.correlate(spread);
    if (!step.divide(after.P)) return Status::kNotPositiveDefinite;
    for (auto& spread : spreads) step.add_rest(spread);
    return step.check();
  }

  Robust filter_;
  bool beliefs_;
  std::vector<Step> steps_;
  std::vector<bool> moved_;
  std::vector<BeliefType> filtered_;
};

/// Goes back over what was noted. `times`: of the rows, from the start [s].
template <class Robust>
Status go_back(const BackwardPass<Robust>& pass, const std::vector<double>& times,
               const Smoothed<typename Robust::Scalar>& out) {
  constexpr std::size_t n = Robust::kStates;
  const auto write = [&out](std::size_t row, const typename Robust::BeliefType& belief) {
    std::copy_n(belief.x.data(), n, out.x + row * n);
    if (out.P != nullptr) std::copy_n(belief.P.data(), n * n, out.P + row * n * n);
  };
  typename Robust::BeliefType belief = pass.whole();
  if (!math::is_nan(out.lag_s)) {
    // At every row: those that it is the last to say something of.
    const double lag = out.lag_s * 1.000001;  // a sum of steps is not exact
    std::size_t first = 0;
    for (std::size_t now = 0; now < pass.rows() && first < out.rows; ++now) {
      std::size_t last = first;
      const bool end = now + 1 == pass.rows();
      while (last < out.rows && last <= now && (end || times[now + 1] - times[last] > lag)) ++last;
      if (last == first) continue;
      belief = pass.filtered(now);
      for (std::size_t row = now;; --row) {
        if (row < last) write(row, belief);
        if (row == first) break;
        if (!pass.back(row, belief)) return Status::kOverflow;
      }
      first = last;
    }
    return Status::kOk;
  }
  if (out.end_x != nullptr) {
    std::copy_n(out.end_x, n, belief.x.data());
    std::copy_n(out.end_P, n * n, belief.P.data());
  }
  for (std::size_t row = out.rows; row > 0; --row) {
    write(row - 1, belief);
    if (!pass.back(row - 1, belief)) return Status::kOverflow;
  }
  std::copy_n(belief.x.data(), n, out.start_x);
  std::copy_n(belief.P.data(), n * n, out.start_P);
  return Status::kOk;
}

}  // namespace desk
}  // namespace auvest
