// Where am I? Dead reckoning by compass and log, and ranges to three beacons that come late: the
// M-estimation EKF of Li, Du, Fan, Chen, Mao, Luo 2020 on an Arduino MEGA2560 or UNO.
//
// Each second: the timer wakes the chip, it asks for speed and heading, and one beacon after the
// other for a range. The estimate is predicted; a range that has come meanwhile, of a sample some
// seconds ago, is taken at its own time (LateUpdates). One line of text, and sleep until the next
// second, in which the ranges of earlier samples come in. instruments.h has the protocol.
//
// What is not believed. A line that is damaged, no answer to what was asked, or an answer for the
// second time: refused. A number that cannot be, or that has changed faster than the vehicle moves:
// implausible, status kImplausible, and a range beyond kLargestRange, kImpossibleRange. A range
// that contradicts the estimate: its weight is less than 1 and, beyond the gate, 0; where several
// agree, it is the estimate that is wrong, and the filter recovers. Each is counted on the line.
//
// A reading that does not come is replaced by the last one, a range by nothing; both are counted as
// missed. Moments add up, so they do not drift. If the chip is still busy more than 1 ms after a
// deadline, the sample is taken at once and counted as late; the prediction covers the time that
// really passed.
//
// A loop that hangs for two seconds is ended by the watchdog, and the board starts anew.
//
// Text, 115200 baud: $NAV,...*hhhhhhhh; a line at the start names its columns, and `auvest capture`
// makes a table and a figure of it. Now and then a comment says how much RAM was never used.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest_boot.h>
#include <auvest_wake_timer.h>
#include <avr/wdt.h>

#include "config.h"
#include "instruments.h"
#include "telemetry.h"

using Beacon = auvest::LeaderRange<float, 2>;
using Late = auvest::LateUpdates<Filter, Beacon, kKeptEvents>;
using Limits = auvest::ReadingLimits<float>;

constexpr uint32_t kTicks = wake_timer::to_ticks(kPeriod);
constexpr uint32_t kTolerance = wake_timer::to_ticks(0.001f);
constexpr uint32_t kPause = wake_timer::to_ticks(0.05f);  // enough to look at the RAM

// All objects are global: what they take is known before the sketch runs.
Late late;
Instruments instruments;
auvest::PlausibleReading<float> speed, heading, ranges[kBeaconCount];
Telemetry telemetry;
Sample sample;
uint32_t unread = 0;         // readings that did not come
uint32_t moment = 0;         // of this sample, ticks
uint32_t deadline = kTicks;  // of the next one, ticks

static_assert(auvest_board::fits(sizeof late + sizeof instruments + sizeof speed + sizeof heading +
                                     sizeof ranges + sizeof telemetry + sizeof sample,
                                 kStackReserve),
              "the objects of this sketch leave less than kStackReserve bytes of RAM to the stack");

// The functions are not inlined: what one needs on the stack must not lie there for another.

// Of several results of a sample, the first that is not kOk is told.
void note(auvest::Status status) {
  if (sample.status == auvest::Status::kOk) sample.status = status;
}

AUVEST_OUTLINE auvest::Status start_filter() {
  auvest::Matrix<float, 2, 2> P;
  P(0, 0) = P(1, 1) = kSigmaStart * kSigmaStart;
  P(0, 1) = P(1, 0) = 0;
  return late.reset(auvest::Vector<float, 2>(kStart[0], kStart[1]), P);
}

void refuse_implausible() {
  ++sample.implausible;
  note(auvest::Status::kImplausible);
}

// Between two readings the noise of both may add up: six of each sigma.
AUVEST_OUTLINE void take_reading() {
  const float* const reading = instruments.reading();
  const Limits of_speed(-kFastest, kFastest, kHardest, 12 * kSigmaSpeed);
  const Limits of_heading = Limits::angle(kFastestTurn, 12 * kSigmaHeading);
  const bool plausible =
      speed.admits(reading[0], of_speed) && heading.admits(reading[1], of_heading);
  if (plausible) {
    speed.take(reading[0]);
    heading.take(reading[1]);
    sample.u(0) = reading[0];
    sample.u(2) = reading[1];
  } else {
    sample.read = false;
    refuse_implausible();
  }
}

AUVEST_OUTLINE void predict() {
  speed.wait(sample.dt);
  heading.wait(sample.dt);
  for (auvest::PlausibleReading<float>& range : ranges) range.wait(sample.dt);
  note(late.predict(sample.dt, sample.u));
}

AUVEST_OUTLINE void take_range(const RangeReply& reply) {
  sample.beacon = reply.sample % kBeaconCount;
  sample.range_m = reply.range_m;
  sample.age = instruments.age(reply, moment);
  const Limits limits(0, kLargestRange, kFastest, 12 * kSigmaRange);
  if (!ranges[sample.beacon].admits(sample.range_m, limits)) return refuse_implausible();
  Beacon beacon;
  beacon.params.sigma_range_m = kSigmaRange;
  beacon.place(kBeacons[sample.beacon]);
  const auto report = late.update(sample.range_m, beacon, sample.age);
  sample.corrected = report.status == auvest::Status::kOk;
  if (!sample.corrected) return note(report.status);
  sample.nis = report.nis;
  sample.weight = report.weight(0);
  if (report.decision == auvest::Decision::kRejected) {
    ++sample.gated;
  } else {
    ranges[sample.beacon].take(sample.range_m);
  }
  note(late.filter().status());
}

AUVEST_OUTLINE void report() {
  sample.missed = unread + instruments.missed();
  sample.refused = instruments.refused();
  sample.awake = wake_timer::take_awake();
  telemetry.line().send();  // what is left of the one before
  telemetry.write(sample, late.filter());
  if (sample.number % 60 == 0 && !wake_timer::reached(deadline - kPause)) {
    telemetry.line().send();
    auvest_board::remark_ram(auvest_board::ram_unused());
  }
}

void setup() {
  wdt_enable(WDTO_2S);
  Serial.begin(auvest_board::kBaud);
  auvest_board::announce_boot();
  Telemetry::introduce();
  sample.u(0) = kCruiseSpeed;
  sample.u(1) = 0;
  sample.u(2) = kCruiseHeading;
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
  instruments.listen(deadline, false, telemetry.line());
  const uint32_t now = wake_timer::now();
  const bool late_sample = now - deadline > kTolerance;
  const uint32_t previous = moment;
  moment = late_sample ? now : deadline;
  deadline = moment + kTicks;
  ++sample.number;
  instruments.ask(sample.number, moment, sample.number % kBeaconCount);
  sample.read =
      instruments.listen(moment + wake_timer::to_ticks(kReadingTimeout), true, telemetry.line());

  // The filter.
  sample.status = auvest::Status::kOk;
  sample.time.add(moment - previous);
  sample.dt = late_sample ? wake_timer::to_seconds(moment - previous) : kPeriod;
  if (sample.read) {
    take_reading();
  } else {
    ++unread;
  }
  predict();
  RangeReply reply;
  sample.corrected = false;
  sample.heard = instruments.next(reply);
  if (sample.heard) take_range(reply);

  // The line.
  if (late_sample) ++sample.late;
  report();
}
