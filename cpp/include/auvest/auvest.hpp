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
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/robust/hampel.hpp"
#include "auvest/robust/huber.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/unit.hpp"
#include "auvest/self_test.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/outage.hpp"
#include "auvest/slat/slatf.hpp"
