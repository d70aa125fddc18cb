#include <pybind11/stl.h>

#include <array>
#include <cmath>
#include <string>

#include "binders.hpp"
#include "mission_scenario.hpp"
#include "simulation/mission.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
MissionResult fly(const MissionScenario& s, int freedom, std::uint64_t seed, std::uint32_t run,
                  const MissionSink& sink) {
  switch (freedom) {
    case 3:
      return fly_mission<Scalar, ThreeDof>(s, seed, run, sink);
    case 4:
      return fly_mission<Scalar, FourDof>(s, seed, run, sink);
    case 5:
      return fly_mission<Scalar, FiveDof>(s, seed, run, sink);
    default:
      return fly_mission<Scalar, SixDof>(s, seed, run, sink);
  }
}

/// Monte Carlo: run r draws from the streams of first_run + r of the seed, so the runs may be
/// shared out to any number of threads. Of each run the first `rows` steps are kept; what lies
/// behind its end is NaN.
py::dict fly_missions(const py::dict& values) {
  const MissionScenario scenario = to_scenario(values);
  const bool single = values["dtype"].cast<std::string>() == "float32";
  const auto freedom = values["freedom"].cast<int>();
  const auto seed = values["seed"].cast<std::uint64_t>();
  const auto first_run = values["first_run"].cast<std::uint32_t>();
  const auto runs = values["runs"].cast<py::ssize_t>();
  const auto rows = values["rows"].cast<py::ssize_t>();

  // What is kept of each step, and of how many numbers it is.
  enum Column {
    kPose,
    kWater,
    kCross,
    kEstimate,
    kCurrent,
    kCommand,
    kInterval,
    kNis,
    kNeesPosition,
    kNees,
    kSettled,
    kColumns
  };
  const std::array<const char*, kColumns> names = {
      "pose",    "water",      "cross_m", "estimate_m",    "estimate_current_m_s",
      "command", "interval_s", "nis",     "nees_position", "nees",
      "settled"};
  const std::array<py::ssize_t, kColumns> sizes = {6, 6, 1, 2, 2, 3, 1, 1, 1, 1, 1};
  std::array<py::array_t<double>, kColumns> columns;
  std::array<double*, kColumns> out{};
  for (std::size_t c = 0; c < kColumns; ++c) {
    const std::vector<py::ssize_t> flat{runs, rows};
    const std::vector<py::ssize_t> deep{runs, rows, sizes[c]};
    columns[c] = py::array_t<double>(sizes[c] == 1 ? flat : deep);
    out[c] = columns[c].mutable_data();
    std::fill_n(out[c], columns[c].size(), std::nan(""));
  }
  std::array<py::array_t<double>, 6> numbers;
  const std::array<const char*, 6> of_run = {"duration_s",      "settled_rms_m",
                                             "all_rms_m",       "position_rms_m",
                                             "mean_interval_s", "rudder_travel_rad_s"};
  for (auto& array : numbers) array = py::array_t<double>(runs);
  py::array_t<std::int64_t> fixes(runs), refused(runs);
  py::array_t<std::uint8_t> status(runs);
  py::array_t<bool> finished(runs);
  std::array<double*, 6> of_run_out{};
  for (std::size_t i = 0; i < numbers.size(); ++i) of_run_out[i] = numbers[i].mutable_data();
  auto* fixes_out = fixes.mutable_data();
  auto* refused_out = refused.mutable_data();
  auto* status_out = status.mutable_data();
  auto* finished_out = finished.mutable_data();
  {
    py::gil_scoped_release release;
    for (py::ssize_t run = 0; run < runs; ++run) {
      py::ssize_t row = 0;
      const MissionSink sink = [&](const MissionStep& step) {
        if (row >= rows) return;
        const auto put = [&](Column c, const double* from) {
          const py::ssize_t size = sizes[c];
          double* const to = out[c] + (run * rows + row) * size;
          for (py::ssize_t i = 0; i < size; ++i) to[i] = from[i];
        };
        const double settled = step.settled ? 1.0 : 0.0;
        put(kPose, step.truth.pose);
        put(kWater, step.truth.water);
        put(kCross, &step.cross_m);
        put(kEstimate, step.estimate_m);
        put(kCurrent, step.estimate_current_m_s);
        put(kCommand, step.command);
        put(kInterval, &step.interval_s);
        put(kNis, &step.nis);
        put(kNeesPosition, &step.nees_position);
        put(kNees, &step.nees);
        put(kSettled, &settled);
        ++row;
      };
      const auto number = first_run + static_cast<std::uint32_t>(run);
      const MissionResult result = single ? fly<float>(scenario, freedom, seed, number, sink)
                                          : fly<double>(scenario, freedom, seed, number, sink);
      const std::array<double, 6> values_of_run = {result.duration_s, result.settled_rms_m,
                                                   result.all_rms_m,  result.position_rms_m,
                                                   result.interval_s, result.rudder_travel_rad_s};
      for (std::size_t i = 0; i < values_of_run.size(); ++i) of_run_out[i][run] = values_of_run[i];
      fixes_out[run] = result.fixes;
      refused_out[run] = result.refused;
      status_out[run] = static_cast<std::uint8_t>(result.status);
      finished_out[run] = result.finished;
    }
  }
  py::dict result;
  for (std::size_t c = 0; c < kColumns; ++c) result[names[c]] = columns[c];
  for (std::size_t i = 0; i < numbers.size(); ++i) result[of_run[i]] = numbers[i];
  result["fixes"] = fixes;
  result["refused"] = refused;
  result["status"] = status;
  result["finished"] = finished;
  return result;
}

