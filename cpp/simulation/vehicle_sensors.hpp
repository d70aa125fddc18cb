// The sensors of a vehicle, simulated: what each reads of the truth, with which errors, when it is
// valid and when it arrives.
//
// Each sensor draws from a stream of its own, and the same number of deviates at every reading,
// whatever becomes of it: runs that differ in one sensor share all others. Errors are off unless a
// default says otherwise. An outlier of a range is late, never early: a reflection takes longer.
//
// Host side, in double.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"

namespace auvest {

/// The vehicle as it is: north, east, down; Euler angles zyx.
struct VehicleTruth {
  double time_s = 0;
  double pose[6] = {0, 0, 0, 0, 0, 0};    ///< x y z [m], phi theta psi [rad]
  double ground[6] = {0, 0, 0, 0, 0, 0};  ///< u v w [m/s], p q r [rad/s] over ground, body axes
  double water[6] = {0, 0, 0, 0, 0, 0};   ///< the same through the water
  double velocity[3] = {0, 0, 0};         ///< of the position [m/s]
};

/// One reading of N numbers.
template <int N>
struct Reading {
  double value[N] = {};
  double valid_s = 0;    ///< what was read was so at this time
  double arrival_s = 0;  ///< and is known to the vehicle from this time on
};

/// When a sensor reads, and how its readings travel.
struct SensorTiming {
  double period_s = 0.1;
  double latency_s = 0;  ///< from validity to arrival
  double dropout = 0;    ///< probability that a reading is lost
};

/// A device with its clock, its random stream and the readings that are on their way.
///
/// A device offers kSize, start(random), which draws what is constant during a run, and
/// read(truth, random, reading), which fills value, valid_s and arrival_s and says whether there is
/// a reading at all.
template <class Device_>
class VehicleSensor {
 public:
  using Device = Device_;
  static constexpr int kSize = Device::kSize;

  VehicleSensor(const Device& device, const SensorTiming& timing, const math::Random& random)
      : device_(device), timing_(timing), random_(random), next_(0) {
    device_.start(random_);
  }

  /// Reads if the clock says so.
  void sample(const VehicleTruth& truth) {
    if (truth.time_s < next_ - 1e-9) return;
    next_ += timing_.period_s;
    ask(truth);
  }

  /// Reads now, as a ping does that the vehicle asks for.
  void ask(const VehicleTruth& truth) {
    Reading<kSize> reading;
    reading.valid_s = reading.arrival_s = truth.time_s;
    const bool present = device_.read(truth, random_, reading);
    const bool lost = random_.uniform<double>() < timing_.dropout;
    if (!present || lost) return;
    reading.arrival_s += timing_.latency_s;
    pending_.push_back(reading);
  }

  /// Takes the first of the readings that have arrived by then; false if there is none.
  bool take(double now_s, Reading<kSize>& reading) {
    for (std::size_t i = 0; i < pending_.size(); ++i) {
      if (pending_[i].arrival_s > now_s + 1e-9) continue;
      reading = pending_[i];
      pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(i));
      return true;
    }
    return false;
  }

  const Device& device() const { return device_; }

 private:
  Device device_;
  SensorTiming timing_;
  math::Random random_;
  double next_;
  std::vector<Reading<kSize>> pending_;
};

/// Exponential deviate with this mean, by a probability; else 0. Two uniforms.
inline double late_outlier(math::Random& random, double probability, double mean) {
  const bool outlier = random.uniform<double>() < probability;
  const double deviate = -mean * math::log(1 - random.uniform<double>());
  return outlier ? deviate : 0.0;
}

/// Heading: psi + A + B sin psi + C cos psi + D sin 2 psi + E cos 2 psi + noise. A is drawn per
/// run.
struct CompassDevice {
  static constexpr int kSize = 1;
  double bias_rad = 0.017453292519943295;    ///< standard deviation of A; 1 deg
  double noise_rad = 0.0087266462599716478;  ///< 0.5 deg
  double hard_iron_rad[2] = {0, 0};          ///< B, C
  double soft_iron_rad[2] = {0, 0};          ///< D, E
  double offset_rad = 0;                     ///< A of this run

  void start(math::Random& random) { offset_rad = bias_rad * random.normal<double>(); }

  bool read(const VehicleTruth& truth, math::Random& random, Reading<1>& reading) const {
    const double psi = truth.pose[5];
    double s, c, s2, c2;
    math::sincos(psi, s, c);
    math::sincos(2 * psi, s2, c2);
    const double iron =
        hard_iron_rad[0] * s + hard_iron_rad[1] * c + soft_iron_rad[0] * s2 + soft_iron_rad[1] * c2;
    reading.value[0] = math::wrap(psi + offset_rad + iron + noise_rad * random.normal<double>());
    return true;
  }
};

/// Body rates p q r, with a bias that walks.
struct GyroDevice {
  static constexpr int kSize = 3;
  double noise_rad_s = 0.0017453292519943296;  ///< 0.1 deg/s
  double walk_rad_s = 0;                       ///< of the bias, per reading
  double bias_rad_s[3] = {0, 0, 0};

  void start(math::Random&) {}

