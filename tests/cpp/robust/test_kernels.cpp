// One suite for every kernel: registering a line below checks it against its closed form.
#include <doctest/doctest.h>

#include "close.hpp"

#include <cmath>
#include <initializer_list>
#include <limits>

#include "auvest/robust/hampel.hpp"
#include "auvest/robust/huber.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/unit.hpp"

namespace {

using auvest::Status;
using Hampel = auvest::Hampel<double>;
using Huber = auvest::Huber<double>;
using Igg = auvest::Igg<double>;
using Unit = auvest::Unit<double>;

const double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

Huber huber(double k) {
  Huber::Params p;
  p.k = k;
  return Huber(p);
}

Igg igg(double k0, double k1) {
  Igg::Params p;
  p.k0 = k0;
  p.k1 = k1;
  return Igg(p);
}

Hampel hampel(double a, double b, double c) {
  Hampel::Params p;
  p.a = a;
  p.b = b;
  p.c = c;
  return Hampel(p);
}

/// `influence(t)` is psi for t >= 0, written from the definition; `jump` is where it is not
/// continuous, and rho has no derivative.
template <class Kernel, class Influence>
void check_kernel(const Kernel& kernel, const Influence& influence, double jump = kInfinity) {
  REQUIRE(kernel.check() == Status::kOk);
  CHECK(kernel.weight(0) == 1);
  CHECK(kernel.psi(0) == 0);
  CHECK(kernel.rho(0) == 0);
  const double step = 1e-5;
  for (int i = 1; i <= 1200; ++i) {
    const double t = 0.01 * i + 0.0037;  // never at a threshold
    CHECK(std::fabs(kernel.psi(t) - influence(t)) < 1e-14);
    CHECK(std::fabs(kernel.weight(t) - influence(t) / t) < 1e-14);
    CHECK(kernel.weight(-t) == kernel.weight(t));
    CHECK(kernel.psi(-t) == -kernel.psi(t));
    CHECK(kernel.rho(-t) == kernel.rho(t));
    CHECK(std::fabs((kernel.rho(t + step) - kernel.rho(t - step)) / (2 * step) - influence(t)) <
          1e-8);
    // Neither psi nor rho jumps anywhere else: |psi'| <= 1, and rho' = psi is at most t.
    if (std::fabs(t - jump) > 0.01) {
      CHECK(std::fabs(kernel.psi(t + 0.01) - kernel.psi(t)) < 0.0101);
    }
    CHECK(std::fabs(kernel.rho(t + 0.01) - kernel.rho(t)) < 0.0101 * (t + 0.01));
  }
}

TEST_CASE("kernels: weight, rho and psi against their closed forms") {
  check_kernel(Unit(), [](double t) { return t; });
  check_kernel(Huber(), [](double t) { return t < 1.345 ? t : 1.345; });
  check_kernel(huber(3), [](double t) { return t < 3 ? t : 3.0; });
  check_kernel(
      Igg(), [](double t) { return t < 1.5 ? t
                                   : t < 3 ? 1.5
                                           : 0.0; }, 3);
  check_kernel(
      igg(2, 2.5), [](double t) { return t < 2     ? t
                                         : t < 2.5 ? 2.0
                                                   : 0.0; }, 2.5);
  check_kernel(Hampel(), [](double t) {
    return t < 1.7 ? t : t < 3.4 ? 1.7 : t < 8.5 ? 1.7 * (8.5 - t) / (8.5 - 3.4) : 0.0;
  });
  check_kernel(hampel(1, 2, 4), [](double t) {
    return t < 1 ? t : t < 2 ? 1.0 : t < 4 ? (4 - t) / 2 : 0.0;
  });
}

TEST_CASE("kernels: a threshold belongs to the segment above it, as in Eq. (20)") {
  CHECK(Igg().weight(1.5) == 1);  // 1.5 / 1.5
  CHECK(Igg().weight(3) == 0);
  CHECK(Igg().weight(std::nextafter(3.0, 0.0)) == close_to(0.5, 1e-15));
  CHECK(Hampel().weight(3.4) == 0.5);
  CHECK(Hampel().weight(8.5) == 0);
  CHECK(Huber().weight(2.69) == 0.5);
}

TEST_CASE("kernels: with infinite thresholds all are the unit kernel") {
  for (const double t : {0.1, 3.0, 1e6, 1e300}) {
    CHECK(huber(kInfinity).weight(t) == 1);
    CHECK(igg(kInfinity, kInfinity).weight(t) == 1);
    CHECK(hampel(kInfinity, kInfinity, kInfinity).weight(t) == 1);
  }
  CHECK(igg(1.5, kInfinity).weight(7) == huber(1.5).weight(7));
  CHECK(hampel(1.5, kInfinity, kInfinity).weight(7) == huber(1.5).weight(7));
  CHECK(hampel(1.5, 3, 3).weight(2.9) == igg(1.5, 3).weight(2.9));
  CHECK(hampel(1.5, 3, 3).weight(3.1) == 0);
  CHECK(hampel(1.5, 3, 3).rho(7) == igg(1.5, 3).rho(7));
}

TEST_CASE("kernels refuse bad thresholds") {
  CHECK(igg(1.5, 1.5).check() == Status::kOk);
  CHECK(hampel(1, kInfinity, kInfinity).check() == Status::kOk);
  CHECK(huber(kInfinity).check() == Status::kOk);
  for (const double k : {0.0, -1.0, 1e-310, kNan}) {
    CHECK(huber(k).check() == Status::kBadParameter);
    CHECK(igg(k, 3).check() == Status::kBadParameter);
    CHECK(hampel(k, 3, 8).check() == Status::kBadParameter);
  }
  CHECK(igg(1.5, 1.4).check() == Status::kBadParameter);
  CHECK(igg(1.5, kNan).check() == Status::kBadParameter);
  CHECK(hampel(2, 1, 8).check() == Status::kBadParameter);
  CHECK(hampel(2, 3, 2.5).check() == Status::kBadParameter);
  CHECK(hampel(2, 3, kNan).check() == Status::kBadParameter);
  CHECK(hampel(2, 3, kInfinity).check() == Status::kBadParameter);  // its slope would be 0
}

}  // namespace
