// A slave that lost communication keeps track of itself and of its master: SLATF (Lu, Chen, Liu,
// Ma, He 2020) on an Arduino MEGA2560, with joint particles that share one covariance.
//
// Each second: the timer wakes the chip, it asks for speed and heading, all particles are moved.
// Every other second it pings the master: the sonar is triggered at the moment of the sample, the
// particles are moved while sound and answer are on their way, then the echo is taken in. One line
// of text, and sleep until the next second.
//
//     chip to log and compass   $ODO,17*...
//     log and compass to chip   $MOTION,17,5.08,0.5301*...     sample, speed [m/s], heading [rad]
//     chip to sonar             $PING,18*...
//     sonar to chip             $SONAR,18,301.2,-1.5640*...    sample, range [m], bearing [rad]
//
// Behind * stand the eight digits of the line's CRC-32 (auvest/board/line.hpp).
//
// The bearing is the paper's: from the x axis, from the master to the slave.
//
// Moments add up, so they do not drift. If the chip is still busy more than 1 ms after a deadline,
// the sample is taken at once and counted as late; the prediction covers the time that really
// passed. A reading that does not come is replaced by the last one, an echo by nothing; both are
// counted as missed. So is what cannot be (status kImpossibleRange or kImplausible), which is
// counted as implausible. An echo beyond the filter's gate says nothing, has the status
// kImplausible and is counted as gated; where several of them agree, it is the master that was
// lost, and it is born again where they place it (rebirths).
//
// A loop that hangs for two seconds is ended by the watchdog, and the board starts anew.
//
// Text, 115200 baud: $SLAVE,...*hhhhhhhh; a line at the start names its columns. The estimates are
// computed after pings only. Now and then a comment says how much RAM was never used.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest_boot.h>
#include <auvest_instruments.h>
#include <auvest_wake_timer.h>
#include <avr/wdt.h>

#include "config.h"
#include "master_plan.h"
#include "telemetry.h"

constexpr uint32_t kTicks = wake_timer::to_ticks(kPeriod);
constexpr uint32_t kTolerance = wake_timer::to_ticks(0.001f);
constexpr float kTurn = 6.2842f;                          // 2 pi, and a little for rounding
constexpr uint32_t kPause = wake_timer::to_ticks(0.05f);  // enough to look at the RAM

Motion::Params readings_noise() {
  Motion::Params params;
  params.sigma_speed_m_s = kSigmaSpeed;
  params.sigma_heading_rad = kSigmaHeading;
  return params;
}

auvest::Sonar<float>::Params echo_noise() {
  auvest::Sonar<float>::Params params;
  params.sigma_range_m = kSigmaRange;
  params.sigma_bearing_rad = kSigmaBearing;
  params.largest_range_m = kLargestRange;
  return params;
}

Filter::Params gate() {
  Filter::Params params;
  params.gate = kGate;
  return params;
}

// All objects are global: what they take is known before the sketch runs.
Filter::Storage<kParticles> particles;
Filter filter(Motion(readings_noise()), Master(), gate(), particles);
auvest::math::Random random_numbers(kSeed);
const auvest::Sonar<float> sonar(echo_noise());
const MasterPlan plan;
auvest_board::SerialInstruments instruments;
auvest::PlausibleReading<float> range;
Telemetry telemetry;
Sample sample;
uint32_t moment = 0;         // of this sample, ticks
uint32_t deadline = kTicks;  // of the next one, ticks

static_assert(auvest_board::fits(sizeof particles + sizeof filter + sizeof random_numbers +
                                     sizeof sonar + sizeof plan + sizeof instruments +
                                     sizeof range + sizeof telemetry + sizeof sample,
                                 kStackReserve),
              "the objects of this sketch leave less than kStackReserve bytes of RAM to the stack");

// The functions are not inlined: what one needs on the stack must not lie there for another.

// Communication has just broken: the slave is where it was told, at (0, 0).
AUVEST_OUTLINE auvest::Status start_filter() {
  Filter::SlaveBelief slave;
  auvest::math::set_zero(slave.x);
  auvest::math::set_zero(slave.P);
  const auvest::Status status = filter.reset(slave, random_numbers);
  return status == auvest::Status::kOk ? filter.add_master(plan.start()) : status;
}

// Of several results of a sample, the first that is not kOk is told.
void note(auvest::Status status) {
  if (sample.status == auvest::Status::kOk) sample.status = status;
}

