// The use of the paper, section 6: communication fails, the slave goes on alone from the last state
// it was told; it returns, and the slave takes what it is told again.
//
//     outage.share(slave, masters, 1)   communication works: the state that all agree on
//     outage.predict(...), update(...)  no word came: the filter starts from the last shared state
//     outage.slave()                    the shared state, or the filter's
//
// Filter: one of slat_filter.hpp.
#pragma once

#include <cstdint>

#include "auvest/math/random.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/slat_filter.hpp"
#include "auvest/status.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

enum class Communication : std::uint8_t {
  kNever,  ///< nothing was shared yet
  kUp,     ///< the last word is a shared state
  kDown    ///< the filter runs
};

template <class Filter_, int Masters>
class Outage {
 public:
  using Filter = Filter_;
  using Scalar = typename Filter::Scalar;
  using Control = typename Filter::Control;
  using SlaveBelief = typename Filter::SlaveBelief;
  using MasterBelief = typename Filter::MasterBelief;
  using VelocityChange = typename Filter::VelocityChange;

  /// Goes on with a copy of `filter`.
  explicit Outage(const Filter& filter) : filter_(filter), mode_(Communication::kNever) {}

  /// The same for a filter with particles: those of the copy live in `storage`, which is as large
  /// as that of `filter` and must outlive the outage. It may be the same, where `filter` is not
  /// used any more.
  Outage(const Filter& filter, Scalar* storage)
      : filter_(filter, storage), mode_(Communication::kNever) {}

  /// Takes over what communication brings, and ends an outage. `masters` holds `count` beliefs.
  Status share(const SlaveBelief& slave, const MasterBelief* masters, int count) {
    constexpr int kRoom = Filter::kMasters;
    if (count < 0 || count > Masters || (kRoom > 0 && count > kRoom)) return Status::kBadParameter;
    Status status = check_start(slave);
    for (int n = 0; n < count && status == Status::kOk; ++n) status = check_newcomer(masters[n]);
  }
  if (status != Status::kOk) return status;
  slave_ = slave;
  count_ = count;
  for (int n = 0; n < count; ++n) masters_[n] = masters[n];
  mode_ = Communication::kUp;
  return Status::kOk;
}

/// The first prediction after a shared state starts the filter from it. One that is refused does
/// not.
Status
predict(Scalar dt, const Control& u, math::Random& random,
        const VelocityChange* changes = nullptr) {
  if (mode_ == Communication::kNever) return Status::kNotInitialised;
  if (mode_ == Communication::kDown) return filter_.predict(dt, u, random, changes);
  if (!math::is_finite(dt) || !math::all_finite(u)) return Status::kNotFinite;
  if (dt < Scalar(0)) return Status::kTimeBackwards;
  if (dt > filter_.longest_step_s()) return Status::kStepTooLong;
  if (!plan_finite(changes, count_)) return Status::kNotFinite;
  const math::Random before = random;
  Status status = filter_.reset(slave_, random);
  for (int n = 0; n < count_ && status == Status::kOk; ++n) {
    status = filter_.add_master(masters_[n]);
  }
  if (status == Status::kOk) status = filter_.predict(dt, u, random, changes);
  if (status == Status::kOk) {
    mode_ = Communication::kDown;
  } else {
    random = before;
  }
  return status;
}

/// An echo counts only while the filter runs.
Status update(const Echo<Scalar>* echoes, int count, const Sonar<Scalar>& sonar,
              math::Random& random) {
  if (mode_ == Communication::kNever) return Status::kNotInitialised;
  return mode_ == Communication::kUp ? Status::kOk : filter_.update(echoes, count, sonar, random);
}

SlaveBelief slave() const { return mode_ == Communication::kDown ? filter_.slave() : slave_; }
MasterBelief master(int n) const {
  return mode_ == Communication::kDown ? filter_.master(n) : masters_[n];
}
Communication mode() const { return mode_; }
const Filter& filter() const { return filter_; }

private:
Filter filter_;
SlaveBelief slave_;
MasterBelief masters_[Masters];
int count_ = 0;
Communication mode_;

public:
int shared_masters() const { return count_; }  ///< of the last shared state

/// Hands all numbers of the state to `visit`, which keeps them, or overwrites them by those that
/// were kept: to save a filter and to go on from there. `Self` is this class, const to save.
template <class Self, class Visit>
static void visit_state(Self& self, Visit& visit) {
  visit.count(self.mode_, Communication::kDown);
  visit.count(self.count_, Masters);
  if (self.mode_ != Communication::kNever) visit(self.slave_);
  for (int n = 0; n < self.count_; ++n) visit(self.masters_[n]);
  visit(self.filter_);
}
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
