// What an update reports, whatever its size: the form in which filters put together at run time
// hand it on.
#pragma once

#include "auvest/robust/robust_correction.hpp"

namespace auvest {
namespace desk {

const int kMaxSize = 6;    ///< numbers in a measurement
const int kMaxInputs = 8;  ///< numbers that drive a process
const int kMaxPlace = 3;   ///< coordinates of a station or leader

/// As RobustCorrection; the first `size` elements count, S has `size` columns.
template <class Scalar>
struct Report {
  Status status;
  bool near_field = false;
  bool recovered = false;
  Decision decision = Decision::kAccepted;
  std::uint8_t iterations = 0;
  int size = 0;  ///< 0: nothing was measured
  Scalar nis = Scalar(0);
  Scalar innovation[kMaxSize];
  Scalar standardised[kMaxSize];
  Scalar weight[kMaxSize];
  Scalar S[kMaxSize * kMaxSize];

  explicit Report(Status s = Status::kOk) : status(s) {}

  // What does not count is not copied: that would take as long as a tenth of an update.
  Report(const Report& other) { *this = other; }
  Report& operator=(const Report& other) {
    status = other.status;
    near_field = other.near_field;
    recovered = other.recovered;
    decision = other.decision;
    iterations = other.iterations;
    size = other.size;
    nis = other.nis;
    for (int i = 0; i < size; ++i) {
      innovation[i] = other.innovation[i];
      standardised[i] = other.standardised[i];
      weight[i] = other.weight[i];
    }
    for (int i = 0; i < size * size; ++i) S[i] = other.S[i];
    return *this;
  }

  template <int M>
  explicit Report(const RobustCorrection<Scalar, M>& u)
      : status(u.status),
        near_field(u.near_field),
        recovered(u.recovered),
        decision(u.decision),
        iterations(u.iterations),
        size(M),
        nis(u.nis) {
    static_assert(M <= kMaxSize, "a measurement has at most 6 numbers");
    for (int i = 0; i < M; ++i) {
      innovation[i] = u.innovation(i);
      standardised[i] = u.standardised(i);
      weight[i] = u.weight(i);
      for (int j = 0; j < M; ++j) S[i * M + j] = u.S(i, j);
    }
  }
};

}  // namespace desk
}  // namespace auvest
