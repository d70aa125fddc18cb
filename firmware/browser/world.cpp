// What surrounds the chip in the page: vehicle, sensors and their errors, and the estimators of the
// sketches beside it, fed the same lines: every number that the chip sends must have the same bits.
//
// All of it is the desk's C++ (cpp/simulation, cpp/include) as WebAssembly. Numbers, words and text
// go through three arrays of this memory; world.mjs has the names of what is in them. The sketches'
// settings are those of their own files.
#include <stdint.h>

#include <cstddef>

#include "auvest/auvest.hpp"
#include "auvest/self_test.hpp"
#include "simulation/mission.hpp"
#include "simulation/tracking.hpp"
#include "simulation/vehicle_sensors.hpp"

// What the sketches' settings include, under the name that the IDE gives it.
#include <auvest.h>

namespace tracking_sketch {
#include "tracking_loop/config.h"
}
namespace mission_sketch {
#include "mission/config.h"
#include "mission/plan.h"
}  // namespace mission_sketch

#define AUVEST_PAGE(name) extern "C" __attribute__((export_name(#name)))

namespace {

using namespace auvest;

double numbers[16];
uint32_t words[16];
char text[64];

void show(int i, float value) { words[i] = math::to_bits(value); }

/// A value that is set at once or, while a vehicle is under way, moves there: nothing may jump.
class Gradual {
 public:
  explicit Gradual(double per_second) : per_second_(per_second) {}

  void aim_at(double target) { target_ = target; }
  double after(double dt) {
    const double most = per_second_ * dt;
    const double missing = target_ - value_;
    value_ += missing > most ? most : missing < -most ? -most : missing;
    return value_;
  }

 private:
  double per_second_, value_ = 0, target_ = 0;
};

// ---- The vehicle that is tracked
// -----------------------------------------------------------------

/// It moves beside the desired track, and a sonar at the station measures it.
class TrackedVehicle {
 public:
  explicit TrackedVehicle(uint64_t seed) : random_(seed, 0), wander_(0.1) {
    desired_.kind = Track::Kind::kStraight;
  }

  void set(double noise, double outliers, double wander_m) {
    const SensorNoise paper;
    noise_.range_m = noise * paper.range_m;
    noise_.bearing_rad = noise * paper.bearing_rad;
    outliers_ = outliers;
    wander_.aim_at(wander_m);
  }

  /// Numbers: the vehicle, the desired position, range, bearing, and how far it is; returns whether
  /// the range is an outlier.
  bool measure(double time_s) {
    const double dt = time_s - time_s_;
    time_s_ = time_s;
    desired_.advance(dt);
    Track beside = desired_;
    beside.wander_m = wander_.after(dt);
    double offset[2];
    beside.desired(time_s, offset);
    const RangeBearing<double, 6>::Params station;
    double error_m, error_rad;
    bool missing;
    noise_.draw(random_, error_m, error_rad, missing);
    const double late_m = late_outlier(random_, outliers_, kOutlier);
    for (int i = 0; i < 2; ++i) {
      numbers[i] = 2 * desired_.position[i] - offset[i];
      numbers[2 + i] = desired_.position[i];
    }
    const double dx = numbers[0] - station.station_x_m;
    const double dy = numbers[1] - station.station_y_m;
    const double distance = math::sqrt(dx * dx + dy * dy);
    numbers[4] = distance + error_m + late_m;
    numbers[5] = math::wrap(math::atan2(dy, dx) + error_rad);
    numbers[6] = distance;
    return late_m > 0;
  }

 private:
  static constexpr double kOutlier = 5;  // mean [m]

  math::Random random_;
  Track desired_;
  SensorNoise noise_;
  Gradual wander_;
  double outliers_ = 0;
  double time_s_ = 0;
};

/// The estimator of the sketch tracking_loop.
class TrackingTwin {
 public:
  virtual ~TrackingTwin() = default;

