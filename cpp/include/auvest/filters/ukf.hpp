// Unscented Kalman filter in deviation form (derived in docs/algorithms/ukf.md): the points of
// sigma_points.hpp in the frame of sigma_point_filter.hpp.
#pragma once

#include "auvest/filters/sigma_point_filter.hpp"
#include "auvest/filters/sigma_points.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Process>
class Ukf : public SigmaPointFilter<Process, SigmaPoints<typename Process::Scalar>> {
 public:
  using Base = SigmaPointFilter<Process, SigmaPoints<typename Process::Scalar>>;
  using typename Base::Scalar;
  using Params = typename SigmaPoints<Scalar>::Params;

  explicit Ukf(const Process& process = Process(), const Params& params = default_params())
      : Base(process, SigmaPoints<Scalar>(params, Process::kStates)) {}

  /// Params() with kappa = 3 - n, which matches the fourth moments of a Gaussian.
  static Params default_params() {
    Params params;
    params.kappa = Scalar(3 - Process::kStates);
    return params;
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
