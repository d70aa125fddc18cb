// A filter of slat/ chosen at run time, for Python: Slatf, SlatfJoint, EkfSlat or DeadReckoning
// behind one interface, so that records, scenarios and outages are compiled once per pose.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/imm_slat.hpp"
#include "slat_state.hpp"

namespace auvest {

/// What can be read besides the beliefs. What a filter has not is zero.
template <class Scalar>
struct SlatReadings {
  int masters = 0;
  int particles = 0;
  int resamplings = 0;
  Scalar effective_size = Scalar(0);
  Scalar log_likelihood = Scalar(0);
  Scalar nis = Scalar(0);
};

template <class Scalar_, int Pose>
class AnySlat {
 public:
  using Scalar = Scalar_;
  static constexpr int kPose = Pose;
  static constexpr int kMasters = 4;
  using Control = Vector<Scalar, 2>;
  using SlaveBelief = Belief<Scalar, Pose>;
  using MasterBelief = Belief<Scalar, 6>;
  using VelocityChange = Vector<Scalar, 2>;
  using Echo = auvest::Echo<Scalar>;

  struct Interface {
    virtual ~Interface() = default;
    virtual std::unique_ptr<Interface> clone() const = 0;
    virtual Status reset(const SlaveBelief& pose, math::Random& random) = 0;
    virtual Status add_master(const MasterBelief& belief) = 0;
    virtual Status predict(Scalar dt, const Control& u, math::Random& random,
                           const VelocityChange* changes) = 0;
    virtual Status update(const Echo* echoes, int count, const Sonar<Scalar>& sonar,
                          math::Random& random) = 0;
    /// predict() and update(), both or, where one is refused, neither.
    virtual Status step(Scalar dt, const Control& u, const VelocityChange* changes,
                        const Echo* echoes, int count, const Sonar<Scalar>& sonar,
                        math::Random& random) = 0;
    virtual SlaveBelief slave() const = 0;
    virtual MasterBelief master(int n) const = 0;
    virtual SlatReadings<Scalar> readings() const = 0;
    /// Of each model of master n's Imm; nothing where there is one model.
    virtual std::vector<Scalar> mode_probabilities(int n) const = 0;
    /// Weights (particles) and poses (particles x Pose); nothing where there are no particles.
    virtual void particles(Scalar* weights, Scalar* poses) const = 0;
    virtual SlatState<Scalar> state() const = 0;
    /// False where it is not the state of such a filter. Then this one must not be used any more.
    virtual bool restore(const SlatState<Scalar>& state) = 0;
  };

  explicit AnySlat(std::unique_ptr<Interface> filter) : filter_(std::move(filter)) {}
  AnySlat(const AnySlat& other) : filter_(other.filter_->clone()) {}
  AnySlat(AnySlat&&) = default;
  AnySlat& operator=(AnySlat&&) = default;

  Status reset(const SlaveBelief& pose, math::Random& random) {
    return filter_->reset(pose, random);
  }
  Status add_master(const MasterBelief& belief) { return filter_->add_master(belief); }
  Status predict(Scalar dt, const Control& u, math::Random& random,
                 const VelocityChange* changes = nullptr) {
    return filter_->predict(dt, u, random, changes);
  }
  Status update(const Echo* echoes, int count, const Sonar<Scalar>& sonar, math::Random& random) {
    return filter_->update(echoes, count, sonar, random);
  }
  Status step(Scalar dt, const Control& u, const VelocityChange* changes, const Echo* echoes,
              int count, const Sonar<Scalar>& sonar, math::Random& random) {
    return filter_->step(dt, u, changes, echoes, count, sonar, random);
  }
  SlaveBelief slave() const { return filter_->slave(); }
  MasterBelief master(int n) const { return filter_->master(n); }
  SlatReadings<Scalar> readings() const { return filter_->readings(); }
  std::vector<Scalar> mode_probabilities(int n) const { return filter_->mode_probabilities(n); }
  void particles(Scalar* weights, Scalar* poses) const { filter_->particles(weights, poses); }
  SlatState<Scalar> state() const { return filter_->state(); }
  /// False, with the filter as it was, where it is not the state of such a filter.
  bool restore(const SlatState<Scalar>& state) {
    std::unique_ptr<Interface> twin = filter_->clone();
    if (!twin->restore(state)) return false;
    filter_ = std::move(twin);
    return true;
  }

 private:
  std::unique_ptr<Interface> filter_;
};

/// The probabilities of a filter's modes; nothing where its masters have no Imm.
template <class Master, class Filter>
struct ModeProbabilities {
  static std::vector<typename Filter::Scalar> of(const Filter&, int) { return {}; }
};

template <class... Models, class Filter>
struct ModeProbabilities<Imm<Models...>, Filter> {
  static std::vector<typename Filter::Scalar> of(const Filter& filter, int n) {
    std::vector<typename Filter::Scalar> result;
    for (int k = 0; k < Imm<Models...>::kModes; ++k) {
      result.push_back(filter.mode_probability(n, k));
    }
    return result;
  }
};

/// What the models of the interface have in common: calls handed on to `filter_`.
template <class Filter>
class SlatModel : public AnySlat<typename Filter::Scalar, Filter::kPose>::Interface {
 public:
  using Scalar = typename Filter::Scalar;
  using Any = AnySlat<Scalar, Filter::kPose>;

