// A robust kernel chosen at run time, for Python.
#pragma once

#include "auvest/robust/hampel.hpp"
#include "auvest/robust/huber.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/unit.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct AnyKernel : Kernel<AnyKernel<Scalar_>, Scalar_> {
  using Scalar = Scalar_;
  enum class Kind : std::uint8_t { kUnit, kHuber, kHampel, kIgg };

  Kind kind = Kind::kUnit;
  Huber<Scalar> huber;
  Hampel<Scalar> hampel;
  Igg<Scalar> igg;

  AnyKernel() = default;
  explicit AnyKernel(const Unit<Scalar>&) {}
  explicit AnyKernel(const Huber<Scalar>& k) : kind(Kind::kHuber), huber(k) {}
  explicit AnyKernel(const Hampel<Scalar>& k) : kind(Kind::kHampel), hampel(k) {}
  explicit AnyKernel(const Igg<Scalar>& k) : kind(Kind::kIgg), igg(k) {}

  Scalar weight(Scalar t) const {
    switch (kind) {
      case Kind::kHuber:
        return huber.weight(t);
      case Kind::kHampel:
        return hampel.weight(t);
      case Kind::kIgg:
        return igg.weight(t);
      case Kind::kUnit:
        break;
    }
    return Unit<Scalar>().weight(t);
  }

  Scalar rho(Scalar t) const {
    switch (kind) {
      case Kind::kHuber:
        return huber.rho(t);
      case Kind::kHampel:
        return hampel.rho(t);
      case Kind::kIgg:
        return igg.rho(t);
      case Kind::kUnit:
        break;
    }
    return Unit<Scalar>().rho(t);
  }

  Status check() const {
    switch (kind) {
      case Kind::kHuber:
        return huber.check();
      case Kind::kHampel:
        return hampel.check();
      case Kind::kIgg:
        return igg.check();
      case Kind::kUnit:
        break;
    }
    return Status::kOk;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
