// Replays a record of an outage through a filter of slat/ and writes the trace: the other program
// that `main` may be built around (see replay.hpp), with the same streams.
//
//     record: kind, particles, masters that there is room for, masters told, readings, seed,
//             whether there is a plan,
//             resampling, carried covariance, gate, births (2), kept, sonar (3),
//             motion (3, or 2 of a unicycle), q, or the numbers of an Imm (13),
//             slave x and P, each told master's x and P,
//             then per reading of the odometry: dt, the reading (2), the velocity change of each
//             master that there is room for, the number of echoes, and of each: seconds since the
//             reading began, range, bearing, master
// Nobody is born again, and the covariance is that of the particles alone: the paper. But a filter
// with one covariance for all particles has its recovery.
//
//     trace:  statuses of reset and of each add_master, then per reading with echoes: all numbers
//             of all particles, slave x and P, each master's x, P and, of an Imm, probabilities of
//             its models, log likelihood with what else the filter tells, status
//
// Masters that are not there are zeros. AUVEST_PARTICLES and AUVEST_MASTERS are the capacity;
// AUVEST_KINDS, if defined, the kinds that this program has (bit k: kind k), where they do not fit
// together (all but kSlatfShared, which has a program of its own everywhere); AUVEST_LANES, if
// defined, the architecture of xsimd in whose lanes Slatf's particles run.
#pragma once

#if defined(AUVEST_LANES)
#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#endif

#include "auvest/math/bits.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/constant_velocity.hpp"
#include "auvest/models/coordinated_turn.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/records/run.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "auvest/slat/slatf_shared.hpp"

namespace auvest {
namespace parity {

#if defined(AUVEST_LANES)
using Lanes = SimdLanes<xsimd::AUVEST_LANES>;
#else
using Lanes = OneLane<float>;
#endif

#if !defined(AUVEST_KINDS)
#define AUVEST_KINDS 0xfffu
#endif

/// The filter, its motion unless that is CompassMotion, and its master where that is an Imm.
enum Kind : std::uint32_t {
  kSlatf1,
  kSlatf2,
  kSlatf1Unicycle,
  kSlatf2Unicycle,
  kSlatfJoint,
  kSlatfJointUnicycle,
  kEkfSlat,
  kEkfSlatUnicycle,
  kSlatf1Imm,
  kSlatf2UnicycleImm,
  kEkfSlatImm,
  kEkfSlatUnicycleImm,
  kSlatfShared
};

template <bool>
struct Included {};

template <class Stream>
class Replay {
 public:
  explicit Replay(Stream& stream) : stream_(stream) {}

  void run() {
    kind_ = stream_.read();
    particles_ = static_cast<int>(stream_.read());
    room_ = static_cast<int>(stream_.read());
    told_ = static_cast<int>(stream_.read());
    readings_ = stream_.read();
    random_ = math::Random(stream_.read());
    planned_ = stream_.read() != 0;
    resample_below_ = read();
    carry_covariance_ = stream_.read() != 0;
    gate_ = read();
    birth_velocity_m_s_ = read();
    birth_acceleration_m_s2_ = read();
    kept_ = read();
    sonar_.params.sigma_range_m = read();
    sonar_.params.sigma_bearing_rad = read();
    sonar_.params.bearing = static_cast<Bearing>(stream_.read());
    particles<kSlatf1, First<Compass, OneModel>>();
    particles<kSlatf2, Second<Compass, OneModel>>();
    particles<kSlatf1Unicycle, First<Unicycle, OneModel>>();
    particles<kSlatf2Unicycle, Second<Unicycle, OneModel>>();
    particles<kSlatfJoint, SlatfJoint<Compass, OneModel, kMasters>>();
    particles<kSlatfJointUnicycle, SlatfJoint<Unicycle, OneModel, kMasters>>();
    gaussian<kEkfSlat, EkfSlat<Compass, OneModel, kMasters>>();
    gaussian<kEkfSlatUnicycle, EkfSlat<Unicycle, OneModel, kMasters>>();
    particles<kSlatf1Imm, First<Compass, ThreeModels>>();
    particles<kSlatf2UnicycleImm, Second<Unicycle, ThreeModels>>();
    gaussian<kEkfSlatImm, EkfSlat<Compass, ThreeModels, kMasters>>();
    gaussian<kEkfSlatUnicycleImm, EkfSlat<Unicycle, ThreeModels, 1>>();
    particles<kSlatfShared, SlatfShared<Compass, OneModel, kMasters>>();
  }

 private:
  static constexpr int kMasters = AUVEST_MASTERS;
  using Compass = CompassMotion<float>;
  using Unicycle = UnicycleMotion<float>;
  using OneModel = PiecewiseAcceleration<float>;
  using ThreeModels =
      Imm<ConstantVelocity<float>, ExactAcceleration<float>, CoordinatedTurn<float>>;
  // Every reading has a clock of its own, so floats will do.
  using Row = SlatRow<float, kMasters, float>;