  Status reset(const typename Any::SlaveBelief& pose, math::Random& random) override {
    return filter_.reset(pose, random);
  }
  Status add_master(const typename Any::MasterBelief& belief) override {
    return filter_.add_master(belief);
  }
  Status predict(Scalar dt, const typename Any::Control& u, math::Random& random,
                 const typename Any::VelocityChange* changes) override {
    return filter_.predict(dt, u, random, changes);
  }
  Status update(const typename Any::Echo* echoes, int count, const Sonar<Scalar>& sonar,
                math::Random& random) override {
    return filter_.update(echoes, count, sonar, random);
  }
  typename Any::SlaveBelief slave() const override { return filter_.slave(); }
  SlatState<Scalar> state() const override {
    StateKeeper<Scalar> keeper;
    Filter::visit_state(filter_, keeper);
    return keeper.state;
  }
  bool restore(const SlatState<Scalar>& state) override {
    StateReturner<Scalar> returner(state);
    Filter::visit_state(filter_, returner);
    return returner.complete();
  }

 protected:
  template <class... Arguments>
  explicit SlatModel(Arguments&&... arguments) : filter_(std::forward<Arguments>(arguments)...) {}

  Filter filter_;
};

/// Slatf or SlatfJoint with particles of its own.
template <class Filter>
class SlatfModel : private std::vector<typename Filter::Scalar>, public SlatModel<Filter> {
 public:
  using Base = SlatModel<Filter>;
  using typename Base::Any;
  using typename Base::Scalar;
  using Storage = std::vector<Scalar>;

  template <class Setup>
  explicit SlatfModel(const Setup& setup)
      : Storage(Filter::Set::storage_size(setup.particles)),
        Base(setup.motion, setup.master, setup.params, Storage::data(), setup.particles,
             setup.resampling) {}
  SlatfModel(const SlatfModel& other)
      : Storage(other.size()), Base(other.filter_, Storage::data()) {}

  std::unique_ptr<typename Any::Interface> clone() const override {
    return std::unique_ptr<typename Any::Interface>(new SlatfModel(*this));
  }
  Status step(Scalar dt, const typename Any::Control& u,
              const typename Any::VelocityChange* changes, const typename Any::Echo* echoes,
              int count, const Sonar<Scalar>& sonar, math::Random& random) override {
    return this->filter_.step(dt, u, changes, echoes, count, sonar, random);
  }
  typename Any::MasterBelief master(int n) const override { return this->filter_.master(n); }
  std::vector<Scalar> mode_probabilities(int n) const override {
    return ModeProbabilities<typename Filter::Master, Filter>::of(this->filter_, n);
  }

  SlatReadings<Scalar> readings() const override {
    const Filter& filter = this->filter_;
    SlatReadings<Scalar> readings;
    readings.masters = filter.masters();
    readings.particles = filter.particles();
    readings.resamplings = filter.resamplings();
    readings.effective_size = filter.effective_size();
    readings.log_likelihood = filter.log_likelihood();
    return readings;
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
class GaussianSlatModel : public SlatModel<Filter> {
 public:
  using Base = SlatModel<Filter>;
  using typename Base::Any;
  using typename Base::Scalar;

  explicit GaussianSlatModel(const Filter& filter) : Base(filter) {}
  GaussianSlatModel(const GaussianSlatModel& other) : Base(other.filter_) {}

  std::unique_ptr<typename Any::Interface> clone() const override {
    return std::unique_ptr<typename Any::Interface>(new GaussianSlatModel(*this));
  }
  Status step(Scalar dt, const typename Any::Control& u,
              const typename Any::VelocityChange* changes, const typename Any::Echo* echoes,
              int count, const Sonar<Scalar>& sonar, math::Random& random) override {
    const Filter before = this->filter_;
    Status status = this->filter_.predict(dt, u, random, changes);
    if (status == Status::kOk) status = this->filter_.update(echoes, count, sonar, random);
    if (status != Status::kOk) this->filter_ = before;
    return status;
  }
  typename Any::MasterBelief master(int n) const override { return master_of(this->filter_, n); }
  SlatReadings<Scalar> readings() const override { return readings_of(this->filter_); }
  std::vector<Scalar> mode_probabilities(int n) const override {
    return modes_of(this->filter_, n);
  }
  void particles(Scalar*, Scalar*) const override {}

 private:
  template <class Motion>
  static typename Any::MasterBelief master_of(const DeadReckoning<Motion>&, int) {
    return typename Any::MasterBelief();
  }
  template <class Motion, class Master, int Masters>
  static typename Any::MasterBelief master_of(const EkfSlat<Motion, Master, Masters>& filter,
                                              int n) {
    return filter.master(n);
  }
  template <class Motion>
  static std::vector<Scalar> modes_of(const DeadReckoning<Motion>&, int) {
    return {};
  }
  template <class Motion, class Master, int Masters>
  static std::vector<Scalar> modes_of(const EkfSlat<Motion, Master, Masters>& filter, int n) {
    return ModeProbabilities<Master, EkfSlat<Motion, Master, Masters>>::of(filter, n);
  }
  template <class Motion>
  static SlatReadings<Scalar> readings_of(const DeadReckoning<Motion>&) {
    return SlatReadings<Scalar>();
  }
  template <class Motion, class Master, int Masters>
  static SlatReadings<Scalar> readings_of(const EkfSlat<Motion, Master, Masters>& filter) {
    SlatReadings<Scalar> readings;
    readings.masters = filter.masters();
    readings.log_likelihood = filter.log_likelihood();
    readings.nis = filter.nis();
    return readings;
  }
};

}  // namespace auvest