  /// The sample's number; words: its time in ticks, what is predicted over; text: the answer, if
  /// there is one. Words then: x, y, vx, vy, ax, ay, P00, P10, P11, NIS, interval, status.
  virtual void step(uint32_t sample, bool measured) = 0;
};

template <class Policy>
class PolicyTwin final : public TrackingTwin {
  using Process = tracking_sketch::Process;
  using Filter = AdaptiveInterval<Gated<Ukf<Process>>, Policy>;

 public:
  PolicyTwin() : filter_(Process(), points()), model_(sonar()) {
    typename Filter::State x;
    x << 0.2f, 2.0f, 0.1f, 0.2f, 0.01f, 0.02f;
    const float sigma[] = {0.05f, 0.05f, 0.02f, 0.02f, 0.005f, 0.005f};
    typename Filter::Covariance P = Filter::Covariance::Zero();
    for (int i = 0; i < 6; ++i) P(i, i) = sigma[i] * sigma[i];
    filter_.reset(x, P);
  }

  void step(uint32_t sample, bool measured) override {
    const uint32_t ticks = words[0];
    const float dt = math::from_bits(words[1]);
    status_ = filter_.predict(dt);
    nis_ = -1;
    range_.wait(dt);
    float z[2];
    if (measured && read_answer(text, "SONAR", sample, z)) update(z);
    note(filter_.feedback(desired(seconds_of(ticks))));
    for (int i = 0; i < 6; ++i) show(i, filter_.x()(i));
    show(6, filter_.belief().P(0, 0));
    show(7, filter_.belief().P(1, 0));
    show(8, filter_.belief().P(1, 1));
    show(9, nis_);
    show(10, filter_.interval());
    words[11] = static_cast<uint32_t>(status_);
  }

 private:
  static typename Ukf<Process>::Params points() {
    typename Ukf<Process>::Params points = Ukf<Process>::default_params();
    points.alpha = tracking_sketch::kAlpha;
    return points;
  }
  static RangeBearing<float, 6>::Params sonar() {
    RangeBearing<float, 6>::Params params;
    params.largest_range_m = tracking_sketch::kLargestRange;
    return params;
  }

  /// As the sketch's clock adds it up: whole seconds and the rest.
  static float seconds_of(uint32_t ticks) {
    const float rest = static_cast<float>(ticks % kTicks) * (1.0f / kTicks);
    return static_cast<float>(ticks / kTicks) + rest;
  }

  static typename Filter::Position desired(float time_s) {
    const float start[] = {0.2f, 2.0f};
    const float velocity[] = {0.1f, 0.2f};
    const float acceleration[] = {0.01f, 0.02f};
    typename Filter::Position position;
    for (int i = 0; i < 2; ++i) {
      position(i) = start[i] + time_s * (velocity[i] + 0.5f * acceleration[i] * time_s);
    }
    return position;
  }

  void note(Status status) {
    if (status_ == Status::kOk) status_ = status;
  }

  bool can_be(const float* z) const {
    const float most = tracking_sketch::kLargestRange;
    const ReadingLimits<float> limits(-most, most, tracking_sketch::kFastest,
                                      tracking_sketch::kRangeJitter);
    return range_.admits(z[0], limits) && math::within(z[1], -6.2842f, 6.2842f);
  }

  void update(const float* measured) {
    const Vector<float, 2> z(measured[0], measured[1]);
    const Status admitted = model_.admits(z);
    Status status = admitted != Status::kOk || can_be(measured) ? admitted : Status::kImplausible;
    if (status == Status::kOk) {
      const auto correction = filter_.update(z, model_);
      status = correction.status;
      nis_ = correction.nis;
      if (status == Status::kOk) {
        range_.take(z(0));
        refusals_ = 0;
      } else if (++refusals_ > tracking_sketch::kPatience) {
        filter_.widen(correction.nis);
      }
    }
    note(status);
  }

  static constexpr uint32_t kTicks = 250000;  // in a second

