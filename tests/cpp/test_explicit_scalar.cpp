// The filters compile with a scalar that converts to nothing, and compute the bits of double.
#include "explicit_scalar.hpp"  // before the filters, which find its functions by overload

#include <doctest/doctest.h>

#include "auvest/auvest.hpp"

namespace {

template <class Scalar>
struct Tracker {
  using Process = auvest::ExactAcceleration<Scalar>;
  using Sonar = auvest::RangeBearing<Scalar, 6>;

  template <class Filter>
  static auvest::Vector<Scalar, 6> run(Filter filter) {
    auvest::Vector<Scalar, 6> x;
    auvest::Matrix<Scalar, 6, 6> P;
    const double start[6] = {3, -4, 0.2, 0.1, 0, 0.01};
    for (int i = 0; i < 6; ++i) {
      x(i) = Scalar(start[i]);
      for (int j = 0; j < 6; ++j) P(i, j) = Scalar(i == j ? 0.5 : 0.0);
    }
    REQUIRE(filter.reset(x, P) == auvest::Status::kOk);
    const Sonar sonar;
    for (int k = 0; k < 20; ++k) {
      REQUIRE(filter.predict(filter.interval()) == auvest::Status::kOk);
      auvest::Vector<Scalar, 2> z;
      z(0) = Scalar(6.6 + 0.05 * k);
      z(1) = Scalar(-1.1 + 0.01 * k);
      REQUIRE(filter.update(z, sonar).status == auvest::Status::kOk);
      auvest::Vector<Scalar, 2> reference;
      reference(0) = Scalar(3 + 0.1 * k);
      reference(1) = Scalar(-4 + 0.05 * k);
      REQUIRE(filter.feedback(reference) == auvest::Status::kOk);
    }
    return filter.x();
  }

  static auvest::Vector<Scalar, 6> aukf() {
    return run(auvest::Aukf<Process>(auvest::Ukf<Process>(Process())));
  }

  static auvest::Vector<Scalar, 6> budgeted_ekf() {
    using Policy = auvest::CovarianceBudget<Scalar>;
    return run(
        auvest::AdaptiveInterval<auvest::Ekf<Process>, Policy>(auvest::Ekf<Process>(Process())));
  }
};

TEST_CASE("explicit scalar: same bits as double") {
  const auto a = Tracker<ExplicitDouble>::aukf();
  const auto b = Tracker<double>::aukf();
  const auto c = Tracker<ExplicitDouble>::budgeted_ekf();
  const auto d = Tracker<double>::budgeted_ekf();
  for (int i = 0; i < 6; ++i) {
    CHECK(double(a(i)) == b(i));
    CHECK(double(c(i)) == d(i));
  }
}

}  // namespace
