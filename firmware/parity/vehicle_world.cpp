// Flies a mission on the desk (simulation/mission.hpp) with the vehicle's own part in float, and
// writes what its sensors told, step by step: where the estimate began, then compass, pitch rate,
// yaw rate, depth, log, sway log, pitch, range, bearing; NaN where nothing was told. And after them
// what was commanded: rudder, stern planes, propeller. firmware/parity/vehicle.py reads it.
//
//     vehicle_world TRACK LAW KERNEL REJECTIONS ARC SPEED SECONDS OUTLIERS SEED > FILE
//
// TRACK, LAW and KERNEL are the numbers of their enumerations. The rest is what a mission is by
// default, with a model-aided estimate.
#include <cstdio>
#include <cstdlib>

#include "auvest/math/bits.hpp"
#include "simulation/mission.hpp"

namespace {

using auvest::MissionStep;

class Recorder {
 public:
  void operator()(const MissionStep& step) {
    if (!begun_) {
      write(step.estimate_m[0]);
      write(step.estimate_m[1]);
    }
    begun_ = true;
    const auvest::MissionReadings& told = step.readings;
    write(told.compass_rad);
    write(told.pitch_rate_rad_s);
    write(told.yaw_rate_rad_s);
    write(told.depth_m);
    write(told.log_m_s[0]);
    write(told.log_m_s[1]);
    write(told.pitch_rad);
    write(told.fix[0]);
    write(told.fix[1]);
    for (int i = 0; i < 3; ++i) write(step.command[i]);
  }

 private:
  static void write(double value) {
    const float number =
        auvest::math::is_nan(value) ? auvest::math::quiet_nan() : static_cast<float>(value);
    const std::uint32_t word = auvest::math::to_bits(number);
    for (int i = 0; i < 4; ++i) std::putchar(static_cast<int>(word >> 8 * i & 0xff));
  }

  bool begun_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 10) {
    std::fputs("usage: vehicle_world TRACK LAW KERNEL REJECTIONS ARC SPEED SECONDS OUTLIERS SEED\n",
               stderr);
    return 2;
  }
  auvest::MissionScenario s;
  s.track = static_cast<auvest::MissionTrack>(std::atoi(argv[1]));
  s.guidance = static_cast<auvest::MissionGuidance>(std::atoi(argv[2]));
  s.kernel.kind = static_cast<auvest::AnyKernel<double>::Kind>(std::atoi(argv[3]));
  const int rejections = std::atoi(argv[4]);
  s.recovery.enabled = rejections > 0;
  if (rejections > 0) {
    s.recovery.streak.params.rejections = static_cast<std::uint8_t>(rejections);
  }
  s.arc_m = std::atof(argv[5]);
  s.speed_m_s = std::atof(argv[6]);
  s.circle_s = s.most_s = std::atof(argv[7]);
  s.usbl.outliers = std::atof(argv[8]);
  s.estimate = auvest::MissionEstimate::kModelAided;
  s.interval.fixed.params.interval_s = 0.5;
  Recorder recorder;
  const auvest::MissionResult result =
      auvest::fly_mission<float>(s, std::strtoull(argv[9], nullptr, 10), 0,
                                 [&recorder](const MissionStep& step) { recorder(step); });
  return result.status == auvest::Status::kOk ? 0 : 1;
}
