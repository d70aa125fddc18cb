// The M-estimation EKF (Li, Du, Fan, Chen, Mao, Luo 2020), with the recovery the paper lacks.
#pragma once

#include "auvest/filters/ekf.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/rejection_streak.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Process, class Kernel = Igg<typename Process::Scalar>,
          class Recovery = RejectionStreak<typename Process::Scalar>>
using RobustEkf = Robust<Ekf<Process>, RobustUpdate<Kernel, Recovery>>;

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
