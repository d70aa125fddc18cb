// What the filters of this folder do against echoes and silences that their models do not know.
//
// Gate. An echo beyond it says nothing. But a gate without a way back is a lock-out: once a master
// has left the place where the filter believes it to be, every later echo lies beyond the gate.
//
// Recovery. An echo counts as refused if particles with more than half of the weight refuse it. If
// `recover_after` of the last `recover_of` echoes of a master were refused and the places that
// they imply can be those of one vehicle, the master is born again where the last of them came
// from, with a covariance that knows of the slave's. So m must exceed the longest burst of wrong
// echoes that agree with each other.
//
// Silence. What a master did meanwhile is charged to the slave by the echo that ends the silence:
// their correlation is older than the model's word. After `forget_after_s` the master is born again
// instead.
//
// Both act on echoes whose master is known. The slave's pose and the weights stay: such an echo
// tells the slave nothing.
//
// Safeguards<...> does all of it; NoSafeguards nothing, and takes neither code nor memory.
#pragma once

#include <cstdint>

#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The parameters that all filters with echoes have. The gate is in force without Safeguards, too.
template <class Scalar>
struct EchoParams {
  /// An echo whose NIS (2 degrees of freedom) exceeds this in a particle says nothing to it. 13.8
  /// loses one good echo in 1,000 (-2 log 0.001). 0: no gate, the paper; then there is no recovery.
  Scalar gate = Scalar(13.8);
  int recover_after = 6;              ///< refused echoes, of the last ...
  int recover_of = 8;                 ///< ... so many, at most 16. recover_after = 0: no recovery
  Scalar fastest_m_s = Scalar(10);    ///< no master moves faster between two echoes
  Scalar forget_after_s = Scalar(0);  ///< silence after which a master is born again; 0: never
  /// Standard deviations of the velocity and the acceleration of a master that is born again.
  Scalar rebirth_velocity_m_s = Scalar(3);
  Scalar rebirth_acceleration_m_s2 = Scalar(0.01);
  /// A longer prediction is refused with kStepTooLong: it is a wrong time stamp. Infinite: none is.
  Scalar longest_step_s = Scalar(3600);

  Scalar rebirth_velocity_variance() const { return rebirth_velocity_m_s * rebirth_velocity_m_s; }
  Scalar rebirth_acceleration_variance() const {
    return rebirth_acceleration_m_s2 * rebirth_acceleration_m_s2;
  }

  /// The largest of the standard deviations: the square of a larger one leaves no room for sums.
  static constexpr Scalar most() { return Scalar(1e9); }

  bool valid() const {
    return math::is_nonnegative(gate) && recover_after >= 0 && recover_of >= recover_after &&
           recover_of <= 16 && math::is_positive(fastest_m_s) &&
           math::is_nonnegative(forget_after_s) && math::is_positive(rebirth_velocity_m_s) &&
           rebirth_velocity_m_s <= most() && math::is_positive(rebirth_acceleration_m_s2) &&
           rebirth_acceleration_m_s2 <= most() && longest_step_s > Scalar(0);
  }
};

/// What has happened since the start.
template <class Scalar>
struct SafeguardsReport {
  int refused = 0;                      ///< echoes
  int rebirths = 0;                     ///< of masters, after refusals or silence
  Scalar since_rebirth_s = Scalar(-1);  ///< since the last of them; -1: none
};

template <class Scalar_, int Masters>
class Safeguards {
 public:
  using Scalar = Scalar_;
  static constexpr bool kActive = true;

  void restart() { report_ = SafeguardsReport<Scalar>(); }

  /// Master n is known from now on.
  void begin(int n) {
    masters_[n].refusals = 0;
    masters_[n].silent_s = masters_[n].since_refusal_s = Scalar(0);
  }

  /// Time goes by.
  void wait(Scalar dt, int count) {
    for (int n = 0; n < count; ++n) {
      masters_[n].silent_s = masters_[n].silent_s + dt;
      masters_[n].since_refusal_s = masters_[n].since_refusal_s + dt;
    }
    if (report_.rebirths > 0) report_.since_rebirth_s = report_.since_rebirth_s + dt;
  }

  bool forgotten(int n, const EchoParams<Scalar>& params) const {
    return params.forget_after_s > Scalar(0) && masters_[n].silent_s > params.forget_after_s;
  }

  /// An echo of master n was taken in.
  void accepted(int n) {
    masters_[n].refusals = static_cast<std::uint16_t>(masters_[n].refusals << 1);
    masters_[n].silent_s = Scalar(0);
  }

  /// An echo z of master n was refused, which would be at `place`. True if the master is lost: it
  /// must be born again.
  bool refused(int n, const Vector<Scalar, 2>& place, Scalar range,
               const typename Sonar<Scalar>::Params& sonar, const EchoParams<Scalar>& params) {
    Watched& master = masters_[n];
    ++report_.refused;
    master.silent_s = Scalar(0);
    const Scalar reach =
        params.fastest_m_s * master.since_refusal_s +
        Scalar(4) * (sonar.sigma_range_m + math::absolute(range) * sonar.sigma_bearing_rad);
    const Scalar dx = place(0) - master.place(0);
    const Scalar dy = place(1) - master.place(1);
    const bool one_vehicle = dx * dx + dy * dy <= reach * reach;
    if (master.refusals != 0 && !one_vehicle) master.refusals = 0;
    master.refusals = static_cast<std::uint16_t>(unsigned(master.refusals) << 1 | 1u);
    master.place = place;
    master.since_refusal_s = Scalar(0);
    int count = 0;
    for (int k = 0; k < params.recover_of; ++k) count += master.refusals >> k & 1;
    return params.recover_after > 0 && count >= params.recover_after;
  }

  /// Master n was born again.
  void reborn(int n) {
    begin(n);
    ++report_.rebirths;
    report_.since_rebirth_s = Scalar(0);
  }

  const SafeguardsReport<Scalar>& report() const { return report_; }

  template <class Self, class Visit>
  static void visit_state(Self& self, Visit& visit) {
    visit.count(self.report_.refused);
    visit.count(self.report_.rebirths);
    visit(self.report_.since_rebirth_s);
    for (auto& master : self.masters_) {
      visit.count(master.refusals, std::uint16_t(0xffff));
      visit(master.silent_s);
      visit(master.since_refusal_s);
      visit(master.place);
    }
  }

 private:
  struct Watched {
    std::uint16_t refusals = 0;  ///< of the last echoes, the latest in bit 0
    Scalar silent_s = Scalar(0);
    Scalar since_refusal_s = Scalar(0);
    Vector<Scalar, 2> place = Vector<Scalar, 2>::Zero();  ///< of the last refused echo
  };

  SafeguardsReport<Scalar> report_;
  Watched masters_[Masters];
};

struct NoSafeguards {
  static constexpr bool kActive = false;

  void restart() {}
  void begin(int) {}
  template <class Scalar>
  void wait(Scalar, int) {}
  template <class Params>
  bool forgotten(int, const Params&) const {
    return false;
  }
  void accepted(int) {}
  template <class Place, class Scalar, class Noise, class Params>
  bool refused(int, const Place&, Scalar, const Noise&, const Params&) {
    return false;
  }
  void reborn(int) {}
  template <class Self, class Visit>
  static void visit_state(Self&, Visit&) {}
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
