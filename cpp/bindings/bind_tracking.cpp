#include <pybind11/stl.h>

#include <array>

#include "auvest/scenarios/tracking.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {

void bind_tracking(py::module_& m) {
  using Vector2 = std::array<double, 2>;
  py::class_<Track>(m, "Track", "The true and desired track of the tracking scenario.")
      .def(py::init([](const std::string& kind, const Vector2& position, const Vector2& velocity,
                       const Vector2& acceleration, double turn_rate, double wander_m,
                       double wander_period_s) {
             Track track;
             if (kind == "euler") {
               track.kind = Track::Kind::kEuler;
             } else if (kind == "straight") {
               track.kind = Track::Kind::kStraight;
             } else if (kind == "turn") {
               track.kind = Track::Kind::kTurn;
             } else {
               throw py::value_error("kind must be 'euler', 'straight' or 'turn'");
             }
             for (std::size_t i = 0; i < 2; ++i) {
               track.position[i] = position[i];
               track.velocity[i] = velocity[i];
               track.acceleration[i] = acceleration[i];
             }
             track.turn_rate = turn_rate;
             track.wander_m = wander_m;
             track.wander_period_s = wander_period_s;
             return track;
           }),
           py::arg("kind"), py::arg("position"), py::arg("velocity"), py::arg("acceleration"),
           py::arg("turn_rate"), py::arg("wander_m"), py::arg("wander_period_s"))
      .def("advance", &Track::advance, py::arg("dt"))
      .def_property_readonly("position", [](const Track& t) {
        return Vector2{t.position[0], t.position[1]};
      });
  m.def("track_defaults", [] {
    const Track t;
    py::dict result;
    result["position"] = Vector2{t.position[0], t.position[1]};
    result["velocity"] = Vector2{t.velocity[0], t.velocity[1]};
    result["acceleration"] = Vector2{t.acceleration[0], t.acceleration[1]};
    result["turn_rate"] = t.turn_rate;
    result["wander_m"] = t.wander_m;
    result["wander_period_s"] = t.wander_period_s;
    return result;
  });
  m.def("noise_defaults", [] {
    const SensorNoise n;
    py::dict result;
    result["range_m"] = n.range_m;
    result["bearing_rad"] = n.bearing_rad;
    result["centred"] = n.centred;
    result["dropout"] = n.dropout;
    return result;
  });

  const auto kind_of = [](const std::string& kind) {
    if (kind == "uniform") return SensorNoise::Kind::kUniform;
    if (kind == "normal") return SensorNoise::Kind::kNormal;
    if (kind == "lognormal") return SensorNoise::Kind::kLognormal;
    throw py::value_error("kind must be 'uniform', 'normal' or 'lognormal'");
  };
  py::class_<SensorNoise>(m, "SensorNoise", "The paper's three noises, scaled.")
      .def(py::init([kind_of](const std::string& kind, double range_m, double bearing_rad,
                              bool centred, double dropout) {
             SensorNoise noise;
             noise.kind = kind_of(kind);
             noise.range_m = range_m;
             noise.bearing_rad = bearing_rad;
             noise.centred = centred;
             noise.dropout = dropout;
             return noise;
           }),
           py::arg("kind"), py::arg("range_m"), py::arg("bearing_rad"), py::arg("centred"),
           py::arg("dropout"));
  m.def(
      "noise_mean", [kind_of](const std::string& kind) { return SensorNoise::mean(kind_of(kind)); },
      py::arg("kind"), "Mean of the unscaled noise.");
  m.def(
      "noise_standard_deviation",
      [kind_of](const std::string& kind) { return SensorNoise::standard_deviation(kind_of(kind)); },
      py::arg("kind"), "Standard deviation of the unscaled noise.");
}

}  // namespace bindings
}  // namespace auvest
