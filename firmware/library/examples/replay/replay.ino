// Replays 60 steps of the AUKF paper's simulation from flash: does this board compute what the desk
// computes, and how long does it take?
//
// Each line: step, estimate [m], interval to the next sample [s], cycles of the processor for
// predict, update and feedback. Timer1 counts them in eights. The record is in record.h.
#include <Arduino.h>
#include <auvest.h>
#include <auvest_board.h>
#include <auvest/self_test.hpp>

#include "record.h"

using Process = auvest::EulerAcceleration<float>;
using Filter = auvest::Aukf<Process>;

auvest::Ukf<Process> make_ukf() {
  auvest::Ukf<Process>::Params points = auvest::Ukf<Process>::default_params();
  points.alpha = 1e-6f;  // Table 1
  return auvest::Ukf<Process>(Process(), points);
}

Filter filter(make_ukf());

auvest::RangeBearing<float, 6> make_sonar() {
  auvest::RangeBearing<float, 6> made;
  made.params.lift_smallest();  // simulated: the noise is not cut off at a range of 0
  return made;
}

const auvest::RangeBearing<float, 6> sonar = make_sonar();

float stored(const uint32_t* bits) { return auvest::math::from_bits(pgm_read_dword(bits)); }

auvest::Status start() {
  Filter::State x;
  Filter::Covariance P = Filter::Covariance::Zero();
  for (int i = 0; i < 6; ++i) {
    x(i) = stored(&kStart[i]);
    P(i, i) = stored(&kStartVariances[i]);
  }
  return filter.reset(x, P);
}

auvest::Status step(const uint32_t* row) {
  const auvest::Vector<float, 2> z(stored(row), stored(row + 1));
  const auvest::Vector<float, 2> desired(stored(row + 2), stored(row + 3));
  auvest::Status status = filter.predict(filter.interval());
  if (status == auvest::Status::kOk) status = filter.update(z, sonar).status;
  if (status == auvest::Status::kOk) status = filter.feedback(desired);
  return status;
}

void setup() {
  Serial.begin(115200);
  auvest::Status status = start();

  TCCR1A = 0;
  TCCR1B = _BV(CS11);  // one count per 8 cycles: 16 bits are good for 33 ms
  Serial.println(F("# step,x_m,y_m,interval_s,cycles"));
  for (uint8_t k = 0; k < kSteps && status == auvest::Status::kOk; ++k) {
    noInterrupts();
    TCNT1 = 0;
    status = step(kRecord[k]);
    const uint32_t cycles = 8ul * TCNT1;
    interrupts();
    Serial.print(k + 1);
    Serial.print(',');
    Serial.print(filter.x()(0), 4);
    Serial.print(',');
    Serial.print(filter.x()(1), 4);
    Serial.print(',');
    Serial.print(filter.interval(), 4);
    Serial.print(',');
    Serial.println(cycles);
  }

  bool same = true;
  for (int i = 0; i < 6; ++i) {
    same = same && auvest::math::to_bits(filter.x()(i)) == pgm_read_dword(&kLastState[i]);
  }
  Serial.print(F("# status: "));
  Serial.println(auvest::describe(status));
  Serial.print(F("# last state: "));
  Serial.println(same ? F("the same bits as on the desk") : F("OTHER BITS than on the desk"));
  Serial.print(F("# self-test: "));
  Serial.println(auvest::describe(auvest::self_test().failed));
  Serial.print(F("# bytes of stack used: "));
  Serial.println(auvest_board::stack_used());
  Serial.print(F("# bytes of RAM never used: "));
  Serial.println(auvest_board::ram_unused());
}

void loop() {}
