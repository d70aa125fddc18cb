// A filter of slat/ chosen at run time, for Python: Slatf, SlatfJoint, EkfSlat or DeadReckoning
// behind one interface, so that records, scenarios and outages are compiled once per pose, and
// those of an outage's filter not again.
#pragma once

#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include "auvest/math/random.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "auvest/slat/outage.hpp"
#include "desk/arrived.hpp"
#include "slat_interface.hpp"
#include "slat_state.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// What a filter and its outage switch have in common.
template <class Scalar_, int Pose>
class SlatSteps {
 public:
  using Scalar = Scalar_;
  static constexpr int kPose = Pose;
  static constexpr int kMasters = bindings::kMostMasters;
  using Control = Vector<Scalar, 2>;
  using SlaveBelief = Belief<Scalar, Pose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;

  virtual ~SlatSteps() = default;
  virtual Status predict(Scalar dt, const Control& u, math::Random& random,
                         const VelocityChange* changes) = 0;
  virtual Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                        math::Random& random) = 0;
  virtual SlaveBelief slave() const = 0;
  virtual MasterBelief master(int n) const = 0;
  virtual int masters() const = 0;
  virtual bindings::SlatReadings<Scalar> readings() const = 0;
  virtual void save(bindings::SlatState<Scalar>& state) const = 0;
  /// False, and as before, where it is not the state of such a filter.
  virtual bool restore(const bindings::SlatStateView<Scalar>& state) = 0;
};

template <class Scalar_, int Pose>
class AnySlat final : public SlatSteps<Scalar_, Pose> {
 public:
  using Scalar = Scalar_;
  using Steps = SlatSteps<Scalar, Pose>;
  using Steps::kMasters;
  using typename Steps::Control;
  using typename Steps::MasterBelief;
  using typename Steps::SlaveBelief;
  using typename Steps::VelocityChange;
  using Interface = bindings::SlatInterface<Scalar, Pose>;

  /// Takes over what was made.
  explicit AnySlat(Interface* filter) : filter_(filter) {}
  AnySlat(const AnySlat& other) : Steps(other), filter_(other.filter_->clone()) {}
  AnySlat(AnySlat&&) = default;
  AnySlat& operator=(AnySlat&&) = default;

  Status reset(const SlaveBelief& pose, math::Random& random) {
    return Status(filter_->reset(pose.x, pose.P, &random));
  }
  Status add_master(const MasterBelief& belief) {
    return Status(filter_->add_master(belief.x, belief.P));
  }
  Status predict(Scalar dt, const Control& u, math::Random& random,
                 const VelocityChange* changes = nullptr) override {
    return Status(filter_->predict(dt, u, changes, &random));
  }
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) override {
    Heard heard;
    if (!put(echoes, count, heard)) return Status::kBadParameter;
    return Status(filter_->update(heard, &sonar, &random));
  }
  Status step(Scalar dt, const Control& u, const VelocityChange* changes,
              const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
    Heard heard;
    if (!put(echoes, count, heard)) return Status::kBadParameter;
    return Status(filter_->step(dt, u, changes, heard, &sonar, &random));
  }
  SlaveBelief slave() const override {
    SlaveBelief belief;
    filter_->slave(belief.x, belief.P);
    return belief;
  }
  MasterBelief master(int n) const override {
    MasterBelief belief;
    filter_->master(n, belief.x, belief.P);
    return belief;
  }
  int masters() const override { return readings().masters; }
  bindings::SlatReadings<Scalar> readings() const override {
    bindings::SlatReadings<Scalar> readings = {};
    filter_->read(readings);
    return readings;
  }
  Scalar longest_step_s() const { return readings().longest_step_s; }
  std::vector<Scalar> mode_probabilities(int n) const {
    Scalar probabilities[bindings::kMostModes];
    const int count = filter_->mode_probabilities(n, probabilities);
    return std::vector<Scalar>(probabilities, probabilities + count);
  }
  void particles(Scalar* weights, Scalar* poses) const { filter_->particles(weights, poses); }
  void save(bindings::SlatState<Scalar>& state) const override { filter_->save(state); }
  bool restore(const bindings::SlatStateView<Scalar>& state) override {
    AnySlat twin(*this);
    if (!twin.filter_->restore(state)) return false;
    *this = std::move(twin);
    return true;
  }

 private:
  using Heard = bindings::SlatEchoes<Scalar>;

  static bool put(const Echo<Scalar>* echoes, int count, Heard& heard) {
    if (count < 0 || count > kMasters) return false;
    for (int s = 0; s < count; ++s) {
      heard.z[s] = echoes[s].z;
      heard.master[s] = echoes[s].master;
    }
    heard.count = count;
    return true;
  }

  std::unique_ptr<Interface> filter_;
};

