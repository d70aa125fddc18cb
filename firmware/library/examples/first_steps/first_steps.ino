// The smallest program: a filter, one prediction, one measurement, one estimate.
#include <Arduino.h>
#include <auvest.h>

using Process = auvest::EulerAcceleration<float>;

auvest::Ukf<Process> filter{Process()};      // six states: x, y, vx, vy, ax, ay
const auvest::RangeBearing<float, 6> sonar;  // a station at (0.2, 2) m

void setup() {
  Serial.begin(115200);

  // Where the vehicle is at the start, and how sure we are: 0.1 m, 0.1 m/s, 0.1 m/s^2.
  auvest::Vector<float, 6> x;
  x << 3, 4, 0.1f, 0.2f, 0, 0;
  const auvest::Matrix<float, 6, 6> P = 0.01f * auvest::Matrix<float, 6, 6>::Identity();
  auvest::Status status = filter.reset(x, P);

  // Half a second later the sonar measures 3.6 m in a direction of 0.65 rad.
  if (status == auvest::Status::kOk) status = filter.predict(0.5f);
  if (status == auvest::Status::kOk) {
    status = filter.update(auvest::Vector<float, 2>(3.6f, 0.65f), sonar).status;
  }

  Serial.println(auvest::describe(status));
  Serial.print("x = ");
  Serial.print(filter.x()(0), 3);
  Serial.print(" m, y = ");
  Serial.print(filter.x()(1), 3);
  Serial.println(" m");
}

void loop() {}
