// How a Gaussian filter linearises, chosen at run time: the EKF's Jacobians, a UKF's or a CKF's
// points.
#pragma once

#include <cstdint>

#include "auvest/filters/ckf.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"

/// Every kind once: X(name, the filter of that kind over a process). What runs every filter reads
/// this.
#define AUVEST_LINEARISATIONS(X) \
  X(kEkf, Ekf)                   \
  X(kUkf, Ukf)                   \
  X(kCkf, Ckf)

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_>
struct AnyLinearisation {
  using Scalar = Scalar_;
#define AUVEST_KIND(name, filter) name,
  enum class Kind : std::uint8_t { AUVEST_LINEARISATIONS(AUVEST_KIND) };
#undef AUVEST_KIND

  Kind kind;
  SigmaPoints<Scalar> unscented;
  CubaturePoints<Scalar> cubature;

  AnyLinearisation(Kind k, const typename SigmaPoints<Scalar>::Params& params, int states)
      : kind(k), unscented(params, states), cubature(states) {}

  Status check() const { return kind == Kind::kUkf ? unscented.status : Status::kOk; }

  template <class Process, int N>
  Status predict(const Process& process, Belief<Scalar, N>& belief, Scalar dt) const {
    if (kind == Kind::kUkf) {
      return predict_by_points(unscented, process, belief, dt, IsLinear<Process::kLinear>());
    }
    if (kind == Kind::kCkf) {
      return predict_by_points(cubature, process, belief, dt, IsLinear<Process::kLinear>());
    }
    process.propagate(belief, dt);
    return Status::kOk;
  }

  template <class Model, class Point>
  Status linearise(const Model& model, const Point& point,
                   const Matrix<Scalar, Model::kObserved, Model::kObserved>& root,
                   const typename Model::Measurement& z, typename Model::Measurement& innovation,
                   Matrix<Scalar, Model::kSize, Model::kObserved>& a,
                   typename Model::Noise& noise) const {
    if (kind == Kind::kUkf) {
      return linearise_by_points(unscented, model, point, root, z, innovation, a, noise);
    }
    if (kind == Kind::kCkf) {
      return linearise_by_points(cubature, model, point, root, z, innovation, a, noise);
    }
    linearise_by_jacobian(model, point, root, z, innovation, a, noise);
    return Status::kOk;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