/// The outage switch of such a filter. A first prediction that is refused has begun to start the
/// filter, which nobody sees but who saves it: here it is as it was.
template <class Scalar_, int Pose>
class AnyOutage final : public SlatSteps<Scalar_, Pose> {
 public:
  using Scalar = Scalar_;
  using Steps = SlatSteps<Scalar, Pose>;
  using Steps::kMasters;
  using typename Steps::Control;
  using typename Steps::MasterBelief;
  using typename Steps::SlaveBelief;
  using typename Steps::VelocityChange;
  using Filter = AnySlat<Scalar, Pose>;

  explicit AnyOutage(const Filter& filter) : outage_(filter) {}

  Status share(const SlaveBelief& slave, const MasterBelief* masters, int count) {
    return outage_.share(slave, masters, count);
  }
  Communication mode() const { return outage_.mode(); }

  Status predict(Scalar dt, const Control& u, math::Random& random,
                 const VelocityChange* changes) override {
    if (mode() != Communication::kUp) return outage_.predict(dt, u, random, changes);
    Switch started(outage_);
    const Status status = started.predict(dt, u, random, changes);
    if (status == Status::kOk) outage_ = std::move(started);
    return status;
  }
  Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) override {
    return outage_.update(echoes, count, sonar, random);
  }
  SlaveBelief slave() const override { return outage_.slave(); }
  MasterBelief master(int n) const override { return outage_.master(n); }
  int masters() const override {
    return mode() == Communication::kDown ? readings().masters : outage_.shared_masters();
  }
  bindings::SlatReadings<Scalar> readings() const override { return outage_.filter().readings(); }
  void save(bindings::SlatState<Scalar>& state) const override {
    StateKeeper<Scalar> keeper(state);
    Switch::visit_state(outage_, keeper);
  }
  bool restore(const bindings::SlatStateView<Scalar>& state) override {
    StateReturner<Scalar> returner(state);
    Switch twin(outage_);
    Switch::visit_state(twin, returner);
    if (!returner.complete()) return false;
    outage_ = std::move(twin);
    return true;
  }

 private:
  using Switch = Outage<Filter, kMasters>;

  Switch outage_;
};

/// The caller's random generator, for one call.
class Borrowed {
 public:
  explicit Borrowed(void* bytes) : random(0), bytes_(bytes) {
    std::memcpy(&random, bytes, sizeof random);
  }
  ~Borrowed() { std::memcpy(bytes_, &random, sizeof random); }
  Borrowed(const Borrowed&) = delete;

  math::Random random;

 private:
  void* bytes_;
};

/// The probabilities of a filter's modes; nothing where its masters have no Imm.
template <class Master, class Filter>
struct ModeProbabilities {
  using Scalar = typename Filter::Scalar;
  static int of(const Filter&, int, Scalar (&)[bindings::kMostModes]) { return 0; }
};

template <class... Models, class Filter>
struct ModeProbabilities<Imm<Models...>, Filter> {
  using Scalar = typename Filter::Scalar;
  static int of(const Filter& filter, int n, Scalar (&out)[bindings::kMostModes]) {
    for (int k = 0; k < Imm<Models...>::kModes; ++k) out[k] = filter.mode_probability(n, k);
    return Imm<Models...>::kModes;
  }
};

/// What the models of the interface have in common: calls handed on to `filter_`.
template <class Filter>
class SlatModel : public bindings::SlatInterface<typename Filter::Scalar, Filter::kPose> {
 public:
  using Scalar = typename Filter::Scalar;
  using Interface = bindings::SlatInterface<Scalar, Filter::kPose>;
  using Pair = Vector<Scalar, 2>;
  using Heard = bindings::SlatEchoes<Scalar>;
  using Pose = Vector<Scalar, Filter::kPose>;
  using PoseCovariance = Matrix<Scalar, Filter::kPose, Filter::kPose>;