  Filter filter_;
  RangeBearing<float, 6> model_;
  PlausibleReading<float> range_;
  uint8_t refusals_ = 0;
  float nis_ = -1;
  Status status_ = Status::kOk;
};

TrackedVehicle* tracked = nullptr;
TrackingTwin* tracking_twin = nullptr;

TrackingTwin* new_tracking_twin(int policy) {
  if (policy == 0) return new PolicyTwin<MahalanobisInterval<float>>();
  if (policy == 1) return new PolicyTwin<CovarianceBudget<float>>();
  return new PolicyTwin<FixedInterval<float>>();
}

// ---- The vehicle that is steered ----------------------------------------------------------------

/// Hull and sensors, in a current that is set from outside.
class SteeredVehicle {
 public:
  explicit SteeredVehicle(uint64_t seed)
      : seed_(seed),
        scenario_(scenario()),
        begin_(scenario_),
        world_(scenario_, &mission_detail::launch_hull<SixDof>, begin_.place, begin_.heading, seed,
               0),
        north_(kShift),
        east_(kShift) {
    north_.aim_at(world_.current.value[0]);
    east_.aim_at(world_.current.value[1]);
  }

  void set(double noise, double outliers, double current_m_s, double towards_rad) {
    if (noise != noise_ || outliers != outliers_) {
      noise_ = noise;
      outliers_ = outliers;
      UsblDevice device = scenario_.usbl;
      device.noise_m *= noise;
      device.noise_rad *= noise;
      device.outliers = outliers;
      // With each change a stream of its own, or the numbers would begin anew.
      world_.usbl = VehicleSensor<UsblDevice>(device, scenario_.usbl_timing,
                                              math::Random(seed_, 16 + changes_++));
    }
    north_.aim_at(current_m_s * math::cos(towards_rad));
    east_.aim_at(current_m_s * math::sin(towards_rad));
  }

  /// Numbers: where the vehicle takes itself to be when it starts [m], and its heading [rad].
  void start() const {
    numbers[0] = world_.guess_m[0];
    numbers[1] = world_.guess_m[1];
    numbers[2] = begin_.heading;
  }

  /// Numbers: heading, pitch, pitch rate, yaw rate, speed ahead, to starboard, depth; range and
  /// bearing of a fix. Returns whether there is a fix.
  bool sense(bool ping) {
    const double now_s = truth().time_s;
    world_.sample();
    Reading<1> number;
    Reading<2> pair;
    Reading<3> rates;
    while (world_.compass.take(now_s, number)) numbers[0] = number.value[0];
    numbers[1] = truth().pose[4];
    while (world_.gyro.take(now_s, rates)) {
      numbers[2] = rates.value[1];
      numbers[3] = rates.value[2];
    }
    while (world_.log.take(now_s, pair)) {
      numbers[4] = pair.value[0];
      numbers[5] = pair.value[1];
    }
    while (world_.depth.take(now_s, number)) numbers[6] = number.value[0];
    if (ping) world_.usbl.ask(truth());
    const bool fixed = world_.usbl.take(now_s, pair);
    if (fixed) {
      numbers[7] = pair.value[0];
      numbers[8] = pair.value[1];
    }
    return fixed;
  }

  /// Words: rudder, planes, propeller, which are held for dt.
  void advance(double dt, double time_s) {
    double command[3];
    for (int i = 0; i < 3; ++i) command[i] = static_cast<double>(math::from_bits(words[i]));
    world_.current.value[0] = north_.after(dt);
    world_.current.value[1] = east_.after(dt);
    world_.advance(command, dt, time_s);
  }

  /// Numbers: north, east, down [m], roll, pitch, yaw [rad], current north, east [m/s].
  void look() const {
    for (int i = 0; i < 6; ++i) numbers[i] = truth().pose[i];
    for (int i = 0; i < 2; ++i) numbers[6 + i] = world_.current.value[i];
  }

 private:
  static constexpr double kShift = 0.05;  // of the current [m/s] in a second

  struct Begin {
    double place[2];
    double heading;

    explicit Begin(const MissionScenario& s) {
      mission_detail::MissionPath<double>(s).start(place, heading);
    }
  };

  static MissionScenario scenario() {
    MissionScenario s = mission_source(MissionSource::kRobustModelAided, MissionTrack::kLawnmower);
    s.current_m_s = 0;
    return s;
  }

  const VehicleTruth& truth() const { return world_.truth(); }

