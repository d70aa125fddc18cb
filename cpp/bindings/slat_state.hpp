// The state of a filter of slat/ as numbers: visitors of its visit_state() that keep them and that
// put them back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "auvest/math/basic.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/particles/particle_set.hpp"
#include "auvest/types.hpp"
#include "slat_interface.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar, int Pose>
class AnySlat;

/// Counts the numbers, and keeps them where there is an array for them.
template <class Scalar>
class StateKeeper {
 public:
  explicit StateKeeper(bindings::SlatState<Scalar>& state) : state_(state) {
    state.number_count = 0;
    state.count_count = 0;
  }

  void operator()(const Scalar& number) {
    if (state_.numbers != nullptr) state_.numbers[state_.number_count] = number;
    ++state_.number_count;
  }
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
    for (int i = 0; i < set.size(); ++i) (*this)(set.log_weights()[i]);
    for (int i = 0; i < set.size(); ++i) {
      for (int field = 0; field < Fields; ++field) (*this)(*set.at(i, field));
    }
  }
  template <int Pose>
  void operator()(const AnySlat<Scalar, Pose>& filter) {
    bindings::SlatState<Scalar> inner = {};
    if (state_.numbers != nullptr) {
      inner.numbers = state_.numbers + state_.number_count;
      inner.counts = state_.counts + state_.count_count;
    }
    filter.save(inner);
    state_.number_count += inner.number_count;
    state_.count_count += inner.count_count;
  }
  template <class Count>
  void count(Count value, Count = Count()) {
    if (state_.counts != nullptr) {
      state_.counts[state_.count_count] = static_cast<std::int64_t>(value);
    }
    ++state_.count_count;
  }

 private:
  bindings::SlatState<Scalar>& state_;
};

/// Puts back what a StateKeeper kept. Where complete() is false, the numbers were not those of such
/// a filter, and the filter must not be used.
template <class Scalar>
class StateReturner {
 public:
  explicit StateReturner(const bindings::SlatStateView<Scalar>& state) : state_(state) {}

  bool complete() const {
    return fits_ && number_ == state_.number_count && count_ == state_.count_count;
  }

  void operator()(Scalar& number) {
    fits_ = fits_ && number_ < state_.number_count && math::is_finite(state_.numbers[number_]);
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
    fits_ = filter.restore({state_.numbers + number_, state_.number_count - number_,
                            state_.counts + count_, state_.count_count - count_});
    number_ = state_.number_count;
    count_ = state_.count_count;
  }
  /// 0..last
  template <class Count>
  void count(Count& value, Count last) {
    fits_ = fits_ && count_ < state_.count_count && state_.counts[count_] >= 0 &&
            state_.counts[count_] <= static_cast<std::int64_t>(last);
    if (fits_) value = static_cast<Count>(state_.counts[count_++]);
  }
  void count(int& value) { count(value, std::numeric_limits<int>::max()); }

 private:
  const bindings::SlatStateView<Scalar> state_;
  std::size_t number_ = 0;
  std::size_t count_ = 0;
  bool fits_ = true;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
