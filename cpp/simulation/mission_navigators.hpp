// Where the position in a mission comes from: the last fix, the UKF, or the model-aided filter. One
// struct each, in the precision of the vehicle.
#pragma once

#include <limits>

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/math/trigonometry.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/speed_heading_current.hpp"
#include "auvest/robust/robust_update.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_recovery.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"
#include "simulation/mission_scenario.hpp"
#include "simulation/vehicle_sensors.hpp"

namespace auvest {
namespace mission_detail {

/// v' P^-1 v by elimination, P given by its lower triangle.
template <int N>
double mahalanobis_squared(const Vector<double, N>& v, Matrix<double, N, N> p) {
  Vector<double, N> inverse;
  math::mirror_lower(p);
  if (!math::ldlt(p.data(), N, 0.0, inverse.data())) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  double sum = 0;
  Vector<double, N> y;
  for (int i = 0; i < N; ++i) {
    y(i) = v(i);
    for (int k = 0; k < i; ++k) y(i) -= p(i, k) * y(k);
    sum += y(i) * y(i) * inverse(i);
  }
  return sum;
}

/// What the loop asks of an estimate, and what one without a filter answers.
template <class Scalar>
struct Navigator {
  Scalar x = Scalar(0), y = Scalar(0);
  Scalar current[2] = {Scalar(0), Scalar(0)};
  double nis = std::numeric_limits<double>::quiet_NaN();

  Status predict(Scalar, const Vector<Scalar, 3>&) { return Status::kOk; }
  Status feedback(const Vector<Scalar, 2>&) { return Status::kOk; }
  void judge(const VehicleTruth&, const double*, double& position, double& all) const {
    position = all = std::numeric_limits<double>::quiet_NaN();
  }
};

/// The last fix, as it is.
template <class Scalar>
struct FixNavigator : Navigator<Scalar> {
  Scalar fixed_interval;

  FixNavigator(const MissionScenario& s, const double* start, double)
      : fixed_interval(Scalar(s.interval.initial())) {
    this->x = Scalar(start[0]);
    this->y = Scalar(start[1]);
  }
  Status check() const { return Status::kOk; }

  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar) {
    if (!math::all_finite(z)) return Status::kNotFinite;
    Scalar sine, cosine;
    math::sincos(z(1), sine, cosine);
    this->x = Scalar(usbl.station_m[0]) + z(0) * cosine;
    this->y = Scalar(usbl.station_m[1]) + z(0) * sine;
    return Status::kOk;
  }
  Scalar interval() const { return fixed_interval; }
};

/// The policy, kernel and recovery of a scenario in the precision of the vehicle.
template <class Scalar>
AnyInterval<Scalar> interval_as(const AnyInterval<double>& from) {
  AnyInterval<Scalar> to;
  to.kind = static_cast<typename AnyInterval<Scalar>::Kind>(from.kind);
  to.fixed.params.interval_s = Scalar(from.fixed.params.interval_s);
  const auto& law = from.mahalanobis.params;
  typename MahalanobisInterval<Scalar>::Params m;
  m.initial_s = Scalar(law.initial_s);
  m.min_s = Scalar(law.min_s);
  m.max_s = Scalar(law.max_s);
  m.tau0 = Scalar(law.tau0);
  m.scale = Scalar(law.scale);
  m.epsilon = Scalar(law.epsilon);
  m.gamma1_m2 = Scalar(law.gamma1_m2);
  m.gamma2 = Scalar(law.gamma2);
  m.ratio_max = Scalar(law.ratio_max);
  m.tau_min = Scalar(law.tau_min);
  m.tau_max = Scalar(law.tau_max);
  to.mahalanobis = MahalanobisInterval<Scalar>(m);
  const auto& budget = from.budget.params;
  to.budget.params.initial_s = Scalar(budget.initial_s);
  to.budget.params.min_s = Scalar(budget.min_s);
  to.budget.params.max_s = Scalar(budget.max_s);
  to.budget.params.position_sigma_m = Scalar(budget.position_sigma_m);
  return to;
}

template <class Scalar>
RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>> rule_as(const MissionScenario& s) {
  AnyKernel<Scalar> kernel;
  kernel.kind = static_cast<typename AnyKernel<Scalar>::Kind>(s.kernel.kind);
  kernel.huber.params.k = Scalar(s.kernel.huber.params.k);
  kernel.hampel.params.a = Scalar(s.kernel.hampel.params.a);
  kernel.hampel.params.b = Scalar(s.kernel.hampel.params.b);
  kernel.hampel.params.c = Scalar(s.kernel.hampel.params.c);
  kernel.igg.params.k0 = Scalar(s.kernel.igg.params.k0);
  kernel.igg.params.k1 = Scalar(s.kernel.igg.params.k1);
  AnyRecovery<Scalar> recovery;
  recovery.enabled = s.recovery.enabled;
  recovery.streak.params.rejections = s.recovery.streak.params.rejections;
  return RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>>(kernel, recovery);
}

template <class Scalar, int N>
RangeBearing<Scalar, N> sonar_as(const UsblDevice& usbl) {
  typename RangeBearing<Scalar, N>::Params p;
  p.station_x_m = Scalar(usbl.station_m[0]);
  p.station_y_m = Scalar(usbl.station_m[1]);
  p.sigma_range_m = Scalar(usbl.noise_m);
  p.sigma_bearing_rad = Scalar(usbl.noise_rad);
  p.lift_smallest();  // the noise may take the range below 0
  return RangeBearing<Scalar, N>(p);
}

/// A filter of the position, with kernel, recovery and interval policy. A fix that is late by the
/// clocks of the scenario is taken at the time at which it was valid.
template <class Scalar, class Core>
struct FilterNavigator : Navigator<Scalar> {
  static const int kStates = Core::Process::kStates;
  using Plain = Robust<Core, RobustUpdate<AnyKernel<Scalar>, AnyRecovery<Scalar>>>;
  using Filter = AdaptiveInterval<Plain, AnyInterval<Scalar>>;
  using Sonar = RangeBearing<Scalar, kStates>;
  /// Predictions and fixes of the last 6 s.
  using Memory = LateMemory<Plain, Sonar, EventArray<LateEvent<Plain, Sonar>, 64>>;