  uint64_t seed_;
  MissionScenario scenario_;
  Begin begin_;
  mission_detail::MissionWorld world_;
  Gradual north_, east_;
  double noise_ = 1, outliers_ = 0;
  uint64_t changes_ = 0;
};

/// The pilot of the sketch mission, and what it makes of its lines.
class PilotTwin {
 public:
  virtual ~PilotTwin() = default;
  /// Text: x, y and heading of where it starts.
  virtual bool start() = 0;
  virtual bool wants_fix() = 0;
  /// Text: a line of the vehicle, for this sample. Returns whether it is of use.
  virtual bool hear(uint32_t sample) = 0;
  /// Words: rudder, planes, propeller; x, y, current north, east; P00, P10, P11, heading, distance
  /// from the track, NIS of the last fix.
  virtual void step(uint32_t sample) = 0;
};

template <class Policy>
class PolicyPilot final : public PilotTwin {
  using ThePilot = Pilot<float, Policy, mission_sketch::kKeptEvents>;

 public:
  explicit PolicyPilot(const Policy& policy) : pilot_(settings(), policy) {}

  bool start() override {
    LineFields fields(text);
    float at[3];
    return fields.named("START") && take(fields, at, 3) &&
           pilot_.start(mission_sketch::kPlan, mission_sketch::kWaypoints, at[0], at[1], at[2]) ==
               Status::kOk;
  }

  bool wants_fix() override {
    const bool wants = pilot_.wants_fix();
    if (wants) pilot_.asked();
    return wants;
  }

  bool hear(uint32_t sample) override {
    LineFields fields(text);
    float n[3];
    if (fields.named("COMPASS")) {
      if (!take(fields, sample, n, 2)) return false;
      readings_.heading_rad = n[0];
      readings_.pitch_rad = n[1];
      readings_.heard |= kCompassHeard;
    } else if (fields.named("GYRO")) {
      if (!take(fields, sample, n, 2)) return false;
      readings_.pitch_rate_rad_s = n[0];
      readings_.yaw_rate_rad_s = n[1];
      readings_.heard |= kGyroHeard;
    } else if (fields.named("LOG")) {
      if (!take(fields, sample, n, 2)) return false;
      readings_.speed_m_s = n[0];
      readings_.sway_m_s = n[1];
      readings_.heard |= kLogHeard;
    } else if (fields.named("DEPTH")) {
      if (!take(fields, sample, n, 1)) return false;
      readings_.depth_m = n[0];
      readings_.heard |= kDepthHeard;
    } else if (fields.named("FIX")) {
      if (!take(fields, sample, n, 3)) return false;
      fix_ = Vector<float, 2>(n[0], n[1]);
      delay_s_ = n[2];
      fixed_ = true;
    } else {
      return false;
    }
    return true;
  }

  void step(uint32_t) override {
    pilot_.predict(readings_, mission_sketch::kPeriod);
    if (fixed_) {
      const float age = 0.0f - delay_s_;
      const auto report = pilot_.update(fix_, age > 0 ? age : 0.0f);
      if (report.status == Status::kOk) nis_ = report.nis;
    }
    TorpedoCommand<float> command;
    pilot_.steer(command);
    readings_.heard = 0;
    fixed_ = false;
    show(0, command.rudder_rad);
    show(1, command.stern_planes_rad);
    show(2, command.propeller_rev_s);
    for (int i = 0; i < 4; ++i) show(3 + i, pilot_.filter().x()(i));
    const auto& P = pilot_.filter().belief().P;
    show(7, P(0, 0));
    show(8, P(1, 0));
    show(9, P(1, 1));
    show(10, pilot_.heading_rad());
    show(11, pilot_.cross_track_m());
    show(12, nis_);
  }

