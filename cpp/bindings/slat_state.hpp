// The state of a filter of slat/ as numbers: visitors of its visit_state() that keep them and that
// put them back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Scalar, int Pose>
class AnySlat;

/// In the order in which the filter visits them. Of particles the weights come first, then all
/// fields of one after the other: the same for all lanes.
template <class Scalar>
struct SlatState {
  std::vector<Scalar> numbers;
  std::vector<std::int64_t> counts;
};

template <class Scalar>
class StateKeeper {
 public:
  SlatState<Scalar> state;

  void operator()(const Scalar& number) { state.numbers.push_back(number); }
  template <int Rows, int Cols>
  void operator()(const Matrix<Scalar, Rows, Cols>& matrix) {
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Cols; ++j) (*this)(matrix(i, j));
    }
  }
  template <int N>
  void operator()(const Belief<Scalar, N>& belief) {
    (*this)(belief.x);
    (*this)(belief.P);
  }
  template <int Fields>
  void operator()(const ParticleSet<Scalar, Fields>& set) {
    count(set.size());
    const std::size_t more = static_cast<std::size_t>(set.size()) * (1 + Fields);
    state.numbers.reserve(state.numbers.size() + more);
    for (int i = 0; i < set.size(); ++i) (*this)(set.log_weights()[i]);
    for (int i = 0; i < set.size(); ++i) {
      for (int field = 0; field < Fields; ++field) (*this)(*set.at(i, field));
    }
  }
  template <int Pose>
  void operator()(const AnySlat<Scalar, Pose>& filter) {
    const SlatState<Scalar> inner = filter.state();
    state.numbers.insert(state.numbers.end(), inner.numbers.begin(), inner.numbers.end());
    state.counts.insert(state.counts.end(), inner.counts.begin(), inner.counts.end());
  }
  template <class Count>
  void count(Count value, Count = Count()) {
    state.counts.push_back(static_cast<std::int64_t>(value));
  }
};

/// Puts back what a StateKeeper kept. Where complete() is false, the numbers were not those of such
/// a filter, and the filter must not be used.
template <class Scalar>
class StateReturner {
 public:
  explicit StateReturner(const SlatState<Scalar>& state) : state_(state) {}

  bool complete() const {
    return fits_ && number_ == state_.numbers.size() && count_ == state_.counts.size();
  }

  void operator()(Scalar& number) {
    fits_ = fits_ && number_ < state_.numbers.size();
    if (fits_) number = state_.numbers[number_++];
  }
  template <int Rows, int Cols>
  void operator()(Matrix<Scalar, Rows, Cols>& matrix) {
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Cols; ++j) (*this)(matrix(i, j));
    }
  }
  template <int N>
  void operator()(Belief<Scalar, N>& belief) {
    (*this)(belief.x);
    (*this)(belief.P);
  }
  template <int Fields>
  void operator()(ParticleSet<Scalar, Fields>& set) {
    int size = 0;
    count(size, set.capacity());
    set.resize(size);
    for (int i = 0; i < size; ++i) (*this)(set.log_weight(i));
    for (int i = 0; i < size; ++i) {
      for (int field = 0; field < Fields; ++field) (*this)(*set.at(i, field));
    }
    if (size == 0) return;
    for (int i = size; place_in_block(i) != 0; ++i) set.log_weight(i) = no_log_weight<Scalar>();
    set.fill_block();
  }
  /// Takes all that is left.
  template <int Pose>
  void operator()(AnySlat<Scalar, Pose>& filter) {
    if (!fits_) return;
    SlatState<Scalar> inner;
    inner.numbers.assign(state_.numbers.begin() + static_cast<std::ptrdiff_t>(number_),
                         state_.numbers.end());
    inner.counts.assign(state_.counts.begin() + static_cast<std::ptrdiff_t>(count_),
                        state_.counts.end());
    fits_ = filter.restore(inner);
    number_ = state_.numbers.size();
    count_ = state_.counts.size();
  }
  /// 0..last
  template <class Count>
  void count(Count& value, Count last) {
    fits_ = fits_ && count_ < state_.counts.size() && state_.counts[count_] >= 0 &&
            state_.counts[count_] <= static_cast<std::int64_t>(last);
    if (fits_) value = static_cast<Count>(state_.counts[count_++]);
  }
  void count(int& value) { count(value, std::numeric_limits<int>::max()); }

 private:
  const SlatState<Scalar>& state_;
  std::size_t number_ = 0;
  std::size_t count_ = 0;
  bool fits_ = true;
};

}  // namespace auvest