  std::uint8_t reset(const Pose& x, const PoseCovariance& P, void* random) override {
    Borrowed caller(random);
    return code(filter_.reset({x, P}, caller.random));
  }
  std::uint8_t add_master(const Vector<Scalar, 6>& x, const Matrix<Scalar, 6, 6>& P) override {
    return code(filter_.add_master({x, P}));
  }
  std::uint8_t predict(Scalar dt, const Pair& u, const Pair* changes, void* random) override {
    Borrowed caller(random);
    return code(filter_.predict(dt, u, caller.random, changes));
  }
  std::uint8_t update(const Heard& heard, const void* sonar, void* random) override {
    Borrowed caller(random);
    const Echoes echoes(heard);
    return code(
        filter_.update(echoes.echo, heard.count, arrived<Sonar<Scalar>>(sonar), caller.random));
  }
  void slave(Pose& x, PoseCovariance& P) const override {
    const auto belief = filter_.slave();
    x = belief.x;
    P = belief.P;
  }
  void save(bindings::SlatState<Scalar>& state) const override {
    StateKeeper<Scalar> keeper(state);
    Filter::visit_state(filter_, keeper);
  }
  bool restore(const bindings::SlatStateView<Scalar>& state) override {
    StateReturner<Scalar> returner(state);
    Filter::visit_state(filter_, returner);
    return returner.complete() && has_covariances() && filter_.is_sound();
  }

 protected:
  struct Echoes {
    explicit Echoes(const Heard& heard) {
      for (int s = 0; s < heard.count; ++s) {
        echo[s].z = heard.z[s];
        echo[s].master = heard.master[s];
      }
    }

    Echo<Scalar> echo[bindings::kMostMasters];
  };

  template <class... Arguments>
  explicit SlatModel(Arguments&&... arguments) : filter_(std::forward<Arguments>(arguments)...) {}

  static std::uint8_t code(Status status) { return static_cast<std::uint8_t>(status); }

  static void report(const NoSafeguards&, bindings::SlatReadings<Scalar>&) {}
  template <class Watched>
  static void report(const Watched& watched, bindings::SlatReadings<Scalar>& readings) {
    readings.refused = watched.report().refused;
    readings.rebirths = watched.report().rebirths;
    readings.since_rebirth_s = watched.report().since_rebirth_s;
  }

  Filter filter_;

 private:
  /// Whether slave and masters have covariances, after a state was put back.
  bool has_covariances() const {
    bindings::SlatReadings<Scalar> readings = {};
    const Interface& self = *this;
    self.read(readings);
    Belief<Scalar, Filter::kPose> pose;
    this->slave(pose.x, pose.P);
    // The error of the mean over particles is kept in both triangles.
    bool sound = check_slave(pose) == Status::kOk && pose.P == pose.P.transpose();
    for (int n = 0; sound && n < readings.masters; ++n) {
      Belief<Scalar, 6> master;
      this->master(n, master.x, master.P);
      sound = check_slave(master) == Status::kOk;
    }
    return sound;
  }
};

/// What the particles stand in.
template <class Scalar>
class Numbers {
 public:
  explicit Numbers(std::size_t count) : numbers_(new Scalar[count]()) {}
  ~Numbers() { delete[] numbers_; }
  Numbers(const Numbers&) = delete;

  Scalar* data() const { return numbers_; }

 private:
  Scalar* numbers_;
};

/// Slatf or SlatfJoint with particles of its own.
template <class Filter>
class SlatfModel final : private Numbers<typename Filter::Scalar>, public SlatModel<Filter> {
 public:
  using Base = SlatModel<Filter>;
  using typename Base::Heard;
  using typename Base::Interface;
  using typename Base::Pair;
  using typename Base::Scalar;
  using Storage = Numbers<Scalar>;

  template <class Setup>
  explicit SlatfModel(const Setup& setup)
      : Storage(Filter::Set::storage_size(setup.particles)),
        Base(setup.motion, setup.master, setup.params, Storage::data(), setup.particles,
             setup.resampling) {}
  SlatfModel(const SlatfModel& other)
      : Storage(Filter::Set::storage_size(other.filter_.set().capacity())),
        Base(other.filter_, Storage::data()) {}