std::array<const char*, kMissionSources> source_names() {
  std::array<const char*, kMissionSources> names{};
  for (int i = 0; i < kMissionSources; ++i) {
    names[static_cast<std::size_t>(i)] = name_of(static_cast<MissionSource>(i));
  }
  return names;
}

/// The policy as the name of its class and its parameters.
py::tuple class_of(const AnyInterval<double>& interval) {
  using Kind = AnyInterval<double>::Kind;
  switch (interval.kind) {
    case Kind::kMahalanobis:
      return py::make_tuple("MahalanobisInterval", to_dict(interval.mahalanobis.params));
    case Kind::kCovarianceBudget:
      return py::make_tuple("CovarianceBudget", to_dict(interval.budget.params));
    case Kind::kFixed:
      break;
  }
  return py::make_tuple("FixedInterval", to_dict(interval.fixed.params));
}

/// A row of the closed-loop table; kernel: whether it has one, IGG as it comes.
py::dict source(const std::string& name, const std::string& track, double interval_s) {
  const auto row = kind_named<MissionSource>(name, "source", source_names());
  MissionScenario s =
      mission_source(row, kind_named<MissionTrack>(track, "track", kTracks), interval_s);
  py::dict result;
  visit_numbers(s, [&result](const char* key, double& value) { result[key] = value; });
  result["track"] = track;
  result["estimate"] = kEstimates[static_cast<std::size_t>(s.estimate)];
  result["guidance"] = kLaws[static_cast<std::size_t>(s.guidance)];
  result["interval"] = class_of(s.interval);
  result["kernel"] = s.kernel.kind != AnyKernel<double>::Kind::kUnit;
  return result;
}

/// The poses that Dubins curves join, (8, 3), or the points of the spline, (29, 2).
py::array_t<double> curve_plan(const std::string& path) {
  using Curve = mission_detail::MissionCurve<double>;
  const Curve curve{MissionScenario()};
  const bool spline = kind_named<MissionLegs>(path, "path", kLegs) == MissionLegs::kSpline;
  const py::ssize_t rows = spline ? Curve::kPoints : mission_detail::kMissionCorners;
  const std::vector<py::ssize_t> shape{rows, spline ? 2 : 3};
  py::array_t<double> plan(shape);
  double* out = plan.mutable_data();
  for (py::ssize_t i = 0; i < rows; ++i) {
    *out++ = spline ? curve.points()[i].x_m : curve.poses()[i].x_m;
    *out++ = spline ? curve.points()[i].y_m : curve.poses()[i].y_m;
    if (!spline) *out++ = curve.poses()[i].heading_rad;
  }
  return plan;
}

}  // namespace

void bind_mission(py::module_& m) {
  m.def("fly_missions", &fly_missions, py::arg("scenario"));
  m.def("mission_defaults", [] {
    MissionScenario s;
    py::dict result;
    visit_numbers(s, [&result](const char* name, double& value) { result[name] = value; });
    return result;
  });
  m.def("mission_sources", &source_names);
  m.def("mission_curve_plan", &curve_plan, py::arg("path"));
  m.def("mission_source", &source, py::arg("name"), py::arg("track"), py::arg("interval_s"));
}

}  // namespace bindings
}  // namespace auvest
