#include <pybind11/stl.h>

#include <vector>

#include "auvest/mission/pilot.hpp"
#include "binders.hpp"
#include "mission_scenario.hpp"

namespace auvest {
namespace bindings {
namespace {

// ---- The vehicle of one run, step by step
// --------------------------------------------------------

class World {
 public:
  World(const py::dict& scenario, std::uint64_t seed, std::uint32_t run)
      : scenario_(to_scenario(scenario)), begin_(scenario_), world_(world(seed, run)) {}

  /// Readings of this moment, NaN where there is none: heading, pitch, q, r, u, v, depth.
  py::array_t<double> sense() {
    const double none = std::nan("");
    double values[7] = {none, none, none, none, none, none, none};
    world_.sample();
    const double now = truth().time_s;
    Reading<1> number;
    Reading<2> speeds;
    Reading<3> rates;
    while (world_.compass.take(now, number)) {
      values[0] = number.value[0];
      values[1] = truth().pose[4];
    }
    while (world_.gyro.take(now, rates)) {
      values[2] = rates.value[1];
      values[3] = rates.value[2];
    }
    while (world_.log.take(now, speeds)) {
      values[4] = speeds.value[0];
      values[5] = speeds.value[1];
    }
    while (world_.depth.take(now, number)) values[6] = number.value[0];
    return py::array_t<double>(7, values);
  }

  void ask() { world_.usbl.ask(truth()); }

  /// Fixes that have arrived: range, bearing, time of validity.
  std::vector<std::array<double, 3>> take_fixes() {
    std::vector<std::array<double, 3>> fixes;
    Reading<2> fix;
    while (world_.usbl.take(truth().time_s, fix)) {
      fixes.push_back({fix.value[0], fix.value[1], fix.valid_s});
    }
    return fixes;
  }

  void advance(const std::array<double, 3>& command, double dt, double time_s) {
    require_ok(world_.advance(command.data(), dt, time_s));
  }

  const VehicleTruth& truth() const { return world_.truth(); }
  std::array<double, 2> guess() const { return {world_.guess_m[0], world_.guess_m[1]}; }
  std::array<double, 2> current() const {
    return {world_.current.value[0], world_.current.value[1]};
  }
  double heading() const { return begin_.heading; }

 private:
  struct Begin {
    double place[2];
    double heading = 0;

    explicit Begin(const MissionScenario& s) {
      mission_detail::MissionPath<double>(s).start(place, heading);
    }
  };

  mission_detail::MissionWorld world(std::uint64_t seed, std::uint32_t run) const {
    return {scenario_, &mission_detail::launch_hull<SixDof>, begin_.place, begin_.heading, seed,
            run};
  }

  MissionScenario scenario_;
  Begin begin_;
  mission_detail::MissionWorld world_;
};

// ---- The pilot with the bits of the chip
// ---------------------------------------------------------

using ChipPilot = Pilot<float>;

/// Names the numbers of a pilot that a sketch sets.
template <class Visitor>
void visit_settings(ChipPilot::Params& p, Visitor&& v) {
  v("period_s", p.period_s);
  v("speed_m_s", p.speed_m_s);
  v("depth_m", p.depth_m);
  v("end_m", p.end_m);
  v("hold_s", p.hold_s);
  v("compass_s", p.compass_s);
  v("lost_m", p.lost_m);
  v("switch_m", p.waypoints.switch_m);
  v("lookahead_m", p.guidance.lookahead_m);
  v("station_x_m", p.sonar.station_x_m);
  v("station_y_m", p.sonar.station_y_m);
  v("sigma_range_m", p.sonar.sigma_range_m);
  v("sigma_bearing_rad", p.sonar.sigma_bearing_rad);
}

/// A pilot and the plan that it flies.
class PilotHandle {
 public:
  PilotHandle(const Array<float>& plan, const py::dict& settings, float interval_s)
      : pilot_(params(settings), policy(interval_s)) {
    require_shape(plan, {-1, 2}, "plan");
    for (py::ssize_t i = 0; i < plan.shape(0); ++i) {
      plan_.push_back({plan.data()[2 * i], plan.data()[2 * i + 1]});
    }
  }
  PilotHandle(const PilotHandle&) = delete;
  PilotHandle& operator=(const PilotHandle&) = delete;

  void start(float x, float y, float heading) {
    require_ok(pilot_.start(plan_.data(), static_cast<std::uint16_t>(plan_.size()), x, y, heading));
  }
  bool wants_fix() const { return pilot_.wants_fix(); }
  void asked() { pilot_.asked(); }

