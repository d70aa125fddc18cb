// What of a filter a checkpoint keeps, and how a filter goes on from it after a cut of power.
//
//     ArrayStore store(bytes, sizeof bytes);                    or EEPROM: auvest_eeprom.h
//     Checkpoints<Filter, ArrayStore> checkpoints(store, 1);
//
//     const Resumed resumed = checkpoints.resume(filter);       once, at the start
//     if (resumed.sequence == 0) filter.reset(x0, P0);
//     predict_within(filter, least_s, most_s);                  how long ago that was
//     checkpoints.begin(filter, time);                          now and then
//     checkpoints.poll();                                       often, or from an interrupt
//
// Of a Gaussian filter: x, the lower triangle of P, what the recovery of its kernel and its
// interval policy remember, and T(k). Parameters are the program's and not kept. Of a GaussianSum:
// its one Gaussian. Of a filter with particles: SlatSummary, the Gaussians of slave and masters,
// from which particles are drawn anew. A filter of your own: specialise CheckpointOf; a policy with
// a memory of its own: Remembered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "auvest/board/checkpoint_ring.hpp"
#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/intervals/covariance_budget.hpp"
#include "auvest/intervals/fixed_interval.hpp"
#include "auvest/intervals/mahalanobis_interval.hpp"
#include "auvest/math/random.hpp"
#include "auvest/robust/no_recovery.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Puts numbers into bytes, in the chip's own order.
class CheckpointWriter {
 public:
  explicit CheckpointWriter(std::uint8_t* to) : to_(to) {}

  template <class Number>
  void operator()(const Number& number) {
    std::memcpy(to_, &number, sizeof number);
    to_ += sizeof number;
  }

  template <class Scalar, int Rows, int Cols>
  void operator()(const Matrix<Scalar, Rows, Cols>& a) {
    std::memcpy(to_, a.data(), sizeof(Scalar) * Rows * Cols);
    to_ += sizeof(Scalar) * Rows * Cols;
  }

  const std::uint8_t* end() const { return to_; }

 private:
  std::uint8_t* to_;
};

/// Takes them back.
class CheckpointReader {
 public:
  explicit CheckpointReader(const std::uint8_t* from) : from_(from) {}

  template <class Number>
  void operator()(Number& number) {
    std::memcpy(&number, from_, sizeof number);
    from_ += sizeof number;
  }

  template <class Scalar, int Rows, int Cols>
  void operator()(Matrix<Scalar, Rows, Cols>& a) {
    std::memcpy(a.data(), from_, sizeof(Scalar) * Rows * Cols);
    from_ += sizeof(Scalar) * Rows * Cols;
  }

 private:
  const std::uint8_t* from_;
};

/// What a recovery or interval policy remembers beside its parameters.
template <class Policy>
struct Remembered {
  static_assert(sizeof(Policy) == 0,
                "say what this policy remembers: specialise auvest::Remembered for it");
};

struct RemembersNothing {
  static constexpr std::size_t kBytes = 0;
  template <class Policy, class Visit>
  static void visit(Policy&, Visit&) {}
};

template <class Scalar>
struct Remembered<NoRecovery<Scalar>> : RemembersNothing {};
template <class Scalar>
struct Remembered<FixedInterval<Scalar>> : RemembersNothing {};
template <class Scalar>
struct Remembered<CovarianceBudget<Scalar>> : RemembersNothing {};

template <class Scalar>
struct Remembered<RejectionStreak<Scalar>> {
  static constexpr std::size_t kBytes = 2 + 7 * sizeof(Scalar);
  template <class Policy, class Visit>
  static void visit(Policy& policy, Visit& visit) {
    visit(policy.count);
    visit(policy.widened);
    visit(policy.variance);
    visit(policy.recent);
  }
};

template <class Scalar>
struct Remembered<MahalanobisInterval<Scalar>> {
  static constexpr std::size_t kBytes = 8 * sizeof(Scalar);
  template <class Policy, class Visit>
  static void visit(Policy& policy, Visit& visit) {
    visit(policy.memory.tau);
    visit(policy.memory.interval);
    visit(policy.memory.ratio);
    visit(policy.memory.mahalanobis_squared);
    visit(policy.memory.last_estimate);
    visit(policy.memory.last_reference);
  }
};

