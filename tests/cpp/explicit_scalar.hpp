// A scalar without implicit conversions: code that compiles with it mixes no types, so a float
// instance holds no hidden double arithmetic and no double literal.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>

#include "auvest/math/angle.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/resolution.hpp"
#include "auvest/math/trigonometry.hpp"

class ExplicitDouble {
 public:
  ExplicitDouble() = default;
  explicit constexpr ExplicitDouble(double value) : value_(value) {}
  explicit constexpr ExplicitDouble(int value) : value_(value) {}
  explicit constexpr operator double() const { return value_; }

  friend ExplicitDouble operator+(ExplicitDouble a, ExplicitDouble b) {
    return ExplicitDouble(a.value_ + b.value_);
  }
  friend ExplicitDouble operator-(ExplicitDouble a, ExplicitDouble b) {
    return ExplicitDouble(a.value_ - b.value_);
  }
  friend ExplicitDouble operator*(ExplicitDouble a, ExplicitDouble b) {
    return ExplicitDouble(a.value_ * b.value_);
  }
  friend ExplicitDouble operator/(ExplicitDouble a, ExplicitDouble b) {
    return ExplicitDouble(a.value_ / b.value_);
  }
  ExplicitDouble operator-() const { return ExplicitDouble(-value_); }
  ExplicitDouble& operator+=(ExplicitDouble b) { return *this = *this + b; }
  ExplicitDouble& operator-=(ExplicitDouble b) { return *this = *this - b; }
  ExplicitDouble& operator*=(ExplicitDouble b) { return *this = *this * b; }
  ExplicitDouble& operator/=(ExplicitDouble b) { return *this = *this / b; }
  friend bool operator<(ExplicitDouble a, ExplicitDouble b) { return a.value_ < b.value_; }
  friend bool operator>(ExplicitDouble a, ExplicitDouble b) { return a.value_ > b.value_; }
  friend bool operator<=(ExplicitDouble a, ExplicitDouble b) { return a.value_ <= b.value_; }
  friend bool operator>=(ExplicitDouble a, ExplicitDouble b) { return a.value_ >= b.value_; }
  friend bool operator==(ExplicitDouble a, ExplicitDouble b) { return a.value_ == b.value_; }
  friend bool operator!=(ExplicitDouble a, ExplicitDouble b) { return a.value_ != b.value_; }

 private:
  double value_;
};

namespace std {
template <>
class numeric_limits<ExplicitDouble> : public numeric_limits<double> {
 public:
  static constexpr ExplicitDouble epsilon() {
    return ExplicitDouble(numeric_limits<double>::epsilon());
  }
  static constexpr ExplicitDouble min() { return ExplicitDouble(numeric_limits<double>::min()); }
  static constexpr ExplicitDouble max() { return ExplicitDouble(numeric_limits<double>::max()); }
};
}  // namespace std

namespace Eigen {
template <>
struct NumTraits<ExplicitDouble> : NumTraits<double> {
  using Real = ExplicitDouble;
  using NonInteger = ExplicitDouble;
  using Nested = ExplicitDouble;
  using Literal = ExplicitDouble;
};
}  // namespace Eigen

// A scalar brings its own elementary functions; auvest finds them where its overloads are.
namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace math {

inline ExplicitDouble exp(ExplicitDouble x) { return ExplicitDouble(exp(double(x))); }
inline ExplicitDouble log(ExplicitDouble x) { return ExplicitDouble(log(double(x))); }
inline ExplicitDouble exp_normal(ExplicitDouble x) { return exp(x); }
inline ExplicitDouble log_normal(ExplicitDouble x) { return log(x); }
inline bool may_be_coarse(ExplicitDouble square) { return may_be_coarse(double(square)); }
inline bool is_coarse(ExplicitDouble x, ExplicitDouble variance) {
  return is_coarse(double(x), double(variance));
}
inline ExplicitDouble sqrt(ExplicitDouble x) { return ExplicitDouble(sqrt(double(x))); }
inline ExplicitDouble absolute(ExplicitDouble x) { return ExplicitDouble(absolute(double(x))); }
inline ExplicitDouble copy_sign(ExplicitDouble x, ExplicitDouble y) {
  return ExplicitDouble(copy_sign(double(x), double(y)));
}
inline bool is_finite(ExplicitDouble x) { return is_finite(double(x)); }
inline ExplicitDouble wrap(ExplicitDouble x) { return ExplicitDouble(wrap(double(x))); }
inline ExplicitDouble atan2(ExplicitDouble y, ExplicitDouble x) {
  return ExplicitDouble(atan2(double(y), double(x)));
}
inline void sincos(ExplicitDouble x, ExplicitDouble& s, ExplicitDouble& c) {
  double sine = 0;
  double cosine = 0;
  sincos(double(x), sine, cosine);
  s = ExplicitDouble(sine);
  c = ExplicitDouble(cosine);
}
inline void sincos_near(ExplicitDouble x, ExplicitDouble& s, ExplicitDouble& c) { sincos(x, s, c); }

}  // namespace math
}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
