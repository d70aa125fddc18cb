// A craft between three beacons, whose estimate outlives a cut of its power: RobustEkf (Li, Du,
// Fan, Chen, Mao, Luo 2020) on an Arduino MEGA2560, with checkpoints in the EEPROM and a watchdog.
//
//     chip to clock     $CLOCK,1*...              once, at the start
//     clock to chip     $CLOCK,1,20,43200*...     days and seconds; no answer: no clock
//     chip to sonar     $PING,17*...              every half second, one beacon after the other
//     sonar to chip     $RANGE,17,41.25,2*...     sample, range [m], beacon (0, 1 or 2)
//
// Behind * stand the eight digits of the line's CRC-32 (auvest/board/line.hpp).
//
// At each start the sketch takes the newest checkpoint that is whole, and says so:
//
//     $RESUME,sequence,seconds,sum,least,most,status,x,y*...
//
// The checkpoint is between `least` and `most` seconds old. With a clock they are 3 s apart.
// Without one they span all that may have happened: the time to the next checkpoint, which was not
// complete, and the longest time without power (config.h), as often as the board has started since.
// The belief is carried over that time (auvest/filters/predict_within.hpp), and is the first that
// is kept again: a start that ends before adds its time to the bound, by the count of starts.
//
// A loop that hangs for two seconds is ended by the watchdog, and the board starts as after a cut.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest_boot.h>
#include <auvest_eeprom.h>
#include <auvest_instruments.h>
#include <auvest_wake_timer.h>
#include <avr/wdt.h>

#include "config.h"
#include "telemetry.h"

using Checkpoints = auvest_board::EepromCheckpoints<Filter>;

constexpr uint32_t kTicks = wake_timer::to_ticks(kPeriod);
constexpr uint32_t kTimeout = wake_timer::to_ticks(kAnswerTimeout);
constexpr uint32_t kTolerance = wake_timer::to_ticks(0.001f);

/// To write a checkpoint, 3.6 ms a byte at most, what a sample and the start-up take besides, and a
/// loop that hangs until the watchdog bites.
constexpr float kWriting = 0.0036f * Checkpoints::kSlotBytes + kPeriod + 2 * kAnswerTimeout + 2.8f;

Filter filter{auvest::Ekf<Process>(Process())};
Checkpoints checkpoints(kKind);
AUVEST_EEPROM_INTERRUPT(checkpoints)
auvest_board::SerialInstruments instruments;
Telemetry telemetry;
Sample sample;
uint32_t start = 0;          // the how-manieth of the board
bool clock = false;          // there is one that goes on without power
uint32_t moment = 0;         // of this sample, ticks
uint32_t deadline = kTicks;  // of the next one, ticks
float since_checkpoint = 0;  // [s]

static_assert(auvest_board::fits(sizeof filter + sizeof checkpoints + sizeof instruments +
                                     sizeof telemetry + sizeof sample,
                                 kStackReserve),
              "the objects of this sketch leave less than kStackReserve bytes of RAM to the stack");

// Of several results of a sample, the first that is not kOk is told.
void note(auvest::Status status) {
  if (sample.status == auvest::Status::kOk) sample.status = status;
}

// Nothing is known from before.
AUVEST_OUTLINE void start_filter() {
  Filter::State x;
  Filter::Covariance P;
  auvest::math::set_zero(x);
  auvest::math::set_zero(P);
  for (int i = 0; i < 2; ++i) {
    x(i) = kStart[i];
    P(i, i) = kSigmaStart * kSigmaStart;
    P(i + 2, i + 2) = kSigmaVelocity * kSigmaVelocity;
  }
  filter.reset(x, P);
}

// Asks for the time, days and seconds of the day. False: there is no clock.
bool read_clock(uint32_t& seconds) {
  auvest_board::SerialInstruments::Answer answer;
  instruments.begin(start);
  instruments.ask("CLOCK");
  if (!instruments.await("CLOCK", wake_timer::now() + kTimeout, answer, telemetry.line())) {
    return false;
  }
  seconds = static_cast<uint32_t>(answer(0)) * 86400 + static_cast<uint32_t>(answer(1));
  return true;
}

// How old a checkpoint is. The clock counts whole seconds, and so does the time since.
Age age_of(const auvest::CheckpointTime& time, uint32_t seconds) {
  if (clock && time.absolute && seconds >= time.seconds) {
    const float passed = static_cast<float>(seconds - time.seconds);
    return {passed < 2 ? 0 : passed - 2, passed + 1};
  }
  const uint32_t starts = start - time.start;  // since, this one included
  const float each = kLongestOff + kWriting;
  return {0, kCheckpointPeriod + static_cast<float>(starts) * each};
}

AUVEST_OUTLINE void resume() {
  uint32_t seconds = 0;
  clock = read_clock(seconds);
  auvest::Resumed resumed = checkpoints.resume(filter);
  Age age = {0, 0};
  if (resumed.sequence != 0) age = age_of(resumed.time, seconds);
  Telemetry::resumed(resumed, checkpoints.sum(), age, filter);
  if (resumed.sequence != 0 && age.most <= kOldest &&
      auvest::predict_within(filter, age.least, age.most) == auvest::Status::kOk) {
    sample.time.seconds =
        resumed.time.seconds + static_cast<uint32_t>(0.5f * (age.least + age.most));
  } else {
    start_filter();
  }
  if (clock) sample.time.seconds = seconds;
}

AUVEST_OUTLINE void save() {
  const uint32_t microseconds = sample.time.ticks * auvest_board::kMicrosecondsPerTick;
  const uint32_t sequence =
      checkpoints.begin(filter, {sample.time.seconds, microseconds, start, clock});
  if (sequence == 0) return;  // the one before is still being written
  since_checkpoint = 0;
  Telemetry::saving(sequence, checkpoints.sum());
}

void setup() {
  wdt_enable(WDTO_2S);
  Serial.begin(auvest_board::kBaud);
  start = auvest_board::announce_boot();
  Telemetry::introduce();
  wake_timer::begin();
  resume();
  save();
  moment = wake_timer::now();
  deadline = moment + kTicks;
}

AUVEST_OUTLINE void update(const auvest_board::SerialInstruments::Answer& answer) {
  auvest::LeaderRange<float, 4>::Params params;
  params.leader_x_m = kBeacons[sample.beacon][0];
  params.leader_y_m = kBeacons[sample.beacon][1];
  params.sigma_range_m = kSigmaRange;
  params.largest_range_m = kLargestRange;
  auvest::Vector<float, 1> z;
  z(0) = sample.range = answer(0);
  note(filter.update(z, auvest::LeaderRange<float, 4>(params)).status);
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
  instruments.begin(++sample.number);
  instruments.ask("PING");
  auvest_board::SerialInstruments::Answer answer;
  sample.measured = instruments.await("RANGE", moment + kTimeout, answer, telemetry.line()) &&
                    answer(1) >= 0 && answer(1) <= 2;

  // The filter.
  const float dt = late ? wake_timer::to_seconds(moment - previous) : kPeriod;
  sample.time.add(moment - previous);
  sample.status = filter.predict(dt);
  if (sample.measured) {
    sample.beacon = static_cast<uint32_t>(answer(1));
    update(answer);
  }

  // What is kept, and the line.
  since_checkpoint += dt;
  if (since_checkpoint >= kCheckpointPeriod) save();
  sample.awake = wake_timer::take_awake();
  telemetry.write(sample, filter);
  telemetry.line().send();
}
