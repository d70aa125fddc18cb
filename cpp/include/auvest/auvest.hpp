// auvest: estimators for small autonomous underwater vehicles. Everything, in one include.
#pragma once

#include "auvest/config.hpp"  // first: it says what is wrong with a compiler

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/aukf.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/intervals/mahalanobis_interval.hpp"
#include "auvest/math/random.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/linear.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/self_test.hpp"
