// An interval policy chosen at run time, for Python.
#pragma once

#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/intervals/mahalanobis_interval.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct AnyInterval {
  using Scalar = Scalar_;
  using Position = Vector<Scalar, 2>;
  enum class Kind : std::uint8_t { kFixed, kMahalanobis, kCovarianceBudget };

  Kind kind = Kind::kFixed;
  FixedInterval<Scalar> fixed;
  MahalanobisInterval<Scalar> mahalanobis;
  CovarianceBudget<Scalar> budget;

  Scalar initial() const {
    switch (kind) {
      case Kind::kMahalanobis:
        return mahalanobis.initial();
      case Kind::kCovarianceBudget:
        return budget.initial();
      case Kind::kFixed:
        break;
    }
    return fixed.initial();
  }

  void restart(const Position& estimate, const Position& reference) {
    mahalanobis.restart(estimate, reference);
  }

  template <class Filter>
  Scalar next(const Filter& filter, const Position& reference) {
    switch (kind) {
      case Kind::kMahalanobis:
        return mahalanobis.next(filter, reference);
      case Kind::kCovarianceBudget:
        return budget.next(filter, reference);
      case Kind::kFixed:
        break;
    }
    return fixed.next(filter, reference);
  }

  Status check() const {
    switch (kind) {
      case Kind::kMahalanobis:
        return mahalanobis.check();
      case Kind::kCovarianceBudget:
        return budget.check();
      case Kind::kFixed:
        break;
    }
    return fixed.check();
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