  Interface* clone() const override { return new SlatfModel(*this); }
  std::uint8_t step(Scalar dt, const Pair& u, const Pair* changes, const Heard& heard,
                    const void* sonar, void* random) override {
    Borrowed caller(random);
    const typename Base::Echoes echoes(heard);
    return this->code(this->filter_.step(dt, u, changes, echoes.echo, heard.count,
                                         arrived<Sonar<Scalar>>(sonar), caller.random));
  }
  void master(int n, Vector<Scalar, 6>& x, Matrix<Scalar, 6, 6>& P) const override {
    const auto belief = this->filter_.master(n);
    x = belief.x;
    P = belief.P;
  }
  int mode_probabilities(int n, Scalar (&out)[bindings::kMostModes]) const override {
    return ModeProbabilities<typename Filter::Master, Filter>::of(this->filter_, n, out);
  }

  void read(bindings::SlatReadings<Scalar>& readings) const override {
    const Filter& filter = this->filter_;
    readings.masters = filter.masters();
    readings.particles = filter.particles();
    readings.resamplings = filter.resamplings();
    readings.effective_size = filter.effective_size();
    readings.log_likelihood = filter.log_likelihood();
    readings.longest_step_s = filter.longest_step_s();
    Base::report(filter.safeguards(), readings);
  }

  void particles(Scalar* weights, Scalar* poses) const override {
    const typename Filter::Set& set = this->filter_.set();
    for (int i = 0; i < set.size(); ++i) {
      weights[i] = weight_of(set.log_weights()[i]);
      for (int k = 0; k < Filter::kPose; ++k) {
        poses[i * Filter::kPose + k] = *set.at(i, Filter::kPoseField + k);
      }
    }
  }
};

/// EkfSlat or DeadReckoning.
template <class Filter>
class GaussianSlatModel final : public SlatModel<Filter> {
 public:
  using Base = SlatModel<Filter>;
  using typename Base::Heard;
  using typename Base::Interface;
  using typename Base::Pair;
  using typename Base::Scalar;

  explicit GaussianSlatModel(const Filter& filter) : Base(filter) {}
  GaussianSlatModel(const GaussianSlatModel& other) : Base(other.filter_) {}

  Interface* clone() const override { return new GaussianSlatModel(*this); }
  std::uint8_t step(Scalar dt, const Pair& u, const Pair* changes, const Heard& heard,
                    const void* sonar, void* random) override {
    const Filter before = this->filter_;
    std::uint8_t status = this->predict(dt, u, changes, random);
    if (status == this->code(Status::kOk)) status = this->update(heard, sonar, random);
    if (status != this->code(Status::kOk)) this->filter_ = before;
    return status;
  }
  void master(int n, Vector<Scalar, 6>& x, Matrix<Scalar, 6, 6>& P) const override {
    const Belief<Scalar, 6> belief = master_of(this->filter_, n);
    x = belief.x;
    P = belief.P;
  }
  int mode_probabilities(int n, Scalar (&out)[bindings::kMostModes]) const override {
    return modes_of(this->filter_, n, out);
  }
  void read(bindings::SlatReadings<Scalar>& readings) const override {
    readings.longest_step_s = this->filter_.longest_step_s();
    Base::report(this->filter_.safeguards(), readings);
    read(this->filter_, readings);
  }
  void particles(Scalar*, Scalar*) const override {}

 private:
  template <class Motion>
  static Belief<Scalar, 6> master_of(const DeadReckoning<Motion>&, int) {
    return Belief<Scalar, 6>();
  }
  template <class Other>
  static Belief<Scalar, 6> master_of(const Other& filter, int n) {
    return filter.master(n);
  }
  template <class Motion>
  static int modes_of(const DeadReckoning<Motion>&, int, Scalar (&)[bindings::kMostModes]) {
    return 0;
  }
  template <class Other>
  static int modes_of(const Other& filter, int n, Scalar (&out)[bindings::kMostModes]) {
    return ModeProbabilities<typename Other::Master, Other>::of(filter, n, out);
  }
  template <class Motion>
  static void read(const DeadReckoning<Motion>&, bindings::SlatReadings<Scalar>&) {}
  template <class Other>
  static void read(const Other& filter, bindings::SlatReadings<Scalar>& readings) {
    readings.masters = filter.masters();
    readings.log_likelihood = filter.log_likelihood();
    readings.nis = filter.nis();
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
