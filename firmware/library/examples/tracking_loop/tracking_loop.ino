// Tracks a vehicle by range and bearing, and lets the filter choose when to measure next: the loop
// of the AUKF paper (Deng, Yin, Duan 2019) on an Arduino MEGA2560.
//
// A sample: the timer wakes the chip, the sonar is triggered, the chip sleeps until the answer is
// here, predict - update - feedback, one line of text, sleep until the moment that feedback chose.
//
// Moments. T(k) counts from the moment of sample k, not from the end of its computing: deadlines
// add up, so they do not drift (each T is rounded to 4 us). If the chip is still busy more than
// 1 ms after a deadline, the sample is taken at once and counted as late: the prediction covers the
// time that really passed, and the next interval counts from there.
//
// Missing measurements. No answer in time, a wrong checksum, garbage, an answer to another sample:
// the estimate is predicted only, and counted as missed.
//
// Impossible measurements. A range that sound cannot have come back from has the status
// kImpossibleRange; one that changes faster than the vehicle moves, a bearing beyond a turn, or
// both beyond the gate of the filter, kImplausible. All are predicted
// only.
//
// A loop that hangs for two seconds is ended by the watchdog, and the board starts anew.
//
// Text, 115200 baud. Each sample gives one line, $AUV,...*hhhhhhhh; a line at the start names its
// columns. `auvest capture` makes a table and a figure of it; config.h has the other choices. A
// line goes out at once if it is through before the next deadline, else behind the next request:
// samples every 20 ms (T_min) keep their moments. Now and then a comment says how much RAM was
// never used.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest_boot.h>
#include <auvest_wake_timer.h>
#include <avr/wdt.h>

#include "config.h"
#include "sonar.h"
#include "telemetry.h"

using Filter = auvest::AdaptiveInterval<auvest::Gated<auvest::Ukf<Process>>, IntervalPolicy>;

constexpr uint32_t kTolerance = wake_timer::to_ticks(0.001f);
constexpr uint32_t kTimeout = wake_timer::to_ticks(kAnswerTimeout);
constexpr float kTurn = 6.2842f;                          // 2 pi, and a little for rounding
constexpr uint32_t kPause = wake_timer::to_ticks(0.05f);  // enough to look at the RAM

auvest::Ukf<Process>::Params points() {
  auvest::Ukf<Process>::Params points = auvest::Ukf<Process>::default_params();
  points.alpha = kAlpha;
  return points;
}

auvest::RangeBearing<float, 6>::Params sonar_params() {
  auvest::RangeBearing<float, 6>::Params params;  // where the station is, how good the sonar is
  params.largest_range_m = kLargestRange;
  return params;
}

// All objects are global: what they take is known before the sketch runs.
Filter filter(Process(), points());
const auvest::RangeBearing<float, 6> model(sonar_params());
SerialSonar sonar(kTriggerPin);
auvest::PlausibleReading<float> range;
Telemetry telemetry;
Sample sample;
uint8_t refusals = 0;   // by the gate, in a row
uint32_t moment = 0;    // of this sample, ticks
uint32_t deadline = 0;  // of the next one, ticks

static_assert(auvest_board::fits(sizeof filter + sizeof model + sizeof sonar + sizeof telemetry,
                                 kStackReserve),
              "the objects of this sketch leave less than kStackReserve bytes of RAM to the stack");

// The desired track, which the paper's law looks at: constant acceleration from the start.
Filter::Position desired(float time_s) {
  const Filter::Position start(0.2f, 2.0f);
  const Filter::Position velocity(0.1f, 0.2f);
  const Filter::Position acceleration(0.01f, 0.02f);
  Filter::Position position;
  for (int i = 0; i < 2; ++i) {
    position(i) = start(i) + time_s * (velocity(i) + 0.5f * acceleration(i) * time_s);
  }
  return position;
}

auvest::Status start_filter() {
  Filter::State x;
  x << 0.2f, 2.0f, 0.1f, 0.2f, 0.01f, 0.02f;  // m, m/s, m/s^2: Table 1 of the paper
  const float sigma[] = {0.05f, 0.05f, 0.02f, 0.02f, 0.005f, 0.005f};
  Filter::Covariance P = Filter::Covariance::Zero();
  for (int i = 0; i < 6; ++i) P(i, i) = sigma[i] * sigma[i];
  return filter.reset(x, P);
}

// Of several results of a sample, the first that is not kOk is told.
void note(auvest::Status status) {
  if (sample.status == auvest::Status::kOk) sample.status = status;
}

bool can_be(const SerialSonar::Measurement& z) {
  const auvest::ReadingLimits<float> limits(-kLargestRange, kLargestRange, kFastest, kRangeJitter);
  return range.admits(z(0), limits) && auvest::math::within(z(1), -kTurn, kTurn);
}

void update() {
  const auvest::Status admitted = model.admits(sample.z);
  auvest::Status status =
      admitted != auvest::Status::kOk || can_be(sample.z) ? admitted : auvest::Status::kImplausible;
  if (status == auvest::Status::kOk) {
    const auto correction = filter.update(sample.z, model);
    status = correction.status;
    sample.nis = correction.nis;
    if (status == auvest::Status::kOk) {
      range.take(sample.z(0));
      refusals = 0;
    } else if (++refusals > kPatience) {
      filter.widen(correction.nis);
    }
  }
  note(status);
}

void setup() {
  wdt_enable(WDTO_2S);
  Serial.begin(auvest_board::kBaud);
  sonar.begin();
  auvest_board::announce_boot();
  Telemetry::introduce();
  const auvest::Status status = start_filter();
  if (status != auvest::Status::kOk) {
    Serial.print(F("# "));
    Serial.println(auvest::describe(status));
    for (;;) wdt_reset();
  }
  wake_timer::begin();
  deadline = moment + wake_timer::to_ticks(filter.interval());
}

void loop() {
  wdt_reset();

  // The moment of this sample.
  wake_timer::sleep_until_moment(deadline);
  const uint32_t now = wake_timer::now();
  const bool late = now - deadline > kTolerance;
  const uint32_t previous = moment;
  moment = late ? now : deadline;
  sonar.trigger(++sample.number);
  sample.measured = sonar.await(moment + kTimeout, sample.z, telemetry.line());

  // The filter.
  sample.time.add(moment - previous);
  sample.dt = late ? wake_timer::to_seconds(moment - previous) : filter.interval();
  sample.desired = desired(sample.time.in_seconds());
  sample.status = filter.predict(sample.dt);
  sample.nis = -1;
  range.wait(sample.dt);
  if (sample.measured) update();
  note(filter.feedback(sample.desired));
  deadline = moment + wake_timer::to_ticks(filter.interval());

  // The line.
  if (!sample.measured) ++sample.missed;
  if (late) ++sample.late;
  sample.refused = sonar.refused();
  sample.awake = wake_timer::take_awake();
  telemetry.line().send();  // what is left of the one before
  telemetry.write(sample, filter);
  if (!wake_timer::reached(deadline - telemetry.line().duration())) telemetry.line().send();
  if (sample.number % 60 == 0 && !wake_timer::reached(deadline - kPause)) {
    auvest_board::remark_ram(auvest_board::ram_unused());
  }
}
