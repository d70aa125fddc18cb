#include <pybind11/stl.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "auvest/guidance/dubins_path.hpp"
#include "auvest/guidance/spline_path.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
PathPose<Scalar> item_from(const Scalar* row, const PathPose<Scalar>*) {
  return {row[0], row[1], row[2]};
}
template <class Scalar>
Waypoint<Scalar> item_from(const Scalar* row, const Waypoint<Scalar>*) {
  return {row[0], row[1]};
}

/// A path and the plan that it leads through: rows of `Width` numbers.
template <class Path, class Item, int Width>
class PathHandle {
 public:
  using Scalar = typename Path::Scalar;

  PathHandle(const Array<Scalar>& plan, const py::dict& params)
      : path_(from_dict<typename Path::Params>(params)) {
    require_ok(path_.check());
    require_shape(plan, {-1, Width}, "plan");
    for (py::ssize_t i = 0; i < plan.shape(0); ++i) {
      plan_.push_back(item_from(plan.data() + Width * i, static_cast<const Item*>(nullptr)));
    }
    const Status status = path_.start(plan_.data(), static_cast<std::uint16_t>(plan_.size()));
    if (status == Status::kOk) return;
    throw py::value_error("leg " + std::to_string(path_.report().leg) + ": " +
                          describe(path_.report().problem));
  }
  PathHandle(const PathHandle&) = delete;
  PathHandle& operator=(const PathHandle&) = delete;

  /// Direction, along, across, curvature.
  py::tuple locate(Scalar x, Scalar y) {
    PathPoint<Scalar> p;
    require_ok(path_.locate(x, y, p));
    return py::make_tuple(p.direction_rad, p.along_m, p.cross_m, p.curvature);
  }

  /// The leg that is warned of and why, or None.
  py::object warning() const {
    const PlanReport& report = path_.report();
    if (report.problem == PlanProblem::kNone) return py::none();
    return py::make_tuple(report.leg, describe(report.problem));
  }

  const Path& path() const { return path_; }

 private:
  std::vector<Item> plan_;
  Path path_;
};

template <class Handle>
void bind_path(py::module_& m, const char* stem) {
  using Scalar = typename Handle::Scalar;
  py::class_<Handle>(m, named<Scalar>(stem).c_str())
      .def(py::init<const Array<Scalar>&, const py::dict&>(), py::arg("plan").noconvert(),
           py::arg("params"))
      .def("locate", &Handle::locate, py::arg("x_m"), py::arg("y_m"))
      .def("warning", &Handle::warning)
      .def_property_readonly("leg", [](const Handle& h) { return h.path().leg(); })
      .def_property_readonly("finished", [](const Handle& h) { return h.path().finished(); })
      .def_property_readonly("remaining_m", [](const Handle& h) { return h.path().remaining_m(); });
}

template <class Scalar>
void bind_paths(py::module_& m) {
  bind_path<PathHandle<DubinsPath<Scalar>, PathPose<Scalar>, 3>>(m, "DubinsPath");
  bind_path<PathHandle<SplinePath<Scalar>, Waypoint<Scalar>, 2>>(m, "SplinePath");
}

/// Side (1 clockwise, -1 anticlockwise, 0 straight on) and length of each part [m].
std::vector<std::pair<int, double>> parts_of_shortest_curve(const std::array<double, 3>& from,
                                                            const std::array<double, 3>& to,
                                                            double radius_m) {
  DubinsCurve<double> curve;
  require_ok(shortest_curve(PathPose<double>{from[0], from[1], from[2]},
                            PathPose<double>{to[0], to[1], to[2]}, radius_m, curve));
  std::vector<std::pair<int, double>> parts;
  for (const auto& part : curve.parts) parts.emplace_back(part.side, part.length_m);
  return parts;
}

}  // namespace

void bind_guidance(py::module_& m) {
  bind_paths<float>(m);
  bind_paths<double>(m);
  m.def("dubins_defaults", [] { return to_dict(DubinsPath<double>::Params()); });
  m.def("spline_defaults", [] { return to_dict(SplinePath<double>::Params()); });
  m.def("shortest_curve", &parts_of_shortest_curve, py::arg("start"), py::arg("end"),
        py::arg("radius_m"));
}

}  // namespace bindings
}  // namespace auvest
