// Whose echo is it? What all SLAT filters do with echoes of kUnknownMaster.
#include <doctest/doctest.h>

#include "close.hpp"
#include "gated.hpp"

#include <cmath>

namespace {

using namespace slat_test;
using auvest::Echo;
using auvest::kUnknownMaster;
using auvest::Status;

/// A filter with a master near (100, 150) and one far from it, after it heard `count` echoes.
template <class Filter>
struct Heard : Gated<Filter> {
  Heard(const Echo<float>* echoes, int count) {
    auvest::math::Random random(87);
    typename Filter::SlaveBelief start;
    start.x.setZero();
    start.P << 1, 0, 0, 1;
    REQUIRE(this->filter.reset(start, random) == Status::kOk);
    for (int n = 0; n < 2; ++n) {
      typename Filter::MasterBelief master;
      master.x << (n == 0 ? 100.0f : -400.0f), (n == 0 ? 150.0f : 50.0f), 2, 1, 0, 0;
      master.P = 0.01f * auvest::Matrix<float, 6, 6>::Identity();
      REQUIRE(this->filter.add_master(master) == Status::kOk);
    }
    REQUIRE(this->filter.update(echoes, count, auvest::Sonar<float>(), random) == Status::kOk);
  }
};

template <class Filter>
void check_same_masters(const Filter& a, const Filter& b) {
  for (int n = 0; n < 2; ++n) {
    const auto expected = a.master(n);
    const auto master = b.master(n);
    for (int i = 0; i < 6; ++i) {
      CHECK(std::fabs(master.x(i) - expected.x(i)) < 1e-4f);
      CHECK(master.P(i, i) == close_to(static_cast<double>(expected.P(i, i)), 1e-4));
    }
  }
}

TEST_CASE_TEMPLATE("association: of two echoes from one place the master there has one", Filter,
                   FloatSlatf1<2>, FloatSlatf2<2>, FloatJoint<2>, FloatEkf<2>) {
  // The other falls to the far master, whose gate refuses it. No matter which of them is named.
  Echo<float> echo;
  echo.z << 180.5f, -2.16f;
  echo.master = 0;
  Echo<float> unknown = echo;
  unknown.master = kUnknownMaster;
  const Echo<float> two_unknown[2] = {unknown, unknown};
  const Echo<float> named_first[2] = {echo, unknown};
  const Echo<float> named_last[2] = {unknown, echo};
  const Heard<Filter> once(&echo, 1);
  CHECK(once.filter.master(0).P(0, 0) < 0.01f);
  check_same_masters(once.filter, Heard<Filter>(&unknown, 1).filter);
  check_same_masters(once.filter, Heard<Filter>(two_unknown, 2).filter);
  check_same_masters(once.filter, Heard<Filter>(named_first, 2).filter);
  check_same_masters(once.filter, Heard<Filter>(named_last, 2).filter);
}

}  // namespace