  template <class Motion, class Master>
  using First = Slatf1<Motion, Master, kMasters, SystematicResampling, Lanes>;
  template <class Motion, class Master>
  using Second = Slatf2<Motion, Master, kMasters, SystematicResampling, Lanes>;

  template <Kind kind>
  using IsIncluded = Included<(AUVEST_KINDS >> kind & 1u) != 0>;

  template <Kind kind, class Filter>
  void particles() {
    if (kind_ == kind) particles<Filter>(IsIncluded<kind>());
  }
  template <class Filter>
  void particles(Included<false>) {}
  template <Kind kind, class Filter>
  void gaussian() {
    if (kind_ == kind) gaussian<Filter>(IsIncluded<kind>());
  }
  template <class Filter>
  void gaussian(Included<false>) {}

  // Frames of their own: on the chip none of these may lie below another.

  template <class Filter>
  AUVEST_OUTLINE void particles(Included<true>) {
    typename Filter::template Storage<AUVEST_PARTICLES> storage;
    typename Filter::Motion motion;
    typename Filter::Master master;
    typename Filter::Params params;
    read(motion);
    read(master);
    fill(params);
    Filter filter(motion, master, params, storage);
    start(filter, [this](Filter& f, const typename Filter::SlaveBelief& slave) {
      return f.reset(slave, particles_, random_);
    });
    follow(filter);
  }

  template <class Filter>
  AUVEST_OUTLINE void gaussian(Included<true>) {
    typename Filter::Motion motion;
    typename Filter::Master master;
    typename Filter::Params params;
    read(motion);
    read(master);
    params.gate = gate_;
    params.recover_after = 0;
    Filter filter(motion, master, params);
    start(filter, [this](Filter& f, const typename Filter::SlaveBelief& slave) {
      return f.reset(slave, random_);
    });
    follow(filter);
  }

  template <class Filter, class Reset>
  AUVEST_OUTLINE void start(Filter& filter, const Reset& reset) {
    typename Filter::SlaveBelief slave;
    read(slave);
    write(reset(filter, slave));
    for (int n = 0; n < told_; ++n) {
      typename Filter::MasterBelief master;
      read(master);
      write(filter.add_master(master));
    }
  }

  template <class Filter>
  void follow(Filter& filter) {
    const auto next = [this](Row& row) { return this->next(row); };
    run_record<Row>(filter, next, sonar_, random_, [&](const Row& row, Status status) {
      if (row.count > 0) show(filter);
      if (row.count > 0 || status != Status::kOk) write(status);
    });
  }

  void fill(SlatfParams<float>& params) const {
    params.monte_carlo = false;
    params.recover_after = 0;
    params.resample_below = resample_below_;
    params.carry_covariance = carry_covariance_;
    params.gate = gate_;
    params.birth_velocity_m_s = birth_velocity_m_s_;
    params.birth_acceleration_m_s2 = birth_acceleration_m_s2_;
  }
  void fill(SlatfSharedParams<float>& params) const {
    params.resample_below = resample_below_;
    params.kept = kept_;
    params.gate = gate_;
  }
  void fill(SlatfJointParams<float>& params) const {
    params.recover_after = 0;
    params.resample_below = resample_below_;
    params.kept = kept_;
    params.gate = gate_;
  }

  // ---- The trace -------------------------------------------------------------------------------

  template <class Filter>
  AUVEST_OUTLINE void show(const Filter& filter) {
    show_particles(filter);
    write(filter.slave());
    for (int n = 0; n < room_; ++n) show_master(filter, n);
    show_readings(filter);
  }

  template <class Motion, int Masters, class Set, class Resampling, class Safeguards>
  void show_readings(
      const ParticleSlatFilter<Motion, Masters, Set, Resampling, Safeguards>& filter) {
    write(filter.effective_size());
    write(filter.log_likelihood());
    stream_.write(static_cast<std::uint32_t>(filter.resamplings()));
  }
  template <class Motion, class Master, int Masters, class Safeguards>
  void show_readings(const EkfSlat<Motion, Master, Masters, Safeguards>& filter) {
    write(filter.nis());
    write(filter.log_likelihood());
  }

  template <class Filter>
  AUVEST_OUTLINE void show_master(const Filter& filter, int n) {
    typename Filter::MasterBelief master;
    math::set_zero(master.x);
    math::set_zero(master.P);
    if (n < filter.masters()) master = filter.master(n);
    write(master);
    show_modes(filter, n, static_cast<const typename Filter::Master*>(nullptr));
  }

  template <class Filter>
  void show_modes(const Filter&, int, const OneModel*) {}
  template <class Filter>
  void show_modes(const Filter& filter, int n, const ThreeModels*) {
    for (int k = 0; k < ThreeModels::kModes; ++k) {
      write(n < filter.masters() ? filter.mode_probability(n, k) : 0.0f);
    }
  }

