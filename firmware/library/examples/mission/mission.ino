// Steers a torpedo along a plan: from compass, gyro, log, depth gauge and USBL to rudder, stern
// planes and propeller, ten times a second, on an Arduino MEGA2560. What it computes is
// auvest/mission/pilot.hpp: a filter with the current in its state, guidance and control.
//
// A sample: the timer wakes the chip, it asks for the readings, and for a fix where one is due; as
// soon as all readings are here, or the time-out has come, it predicts, corrects by the fixes that
// have come, and sends the command for the actuators; then one line of text, and sleep until the
// next sample. Fixes come when they come, up to a second late: each is taken at its own time.
//
// The lines are in mission_line.h, what a silent sensor leads to is in pilot.hpp, its limits are in
// config.h, and the plan is in plan.h. `auvest mission` plays the vehicle.
//
// Moments add up, so they do not drift. If the chip is still busy more than 1 ms after a deadline,
// the sample is taken at once and counted as late; the prediction covers the time that really
// passed.
//
// A loop that hangs for two seconds is ended by the watchdog, and the board starts anew.
//
// Text, 115200 baud: $MISSION,...*hhhhhhhh; a line at the start names its columns. Now and then a
// comment says how much RAM was never used.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest_boot.h>
#include <auvest_wake_timer.h>
#include <avr/wdt.h>

#include "config.h"
#include "mission_line.h"
#include "plan.h"
#include "telemetry.h"

using Pilot = auvest::Pilot<float, IntervalPolicy, kKeptEvents>;

constexpr uint32_t kTicks = wake_timer::to_ticks(kPeriod);
constexpr uint32_t kTolerance = wake_timer::to_ticks(0.001f);
constexpr uint32_t kPause = wake_timer::to_ticks(0.05f);  // enough to look at the RAM
constexpr uint32_t kSecond = wake_timer::to_ticks(1);

Pilot::Params settings() {
  Pilot::Params p;
  p.period_s = kPeriod;
  p.speed_m_s = kSpeed;
  p.depth_m = kDepth;
  p.end_m = kEnd;
  p.hold_s = kHold;
  p.compass_s = kCompassHold;
  p.lost_m = kLost;
  p.sonar.station_x_m = 0;
  p.sonar.station_y_m = 0;
  p.sonar.sigma_range_m = kSigmaRange;
  p.sonar.sigma_bearing_rad = kSigmaBearing;
  p.waypoints.switch_m = kSwitch;
  return p;
}

// Other policies have parameters of their own.
IntervalPolicy policy() {
  IntervalPolicy::Params p;
  p.interval_s = kFixInterval;
  return IntervalPolicy(p);
}

// All objects are global: what they take is known before the sketch runs.
Pilot pilot(settings(), policy());
MissionLine vehicle;
Telemetry telemetry;
Sample sample;
uint32_t moment = 0;    // of this sample, ticks
uint32_t deadline = 0;  // of the next one, ticks

static_assert(auvest_board::fits(sizeof pilot + sizeof vehicle + sizeof telemetry + sizeof sample,
                                 kStackReserve),
              "the objects of this sketch leave less than kStackReserve bytes of RAM to the stack");

// The functions are not inlined: what one needs on the stack must not lie there for another.

// Of several results of a sample, the first that is not kOk is told.
void note(auvest::Status status) {
  if (sample.status == auvest::Status::kOk) sample.status = status;
}

AUVEST_OUTLINE auvest::Status start_pilot() {
  const MissionStart& at = vehicle.start();
  return pilot.start(kPlan, kWaypoints, at.x_m, at.y_m, at.heading_rad);
}

AUVEST_OUTLINE void update() {
  sample.fixes = 0;
  for (uint8_t i = 0; i < vehicle.fixes(); ++i) {
    const MissionFix& fix = vehicle.fix(i);
    const float age = static_cast<float>(sample.number - fix.sample) * kPeriod - fix.delay_s;
    const auto report = pilot.update(fix.z, age > 0 ? age : 0.0f);
    note(report.status);
    if (report.status != auvest::Status::kOk) continue;
    ++sample.fixes;
    sample.nis = report.nis;
  }
  vehicle.forget_fixes();
}

AUVEST_OUTLINE void steer() {
  auvest::TorpedoCommand<float> command;
  note(pilot.steer(command));
  vehicle.steer(command);
}

AUVEST_OUTLINE void report() {
  sample.refused = vehicle.refused();
  sample.awake = wake_timer::take_awake();
  telemetry.write(sample, pilot);
  if (sample.number % (120 * kSamplesPerLine) == 0 && !wake_timer::reached(deadline - kPause)) {
    telemetry.line().send();
    auvest_board::remark_ram(auvest_board::ram_unused());
  }
}

void setup() {
  wdt_enable(WDTO_2S);
  Serial.begin(auvest_board::kBaud);
  auvest_board::announce_boot();
  Telemetry::introduce();
  wake_timer::begin();
  while (!vehicle.started()) {
    wdt_reset();
    vehicle.announce();
    moment += kSecond;
    vehicle.await([] { return vehicle.started(); }, moment, telemetry.line());
  }
  const auvest::Status status = start_pilot();
  if (status != auvest::Status::kOk) {
    Serial.print(F("# the pilot does not start: "));
    Serial.println(auvest::describe(status));
    for (;;) wdt_reset();
  }
  moment = wake_timer::now();
  deadline = moment + kTicks;
}

void loop() {
  wdt_reset();

  // The moment of this sample.
  vehicle.await([] { return false; }, deadline, telemetry.line());
  const uint32_t now = wake_timer::now();
  const bool late = now - deadline > kTolerance;
  const uint32_t previous = moment;
  moment = late ? now : deadline;
  deadline = moment + kTicks;
  telemetry.line().send();  // what is left of the one before
  vehicle.begin(++sample.number);
  const bool ping = pilot.wants_fix();
  if (ping) pilot.asked();
  vehicle.ask(ping);
  vehicle.await([] { return vehicle.all_heard(); }, moment + wake_timer::to_ticks(kReadingTimeout),
                telemetry.line());

  // The pilot.
  sample.heard = vehicle.readings().heard;
  sample.time.add(moment - previous);
  sample.dt = late ? wake_timer::to_seconds(moment - previous) : kPeriod;
  sample.status = auvest::Status::kOk;
  note(pilot.predict(vehicle.readings(), sample.dt));
  vehicle.close();
  update();
  steer();

  // The line.
  for (uint8_t bit = 1; bit <= auvest::kDepthHeard; bit <<= 1) {
    if (!(sample.heard & bit)) ++sample.missed;
  }
  if (late) ++sample.late;
  if (sample.number % kSamplesPerLine == 0) report();
}
