// Replays a record of an outage through SLATF 1.0 or 2.0 and writes the trace: the other program
// that `main` may be built around (see replay.hpp), with the same streams.
//
//     record: kind, particles, readings, seed, motion, q, filter, sonar,
//             slave x and P, master x and P,
//             then per reading of the odometry: dt, speed, heading, the master's velocity change,
//             whether an echo followed, range, bearing
//     trace:  statuses of reset and add_master, then per echo: all numbers of all particles,
//             slave x and P, master x and P, N_eff, log likelihood, resamplings, status
//
// AUVEST_PARTICLES is the capacity; AUVEST_LANES, if defined, names the architecture of xsimd in
// whose lanes the particles run.
#pragma once

#if defined(AUVEST_LANES)
#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#endif

#include "auvest/math/bits.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/slatf.hpp"

namespace auvest {
namespace parity {

#if defined(AUVEST_LANES)
using Lanes = SimdLanes<xsimd::AUVEST_LANES>;
#else
using Lanes = OneLane<float>;
#endif

enum Kind : std::uint32_t { kSlatf1, kSlatf2 };

template <class Stream>
class Replay {
 public:
  explicit Replay(Stream& stream) : stream_(stream) {}

  void run() {
    const std::uint32_t kind = stream_.read();
    particles_ = static_cast<int>(stream_.read());
    readings_ = stream_.read();
    random_ = math::Random(stream_.read());
    motion_.params.sigma_speed_m_s = read();
    motion_.params.sigma_heading_rad = read();
    motion_.params.compensate_bias = stream_.read() != 0;
    master_.params.acceleration_m_s2 = read();
    params_.resample_below = read();
    params_.gate = read();
    sonar_.params.sigma_range_m = read();
    sonar_.params.sigma_bearing_rad = read();
    if (kind == kSlatf1) replay<Slatf1<Motion, Master, 1, SystematicResampling, Lanes>>();
    if (kind == kSlatf2) replay<Slatf2<Motion, Master, 1, SystematicResampling, Lanes>>();
  }

 private:
  using Motion = CompassMotion<float>;
  using Master = PiecewiseAcceleration<float>;

  /// One storage for both kinds: 2.0 has more numbers per particle.
  static float* storage() {
    static Slatf2<Motion, Master, 1>::Storage<AUVEST_PARTICLES> particles;
    return particles.numbers;
  }

  // Frames of their own: on the chip none of these may lie below another.
  template <class Filter>
  AUVEST_OUTLINE void start(Filter& filter) {
    typename Filter::SlaveBelief slave;
    read(slave);
    stream_.write(static_cast<std::uint32_t>(filter.reset(slave, particles_, random_)));
    typename Filter::MasterBelief master;
    read(master);
    stream_.write(static_cast<std::uint32_t>(filter.add_master(master)));
  }

  template <class Filter>
  AUVEST_OUTLINE void replay() {
    Filter filter(motion_, master_, params_, storage(), AUVEST_PARTICLES);
    start(filter);
    for (std::uint32_t k = 0; k < readings_; ++k) {
      if (step(filter)) show(filter);
    }
  }

  /// Takes in a reading, and the echo if one followed: then it is true.
  template <class Filter>
  AUVEST_OUTLINE bool step(Filter& filter) {
    const float dt = read();
    typename Filter::Control u;
    typename Filter::VelocityChange change;
    Echo<float> echo;
    read(u);
    read(change);
    const bool heard = stream_.read() != 0;
    read(echo.z);
    echo.master = 0;
    note(filter.predict(dt, u, random_, &change));
    if (heard) note(filter.update(&echo, 1, sonar_, random_));
    return heard;
  }

  /// Of several statuses the first that is not kOk is told.
  void note(Status status) {
    if (status_ == Status::kOk) status_ = status;
  }

  template <class Filter>
  AUVEST_OUTLINE void show(const Filter& filter) {
    for (int i = 0; i < filter.particles(); ++i) {
      write(filter.set().log_weights()[i]);
      for (int field = 0; field < Filter::Set::kFields; ++field) write(*filter.set().at(i, field));
    }
    write(filter.slave());
    write(filter.master(0));
    write(filter.effective_size());
    write(filter.log_likelihood());
    stream_.write(static_cast<std::uint32_t>(filter.resamplings()));
    stream_.write(static_cast<std::uint32_t>(status_));
  }

  float read() { return math::from_bits(stream_.read()); }

  void read(Vector<float, 2>& vector) {
    for (int i = 0; i < 2; ++i) vector(i) = read();
  }

  template <int Size>
  void read(Belief<float, Size>& belief) {
    math::set_zero(belief.P);
    for (int i = 0; i < Size; ++i) belief.x(i) = read();
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) belief.P(i, j) = read();
    }
  }

  void write(float value) { stream_.write(math::to_bits(value)); }

  template <int Size>
  void write(const Belief<float, Size>& belief) {
    for (int i = 0; i < Size; ++i) write(belief.x(i));
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) write(belief.P(i, j));
    }
  }

  Stream& stream_;
  int particles_ = 0;
  std::uint32_t readings_ = 0;
  Status status_ = Status::kOk;
  math::Random random_{0};
  Motion motion_;
  Master master_;
  SlatfParams<float> params_;
  Sonar<float> sonar_;
};

/// Reads one record from the stream and writes its trace.
template <class Stream>
void replay(Stream& stream) {
  Replay<Stream>(stream).run();
}

}  // namespace parity
}  // namespace auvest