  Filter filter;
  Status started;
  bool late;
  Memory memory;

  FilterNavigator(const MissionScenario& s, const Core& core, const double (&x0)[kStates],
                  const double (&deviations)[kStates])
      : filter(Plain(core, rule_as<Scalar>(s)), interval_as<Scalar>(s.interval)),
        started(start(x0, deviations)),
        late(s.usbl.sound_m_s > 0 || s.usbl_timing.latency_s > 0),
        memory(filter) {}

  Status check() const { return started; }
  Scalar interval() const { return filter.interval(); }
  Status feedback(const Vector<Scalar, 2>& reference) { return filter.feedback(reference); }

  Status predict(Scalar dt, const Vector<Scalar, 3>& input) {
    const Status status = late ? memory.predict(filter, dt, input) : filter.predict(dt, input);
    read();
    return status;
  }

  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar age) {
    const Sonar sonar = sonar_as<Scalar, kStates>(usbl);
    const auto correction = late ? memory.update(filter, z, sonar, age) : filter.update(z, sonar);
    this->nis = static_cast<double>(correction.nis);
    read();
    return correction.status;
  }

  void read() {
    this->x = filter.x()(0);
    this->y = filter.x()(1);
  }

  /// Against the true position and, by the last two of four numbers, `rates`.
  void judge(const VehicleTruth& truth, const double* rates, double& position, double& all) const {
    Vector<double, 4> error;
    Matrix<double, 4, 4> p;
    Vector<double, 2> place;
    Matrix<double, 2, 2> block;
    for (int i = 0; i < 4; ++i) {
      const double is = i < 2 ? truth.pose[i] : rates[i - 2];
      error(i) = static_cast<double>(filter.belief().x(i)) - is;
      for (int j = 0; j <= i; ++j) p(i, j) = static_cast<double>(filter.belief().P(i, j));
    }
    for (int i = 0; i < 2; ++i) {
      place(i) = error(i);
      for (int j = 0; j <= i; ++j) block(i, j) = p(i, j);
    }
    position = mahalanobis_squared(place, block);
    all = mahalanobis_squared(error, p);
  }

 private:
  Status start(const double (&x0)[kStates], const double (&deviations)[kStates]) {
    typename Filter::State mean;
    typename Filter::Covariance p;
    math::set_zero(p);
    for (int i = 0; i < kStates; ++i) {
      mean(i) = Scalar(x0[i]);
      p(i, i) = Scalar(deviations[i] * deviations[i]);
    }
    const Status status = filter.reset(mean, p);
    read();
    return status;
  }
};

/// Constant acceleration, which looks at nothing that drives it.
template <class Scalar>
struct FreeAcceleration : ExactAcceleration<Scalar> {
  using Input = Vector<Scalar, 3>;
  Input input;

  explicit FreeAcceleration(const AccelerationNoise<Scalar>& noise)
      : ExactAcceleration<Scalar>(noise) {
    math::set_zero(input);
  }
};

template <class Scalar>
struct UkfNavigator : FilterNavigator<Scalar, Ukf<FreeAcceleration<Scalar>>> {
  using Process = FreeAcceleration<Scalar>;
  using Base = FilterNavigator<Scalar, Ukf<Process>>;

  static Process process(const MissionScenario& s) {
    AccelerationNoise<Scalar> noise;
    noise.acceleration = Scalar(s.acceleration_psd);
    return Process(noise);
  }

  UkfNavigator(const MissionScenario& s, const double* start, double heading)
      : Base(s, Ukf<Process>(process(s)),
             {start[0], start[1], s.speed_m_s * math::cos(heading),
              s.speed_m_s * math::sin(heading), 0, 0},
             {1, 1, 0.5, 0.5, 0.1, 0.1}) {}

  /// The truth has position and velocity over ground.
  void judge(const VehicleTruth& truth, const double*, double& position, double& all) const {
    Base::judge(truth, truth.velocity, position, all);
  }
};

template <class Scalar>
struct ModelAidedNavigator : FilterNavigator<Scalar, Ekf<SpeedHeadingCurrent<Scalar>>> {
  using Process = SpeedHeadingCurrent<Scalar>;
  using Base = FilterNavigator<Scalar, Ekf<Process>>;

  static Process process(const MissionScenario& s) {
    typename Process::Params p;
    p.position = Scalar(s.model.position);
    p.current = Scalar(s.model.current);
    return Process(p);
  }

  ModelAidedNavigator(const MissionScenario& s, const double* start, double)
      : Base(s, Ekf<Process>(process(s)), {start[0], start[1], 0, 0}, {1, 1, 0.3, 0.3}) {}

  Status predict(Scalar dt, const Vector<Scalar, 3>& input) {
    const Status status = Base::predict(dt, input);
    read_current();
    return status;
  }
  Status update(const Vector<Scalar, 2>& z, const UsblDevice& usbl, Scalar age) {
    const Status status = Base::update(z, usbl, age);
    read_current();
    return status;
  }

 private:
  void read_current() {
    this->current[0] = this->filter.x()(2);
    this->current[1] = this->filter.x()(3);
  }
};

}  // namespace mission_detail
}  // namespace auvest