AUVEST_OUTLINE void predict(float from_s, float to_s) {
  const Filter::VelocityChange change = plan.change(from_s, to_s);
  note(filter.predict(sample.dt, sample.u, random_numbers, &change));
}

bool is_angle(float rad) { return auvest::math::within(rad, -kTurn, kTurn); }

void refuse(auvest::Status status) {
  ++sample.implausible;
  note(status);
}

/// The reading that has come, if it can be.
AUVEST_OUTLINE void take(const auvest::Vector<float, 2>& reading) {
  if (auvest::math::within(reading(0), -kFastest, kFastest) && is_angle(reading(1))) {
    sample.u = reading;
  } else {
    sample.read = false;
    refuse(auvest::Status::kImplausible);
  }
}

/// Whether the echo can be.
AUVEST_OUTLINE bool admits(const auvest::Vector<float, 2>& z) {
  const auvest::ReadingLimits<float> limits(0, kLargestRange, kFastestApproach, 12 * kSigmaRange);
  auvest::Status status = sonar.params.admits(z(0));
  if (status == auvest::Status::kOk && !(range.admits(z(0), limits) && is_angle(z(1)))) {
    status = auvest::Status::kImplausible;
  }
  if (status != auvest::Status::kOk) refuse(status);
  return status == auvest::Status::kOk;
}

AUVEST_OUTLINE void update() {
  range.take(sample.z(0));
  const auvest::Echo<float> echo = {sample.z, 0};
  const uint32_t gated = Refusals::gated(filter.safeguards());
  note(filter.update(&echo, 1, sonar, random_numbers));
  if (Refusals::gated(filter.safeguards()) != gated) note(auvest::Status::kImplausible);
}

AUVEST_OUTLINE void report() {
  sample.refused = instruments.refused();
  sample.awake = wake_timer::take_awake();
  telemetry.line().send();  // what is left of the one before
  telemetry.write(sample, filter);
  if (!wake_timer::reached(deadline - telemetry.line().duration())) telemetry.line().send();
  if (sample.number % 60 == 0 && !wake_timer::reached(deadline - kPause)) {
    auvest_board::remark_ram(auvest_board::ram_unused());
  }
}

void pulse() {
  digitalWrite(kTriggerPin, HIGH);
  delayMicroseconds(10);
  digitalWrite(kTriggerPin, LOW);
}

void setup() {
  wdt_enable(WDTO_2S);
  Serial.begin(auvest_board::kBaud);
  pinMode(kTriggerPin, OUTPUT);
  digitalWrite(kTriggerPin, LOW);
  auvest_board::announce_boot();
  Telemetry::introduce();
  sample.u(0) = kCruiseSpeed;
  sample.u(1) = kCruiseHeading;
  const auvest::Status status = start_filter();
  if (status != auvest::Status::kOk) {
    Serial.print(F("# the filter does not start, status "));  // its text would take 300 B of RAM
    Serial.println(static_cast<uint8_t>(status));
    for (;;) wdt_reset();
  }
  wake_timer::begin();
}

void loop() {
  wdt_reset();

  // The moment of this sample.
  wake_timer::sleep_until_moment(deadline);
  const uint32_t now = wake_timer::now();
  const bool late = now - deadline > kTolerance;
  const uint32_t previous = moment;
  moment = late ? now : deadline;
  deadline = moment + kTicks;
  sample.pinged = ++sample.number % kReadingsPerPing == 0;
  if (sample.pinged) pulse();
  instruments.begin(sample.number);
  instruments.ask("ODO");
  auvest::Vector<float, 2> reading;
  sample.read = instruments.await("MOTION", moment + wake_timer::to_ticks(kReadingTimeout), reading,
                                  telemetry.line());
  if (sample.pinged) instruments.ask("PING");

  // The filter.
  sample.status = auvest::Status::kOk;
  const float from_s = sample.time.in_seconds();
  sample.time.add(moment - previous);
  sample.dt = late ? wake_timer::to_seconds(moment - previous) : kPeriod;
  if (!sample.read) {
    ++sample.missed;
  } else {
    take(reading);
  }
  range.wait(sample.dt);
  predict(from_s, sample.time.in_seconds());
  sample.heard =
      sample.pinged && instruments.await("SONAR", moment + wake_timer::to_ticks(kEchoTimeout),
                                         sample.z, telemetry.line());
  if (sample.pinged && !sample.heard) ++sample.missed;
  sample.heard = sample.heard && admits(sample.z);
  if (sample.heard) update();

  // The line.
  if (late) ++sample.late;
  report();
}
