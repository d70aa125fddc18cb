// The SLAT filters as the paper has them: no gate, and a covariance that the particles alone make.
#pragma once

#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/slatf_particle.hpp"

namespace slat_test {

template <class Scalar>
void switch_off_monte_carlo(auvest::SlatfParams<Scalar>& params) {
  params.monte_carlo = false;
}
template <class Params>
void switch_off_monte_carlo(Params&) {}

template <class Params>
Params paper(Params params = Params()) {
  params.gate = 0;
  switch_off_monte_carlo(params);
  return params;
}

/// An EKF-SLAT without a gate, unless it is told otherwise.
template <class Motion, class Master, int Masters>
struct OpenEkf : auvest::EkfSlat<Motion, Master, Masters> {
  using Base = auvest::EkfSlat<Motion, Master, Masters>;
  using Params = typename Base::Params;

  explicit OpenEkf(const Motion& motion = Motion(), const Master& master = Master(),
                   const Params& params = paper<Params>())
      : Base(motion, master, params) {}
};

}  // namespace slat_test