 private:
  static typename ThePilot::Params settings() {
    typename ThePilot::Params p;
    p.period_s = mission_sketch::kPeriod;
    p.speed_m_s = mission_sketch::kSpeed;
    p.depth_m = mission_sketch::kDepth;
    p.end_m = mission_sketch::kEnd;
    p.hold_s = mission_sketch::kHold;
    p.compass_s = mission_sketch::kCompassHold;
    p.lost_m = mission_sketch::kLost;
    p.sonar.station_x_m = 0;
    p.sonar.station_y_m = 0;
    p.sonar.sigma_range_m = mission_sketch::kSigmaRange;
    p.sonar.sigma_bearing_rad = mission_sketch::kSigmaBearing;
    p.waypoints.switch_m = mission_sketch::kSwitch;
    return p;
  }

  static bool take(LineFields& fields, float* n, int count) {
    for (int i = 0; i < count; ++i) {
      if (!fields.take(n[i])) return false;
    }
    return fields.at_end();
  }
  static bool take(LineFields& fields, uint32_t sample, float* n, int count) {
    uint32_t of;
    return fields.take(of) && of == sample && take(fields, n, count);
  }

  ThePilot pilot_;
  PilotReadings<float> readings_;
  Vector<float, 2> fix_;
  float delay_s_ = 0;
  float nis_ = 0;
  bool fixed_ = false;
};

SteeredVehicle* steered = nullptr;
PilotTwin* pilot_twin = nullptr;

PilotTwin* new_pilot_twin(int policy) {
  if (policy == 0) {
    FixedInterval<float>::Params p;
    p.interval_s = mission_sketch::kFixInterval;
    return new PolicyPilot<FixedInterval<float>>(FixedInterval<float>(p));
  }
  // As build.py edits the sketch.
  CovarianceBudget<float>::Params p;
  p.initial_s = mission_sketch::kFixInterval;
  p.min_s = 0.1f;
  p.max_s = 10;
  p.position_sigma_m = 1;
  return new PolicyPilot<CovarianceBudget<float>>(CovarianceBudget<float>(p));
}

}  // namespace

// ---- What the page calls
// -------------------------------------------------------------------------

AUVEST_PAGE(numbers) double* page_numbers() { return numbers; }
AUVEST_PAGE(words) uint32_t* page_words() { return words; }
AUVEST_PAGE(text) char* page_text() { return text; }

AUVEST_PAGE(self_test) uint32_t page_self_test() {
  return static_cast<uint32_t>(self_test().failed);
}

AUVEST_PAGE(tracking_start) void tracking_start(double seed, int policy) {
  delete tracked;
  delete tracking_twin;
  tracked = new TrackedVehicle(static_cast<uint64_t>(seed));
  tracking_twin = new_tracking_twin(policy);
}
AUVEST_PAGE(tracking_set) void tracking_set(double noise, double outliers, double wander_m) {
  tracked->set(noise, outliers, wander_m);
}
AUVEST_PAGE(tracking_measure) bool tracking_measure(double time_s) {
  return tracked->measure(time_s);
}
AUVEST_PAGE(tracking_step) void tracking_step(uint32_t sample, bool measured) {
  tracking_twin->step(sample, measured);
}

AUVEST_PAGE(mission_start) void mission_start(double seed, int policy) {
  delete steered;
  delete pilot_twin;
  steered = new SteeredVehicle(static_cast<uint64_t>(seed));
  pilot_twin = new_pilot_twin(policy);
  steered->start();
}
AUVEST_PAGE(mission_set)
void mission_set(double noise, double outliers, double current_m_s, double towards_rad) {
  steered->set(noise, outliers, current_m_s, towards_rad);
}
AUVEST_PAGE(mission_begin) bool mission_begin() { return pilot_twin->start(); }
AUVEST_PAGE(mission_wants_fix) bool mission_wants_fix() { return pilot_twin->wants_fix(); }
AUVEST_PAGE(mission_hear) bool mission_hear(uint32_t sample) { return pilot_twin->hear(sample); }
AUVEST_PAGE(mission_step) void mission_step(uint32_t sample) { pilot_twin->step(sample); }
AUVEST_PAGE(mission_sense) bool mission_sense(bool ping) { return steered->sense(ping); }
AUVEST_PAGE(mission_advance) void mission_advance(double dt, double time_s) {
  steered->advance(dt, time_s);
}
AUVEST_PAGE(mission_look) void mission_look() { steered->look(); }