  /// `values` as those of World::sense().
  Status predict(const Array<float>& values, std::uint8_t heard, float dt) {
    require_shape(values, {7}, "values");
    ChipPilot::Readings r;
    r.heading_rad = values.data()[0];
    r.pitch_rad = values.data()[1];
    r.pitch_rate_rad_s = values.data()[2];
    r.yaw_rate_rad_s = values.data()[3];
    r.speed_m_s = values.data()[4];
    r.sway_m_s = values.data()[5];
    r.depth_m = values.data()[6];
    r.heard = heard;
    return pilot_.predict(r, dt);
  }

  py::tuple update(float range, float bearing, float age) {
    ChipPilot::Sonar::Measurement z;
    z(0) = range;
    z(1) = bearing;
    const auto report = pilot_.update(z, age);
    return py::make_tuple(report.status, report.nis);
  }

  py::tuple steer() {
    TorpedoCommand<float> c;
    const Status status = pilot_.steer(c);
    return py::make_tuple(status, c.rudder_rad, c.stern_planes_rad, c.propeller_rev_s);
  }

  const ChipPilot& pilot() const { return pilot_; }

 private:
  static ChipPilot::Params params(const py::dict& settings) {
    ChipPilot::Params p;
    py::size_t known = 0;
    visit_settings(p, [&](const char* name, float& value) {
      if (!settings.contains(name)) return;
      value = settings[name].cast<float>();
      ++known;
    });
    if (known != settings.size()) throw py::key_error("unknown setting in the dict");
    return p;
  }
  static FixedInterval<float> policy(float interval_s) {
    FixedInterval<float>::Params p;
    p.interval_s = interval_s;
    return FixedInterval<float>(p);
  }

  std::vector<Waypoint<float>> plan_;
  ChipPilot pilot_;
};

}  // namespace

void bind_pilot(py::module_& m) {
  py::class_<World>(m, "MissionWorld")
      .def(py::init<const py::dict&, std::uint64_t, std::uint32_t>(), py::arg("scenario"),
           py::arg("seed"), py::arg("run"))
      .def("sense", &World::sense)
      .def("ask", &World::ask)
      .def("take_fixes", &World::take_fixes)
      .def("advance", &World::advance, py::arg("command"), py::arg("dt"), py::arg("time_s"))
      .def_property_readonly("time_s", [](const World& w) { return w.truth().time_s; })
      .def_property_readonly("pose",
                             [](const World& w) { return py::array_t<double>(6, w.truth().pose); })
      .def_property_readonly("guess_m", &World::guess)
      .def_property_readonly("heading_rad", &World::heading)
      .def_property_readonly("current_m_s", &World::current);

  py::enum_<PilotMode>(m, "PilotMode")
      .value("waiting", PilotMode::kWaiting)
      .value("under_way", PilotMode::kUnderWay)
      .value("finished", PilotMode::kFinished)
      .value("silent", PilotMode::kSilent)
      .value("lost", PilotMode::kLost);

  py::class_<PilotHandle>(m, "Pilot_float32")
      .def(py::init<const Array<float>&, const py::dict&, float>(), py::arg("plan"),
           py::arg("settings"), py::arg("interval_s"))
      .def("start", &PilotHandle::start, py::arg("x_m"), py::arg("y_m"), py::arg("heading_rad"))
      .def("wants_fix", &PilotHandle::wants_fix)
      .def("asked", &PilotHandle::asked)
      .def("predict", &PilotHandle::predict, py::arg("values").noconvert(), py::arg("heard"),
           py::arg("dt"))
      .def("update", &PilotHandle::update, py::arg("range_m"), py::arg("bearing_rad"),
           py::arg("age_s"))
      .def("steer", &PilotHandle::steer)
      .def_property_readonly("mode", [](const PilotHandle& h) { return h.pilot().mode(); })
      .def_property_readonly("leg", [](const PilotHandle& h) { return h.pilot().path().leg(); })
      .def_property_readonly("x",
                             [](const PilotHandle& h) { return to_array(h.pilot().filter().x()); })
      .def_property_readonly("P",
                             [](const PilotHandle& h) { return to_array(h.pilot().filter().P()); })
      .def_property_readonly("heading_rad",
                             [](const PilotHandle& h) { return h.pilot().heading_rad(); })
      .def_property_readonly("cross_track_m",
                             [](const PilotHandle& h) { return h.pilot().cross_track_m(); })
      .def_property_readonly("implausible",
                             [](const PilotHandle& h) { return h.pilot().implausible(); });
}

}  // namespace bindings
}  // namespace auvest