  bool read(const VehicleTruth& truth, math::Random& random, Reading<3>& reading) {
    for (int i = 0; i < 3; ++i) {
      double white, step;
      random.normal_pair(white, step);
      bias_rad_s[i] += walk_rad_s * step;
      reading.value[i] = truth.ground[3 + i] + bias_rad_s[i] + noise_rad_s * white;
    }
    return true;
  }
};

/// Depth, with an offset that is drawn per run.
struct DepthDevice {
  static constexpr int kSize = 1;
  double noise_m = 0.02;
  double offset_sigma_m = 0;
  double offset_m = 0;

  void start(math::Random& random) { offset_m = offset_sigma_m * random.normal<double>(); }

  bool read(const VehicleTruth& truth, math::Random& random, Reading<1>& reading) const {
    reading.value[0] = truth.pose[2] + offset_m + noise_m * random.normal<double>();
    return true;
  }
};

/// Doppler log: u v w over ground (bottom track) or through the water. Without an echo of the
/// bottom, too far or too near, bottom track has no reading.
struct DvlDevice {
  static constexpr int kSize = 3;
  bool bottom_track = true;
  double noise_m_s = 0.006;
  double scale = 0;              ///< relative error
  double misalignment_rad = 0;   ///< mounted turned to starboard by this
  double seabed_m = 50;          ///< depth of the water
  double lock_m[2] = {0.7, 90};  ///< altitudes with an echo

  void start(math::Random&) {}

  bool read(const VehicleTruth& truth, math::Random& random, Reading<3>& reading) const {
    const double* v = bottom_track ? truth.ground : truth.water;
    double s, c;
    math::sincos(misalignment_rad, s, c);
    const double turned[3] = {c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]};
    double white[4];
    random.normal_pair(white[0], white[1]);
    random.normal_pair(white[2], white[3]);
    for (int i = 0; i < 3; ++i) reading.value[i] = (1 + scale) * turned[i] + noise_m_s * white[i];
    const double altitude = seabed_m - truth.pose[2];
    return !bottom_track || math::within(altitude, lock_m[0], lock_m[1]);
  }
};

/// Log and sway log: u and v through the water.
struct LogDevice {
  static constexpr int kSize = 2;
  double noise_m_s = 0.05;
  double scale = 0;  ///< relative error

  void start(math::Random&) {}

  bool read(const VehicleTruth& truth, math::Random& random, Reading<2>& reading) const {
    double white[2];
    random.normal_pair(white[0], white[1]);
    for (int i = 0; i < 2; ++i) {
      reading.value[i] = (1 + scale) * truth.water[i] + noise_m_s * white[i];
    }
    return true;
  }
};

/// Range and bearing from a station, in the plane: as they are once the known difference in depth
/// is out of them. With `sound_m_s` an answer takes its time: asked at t, the vehicle replies at
/// t + r/c, which is when the reading is valid, and the reading arrives at t + 2 r/c.
struct UsblDevice {
  static constexpr int kSize = 2;
  double station_m[2] = {0, 0};
  double noise_m = 0.3;
  double noise_rad = 0.017453292519943295;  ///< 1 deg
  double outliers = 0;                      ///< probability of a late range
  double outlier_m = 20;                    ///< mean by which it is too long
  bool relative = false;                    ///< bearing from the vehicle's bow and not from north
  double sound_m_s = 0;                     ///< c, 1500 in the sea; 0: at once

  void start(math::Random&) {}

  bool read(const VehicleTruth& truth, math::Random& random, Reading<2>& reading) const {
    double dx = truth.pose[0] - station_m[0];
    double dy = truth.pose[1] - station_m[1];
    if (sound_m_s > 0) {
      const double delay = math::sqrt(dx * dx + dy * dy) / sound_m_s;
      dx += delay * truth.velocity[0];
      dy += delay * truth.velocity[1];
      reading.valid_s += delay;
      reading.arrival_s += 2 * delay;
    }
    double white[2];
    random.normal_pair(white[0], white[1]);
    const double late = late_outlier(random, outliers, outlier_m);
    const double bearing = math::atan2(dy, dx) + noise_rad * white[1];
    reading.value[0] = math::sqrt(dx * dx + dy * dy) + noise_m * white[0] + late;
    reading.value[1] = math::wrap(relative ? bearing - truth.pose[5] : bearing);
    return true;
  }
};

/// Range to a beacon or leader in the plane, late by one exchange of messages.
struct AcousticRangeDevice {
  static constexpr int kSize = 1;
  double beacon_m[2] = {0, 0};
  double noise_m = 1;
  double outliers = 0;     ///< probability of a late range
  double outlier_m = 20;   ///< mean by which it is too long
  double sound_scale = 0;  ///< relative error of the speed of sound
  double exchange_s = 0;   ///< from the range to its arrival

  void start(math::Random&) {}

  bool read(const VehicleTruth& truth, math::Random& random, Reading<1>& reading) const {
    const double dx = truth.pose[0] - beacon_m[0];
    const double dy = truth.pose[1] - beacon_m[1];
    const double white = random.normal<double>();
    const double late = late_outlier(random, outliers, outlier_m);
    reading.value[0] = (1 + sound_scale) * (math::sqrt(dx * dx + dy * dy) + late) + noise_m * white;
    reading.arrival_s += exchange_s;
    return true;
  }
};

}  // namespace auvest