  template <class Motion, class Master, int Masters>
  void show_particles(const EkfSlat<Motion, Master, Masters>&) {}
  template <class Motion, class Master, class Proposal, int Masters, class Resampling, class L>
  void show_particles(const Slatf<Motion, Master, Proposal, Masters, Resampling, L>& filter) {
    for (int i = 0; i < filter.particles(); ++i) show_particle(filter, i);
  }
  template <class Motion, class Master, int Masters, class Resampling>
  void show_particles(const SlatfJoint<Motion, Master, Masters, Resampling>& filter) {
    using Fields = SlatfJointFields<Motion::kStates, Masters>;
    for (int i = 0; i < filter.particles(); ++i) {
      show_particle(filter, i);
      int cross = 0;  // numbers of the masters that there is room for
      for (int n = 0; n < room_; ++n) cross += 6 * (Motion::kStates + 6 * n);
      for (int k = 0; k < cross; ++k) write(*filter.set().at(i, Fields::kCrossField + k));
    }
  }

  template <class Motion, class Master, int Masters, class Resampling, class L>
  void show_particles(const SlatfShared<Motion, Master, Masters, Resampling, L>& filter) {
    for (int i = 0; i < filter.particles(); ++i) {
      write(filter.set().log_weights()[i]);
      const int numbers = Motion::kStates + 6 * room_;
      for (int field = 0; field < numbers; ++field) write(*filter.set().at(i, field));
    }
  }

  /// Weight, pose and masters.
  template <class Filter>
  void show_particle(const Filter& filter, int i) {
    write(filter.set().log_weights()[i]);
    const int there = Filter::kMasterField + filter.masters() * Filter::kMasterNumbers;
    for (int field = 0; field < Filter::kMasterField + room_ * Filter::kMasterNumbers; ++field) {
      write(field < there ? *filter.set().at(i, field) : 0.0f);
    }
  }

  // ---- Words -----------------------------------------------------------------------------------

  /// The next reading; false where none is left.
  AUVEST_OUTLINE bool next(Row& row) {
    if (readings_ == 0) return false;
    --readings_;
    row.from_s = 0.0f;
    row.to_s = read();
    read(row.u);
    row.planned = planned_;
    for (Vector<float, 2>& change : row.changes) math::set_zero(change);
    for (int n = 0; n < room_; ++n) read(row.changes[n]);
    row.echoes = echoes_;
    row.count = static_cast<int>(stream_.read());
    for (int s = 0; s < row.count; ++s) {
      echoes_[s].time_s = read();
      read(echoes_[s].echo.z);
      echoes_[s].echo.master = static_cast<int>(static_cast<std::int32_t>(stream_.read()));
    }
    return true;
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

  void read(Compass& motion) {
    motion.params.sigma_speed_m_s = read();
    motion.params.sigma_heading_rad = read();
    motion.params.compensate_bias = stream_.read() != 0;
  }

  void read(Unicycle& motion) {
    motion.params.sigma_speed_m_s = read();
    motion.params.sigma_yaw_rate_rad_s = read();
  }

  void read(OneModel& master) { master.params.acceleration_m_s2 = read(); }

  void read(AccelerationNoise<float>& noise) {
    noise.position = read();
    noise.velocity = read();
    noise.acceleration = read();
  }

  void read(ThreeModels& master) {
    master.params.switch_rate_hz = read();
    for (int k = 0; k < ThreeModels::kModes; ++k) master.params.share(k) = read();
    ConstantVelocity<float>& straight = master.models.first;
    straight.params.velocity = read();
    straight.params.sigma_acceleration_m_s2 = read();
    read(master.models.rest.first.params);
    CoordinatedTurn<float>& turning = master.models.rest.rest.first;
    read(turning.params.noise);
    turning.params.slow_m_s = read();
  }

  void write(Status status) { stream_.write(static_cast<std::uint32_t>(status)); }

  void write(float value) { stream_.write(math::to_bits(value)); }

  template <int Size>
  void write(const Belief<float, Size>& belief) {
    for (int i = 0; i < Size; ++i) write(belief.x(i));
    for (int i = 0; i < Size; ++i) {
      for (int j = 0; j <= i; ++j) write(belief.P(i, j));
    }
  }

  Stream& stream_;
  std::uint32_t kind_ = 0;
  int particles_ = 0;
  int room_ = 0;
  int told_ = 0;
  std::uint32_t readings_ = 0;
  float resample_below_, gate_, birth_velocity_m_s_, birth_acceleration_m_s2_, kept_;
  bool carry_covariance_, planned_;
  TimedEcho<float, float> echoes_[kMasters];  // of the reading
  math::Random random_{0};
  Sonar<float> sonar_;
};

/// Reads one record from the stream and writes its trace.
template <class Stream>
void replay(Stream& stream) {
  Replay<Stream>(stream).run();
}

}  // namespace parity
}  // namespace auvest
