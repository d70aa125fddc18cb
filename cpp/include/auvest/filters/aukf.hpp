// AUKF: the unscented filter that chooses its own sampling interval (Deng, Yin, Duan 2019).
#pragma once

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/intervals/mahalanobis_interval.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// AUKF = UKF + interval policy; the default policy is the paper's law.
template <class Process, class Policy = MahalanobisInterval<typename Process::Scalar>>
using Aukf = AdaptiveInterval<Ukf<Process>, Policy>;

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