namespace detail {

template <class>
struct Exists {
  using Type = void;
};

/// A Gaussian belief.
template <class Scalar, int N>
struct KeptBelief {
  static constexpr std::size_t kBytes = sizeof(Scalar) * (N + N * (N + 1) / 2);
  template <class BeliefType, class Visit>
  static void visit(BeliefType& belief, Visit& visit) {
    visit(belief.x);
    for (int i = 0; i < N; ++i) {
      for (int j = 0; j <= i; ++j) visit(belief.P(i, j));
    }
  }
};

/// What a filter has besides its belief: nothing, or the memory of a robust update.
template <class Filter, class = void>
struct KeptRule {
  static constexpr std::size_t kBytes = 0;
  static void save(const Filter&, CheckpointWriter&) {}
  static Status resume(Filter& filter, const typename Filter::BeliefType& belief,
                       CheckpointReader&) {
    return filter.restore(belief);
  }
};

template <class Filter>
struct KeptRule<Filter, typename Exists<typename Filter::Rule>::Type> {
  using Rule = typename Filter::Rule;
  using Memory = Remembered<typename Rule::Recovery>;
  static constexpr std::size_t kBytes = Memory::kBytes;
  static void save(const Filter& filter, CheckpointWriter& writer) {
    Memory::visit(filter.rule().recovery, writer);
  }
  static Status resume(Filter& filter, const typename Filter::BeliefType& belief,
                       CheckpointReader& reader) {
    Rule rule = filter.rule();
    Memory::visit(rule.recovery, reader);
    return filter.restore(belief, rule);
  }
};

/// The same with an interval policy around it, or none.
template <class Filter>
struct KeptPolicies : KeptRule<Filter> {};

template <class Inner, class Policy>
struct KeptPolicies<AdaptiveInterval<Inner, Policy>> {
  using Filter = AdaptiveInterval<Inner, Policy>;
  using Scalar = typename Filter::Scalar;
  using Rule = KeptRule<Inner>;
  using Memory = Remembered<Policy>;
  static constexpr std::size_t kBytes = sizeof(Scalar) + Memory::kBytes + Rule::kBytes;
  static void save(const Filter& filter, CheckpointWriter& writer) {
    writer(filter.interval());
    Memory::visit(filter.policy(), writer);
    Rule::save(filter, writer);
  }
  static Status resume(Filter& filter, const typename Filter::BeliefType& belief,
                       CheckpointReader& reader) {
    Scalar interval;
    Policy policy = filter.policy();
    reader(interval);
    Memory::visit(policy, reader);
    // What restore() would refuse, before the filter inside has changed.
    if (!math::is_positive(interval) || policy.check() != Status::kOk) return Status::kBadParameter;
    const Status status = Rule::resume(filter, belief, reader);
    return status == Status::kOk ? filter.restore(belief, policy, interval) : status;
  }
};

}  // namespace detail

/// What is kept of a filter: so many bytes, and how they come and go. Whatever resume() refuses
/// leaves the filter as it was.
template <class Filter>
struct CheckpointOf {
  using State = detail::KeptBelief<typename Filter::Scalar, Filter::kStates>;
  using Policies = detail::KeptPolicies<Filter>;
  static constexpr std::size_t kBytes = State::kBytes + Policies::kBytes;

  static void save(const Filter& filter, CheckpointWriter& writer) {
    State::visit(filter.belief(), writer);
    Policies::save(filter, writer);
  }
  static Status resume(Filter& filter, CheckpointReader& reader) {
    typename Filter::BeliefType belief;
    math::set_zero(belief.P);
    State::visit(belief, reader);
    return Policies::resume(filter, belief, reader);
  }
};

/// What is known of slave and masters, without the particles that say it.
template <class Filter>
struct SlatSummary {
  static constexpr int kMasters = Filter::kMasters;

  typename Filter::SlaveBelief slave;
  typename Filter::MasterBelief master[kMasters];
  std::uint8_t masters;  ///< so many are known, 0..kMasters

  void take(const Filter& filter) {
    slave = filter.slave();
    masters = static_cast<std::uint8_t>(filter.masters());
    for (int n = 0; n < masters; ++n) master[n] = filter.master(n);
  }

  /// Starts the filter from it: as after a word from slave and masters.
  Status start(Filter& filter, math::Random& random) const {
    Status status = filter.reset(slave, random);
    for (int n = 0; n < masters && status == Status::kOk; ++n) {
      status = filter.add_master(master[n]);
    }
    return status;
  }
};

template <class Filter>
struct CheckpointOf<SlatSummary<Filter>> {
  using Scalar = typename Filter::Scalar;
  using Summary = SlatSummary<Filter>;
  using Slave = detail::KeptBelief<Scalar, Filter::kPose>;
  using Master = detail::KeptBelief<Scalar, 6>;
  static constexpr std::size_t kBytes = 1 + Slave::kBytes + Summary::kMasters * Master::kBytes;

  static void save(const Summary& summary, CheckpointWriter& writer) { visit(summary, writer); }
  static Status resume(Summary& summary, CheckpointReader& reader) {
    Summary read;
    visit(read, reader);
    if (read.masters > Summary::kMasters) return Status::kBadParameter;
    summary = read;
    return Status::kOk;
  }

 private:
  /// Masters that are not known are written too: a slot has one size.
  template <class Self, class Visit>
  static void visit(Self& self, Visit& visit) {
    visit(self.masters);
    Slave::visit(self.slave, visit);
    for (auto& master : self.master) Master::visit(master, visit);
  }
};

/// What a start has found.
struct Resumed {
  Status status;           ///< kOk; kNotInitialised: no checkpoint; else: why the filter refuses it
  std::uint32_t sequence;  ///< of the checkpoint, from 1; 0: the filter is as it was
  CheckpointTime time;     ///< of the checkpoint
};

/// `Kept`: a filter, or a SlatSummary.
template <class Kept, class Store>
class Checkpoints : public CheckpointRing<Store, CheckpointOf<Kept>::kBytes> {
 public:
  using Ring = CheckpointRing<Store, CheckpointOf<Kept>::kBytes>;

  Checkpoints(Store& store, std::uint16_t kind) : Ring(store, kind) {}

  /// Takes back the newest checkpoint that is whole.
  Resumed resume(Kept& kept) {
    Resumed resumed = {Status::kNotInitialised, this->find(), {0, 0, 0, false}};
    if (resumed.sequence == 0) return resumed;
    CheckpointReader reader(this->payload());
    resumed.status = CheckpointOf<Kept>::resume(kept, reader);
    resumed.time = this->time();
    if (resumed.status != Status::kOk) resumed.sequence = 0;
    return resumed;
  }

  /// Copies what is to be kept and begins to write it; gives its sequence, or 0 while the one
  /// before is still being written.
  std::uint32_t begin(const Kept& kept, const CheckpointTime& time) {
    if (!this->writing()) {
      CheckpointWriter writer(this->payload());
      CheckpointOf<Kept>::save(kept, writer);
    }
    return Ring::begin(time);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
