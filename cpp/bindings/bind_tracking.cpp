#include <pybind11/stl.h>

#include <array>
#include <cmath>

#include "auvest/models/range_bearing.hpp"
#include "handles.hpp"
#include "simulation/tracking.hpp"

namespace auvest {
namespace bindings {
namespace {

/// A draw from N(x, P): six normal deviates, in pairs.
template <class Adaptive>
typename Adaptive::State deviate(typename Adaptive::State x, const typename Adaptive::Covariance& p,
                                 math::Random& random) {
  using Scalar = typename Adaptive::Scalar;
  constexpr int kStates = Adaptive::kStates;
  static_assert(kStates % 2 == 0, "deviates come in pairs");
  typename Adaptive::Covariance root;
  Matrix<Scalar, 1, kStates> no_others;
  if (!math::factor_leading(p, root, no_others)) return x;  // reset refuses P and says why
  typename Adaptive::State normal;
  for (int i = 0; i < kStates; i += 2) {
    double first = 0;
    double second = 0;
    random.normal_pair(first, second);
    normal(i) = static_cast<Scalar>(first);
    normal(i + 1) = static_cast<Scalar>(second);
  }
  for (int i = 0; i < kStates; ++i) {
    for (int j = 0; j <= i; ++j) x(i) = x(i) + root(i, j) * normal(j);
  }
  return x;
}

/// Monte Carlo over the closed loop: run r draws from the stream first_run + r of the seed, so
/// the runs may be shared out to any number of threads. Rows after a run's end are NaN.
template <class Scalar>
py::dict simulate(const FilterHandle<Scalar>& handle, const Array<Scalar>& x0,
                  const Array<Scalar>& p0, const SensorHandle<Scalar>& handle_of_sensor,
                  const py::dict& scenario) {
  constexpr int kStates = 6;
  constexpr int kSize = 2;
  using Adaptive = typename desk::FilterFor<Scalar, kStates>::Adaptive;
  require_idle(handle);
  const Adaptive& prototype = filter_for<Scalar, kStates>(handle).filter();
  const auto& sensor = model_of<RangeBearing<Scalar, kStates>>(handle_of_sensor);
  const auto state = to_matrix<kStates, 1>(x0, "x0");
  const auto covariance = to_matrix<kStates, kStates>(p0, "P0");
  const Track truth = scenario["track"].cast<Track>();
  const SensorNoise noise = scenario["noise"].cast<SensorNoise>();
  const auto seed = scenario["seed"].cast<std::uint64_t>();
  const auto first_run = scenario["first_run"].cast<std::uint64_t>();
  const auto runs = scenario["runs"].cast<py::ssize_t>();
  const auto steps = scenario["steps"].cast<py::ssize_t>();
  const auto duration_s = scenario["duration_s"].cast<double>();
  const auto random_start = scenario["random_start"].cast<bool>();
  TrackingProbe probe;
  probe.period_s = scenario["probe_period_s"].cast<double>();
  probe.budget_m = scenario["budget_m"].cast<double>();

  const std::vector<py::ssize_t> flat{runs, steps};
  const std::vector<py::ssize_t> planar{runs, steps, 2};
  py::array_t<double> time(flat), interval(flat), nis(flat), tau(flat), distance(flat);
  py::array_t<double> truth_xy(planar), measured(planar);
  py::array_t<double> x(std::vector<py::ssize_t>{runs, steps, kStates});
  py::array_t<double> position_covariance(std::vector<py::ssize_t>{runs, steps, 2, 2});
  py::array_t<double> probe_square(runs), probe_above(runs), probe_count(runs);
  py::array_t<std::int64_t> samples(runs);
  py::array_t<std::uint8_t> status(runs);
  for (auto* array :
       {&time, &interval, &nis, &tau, &distance, &truth_xy, &measured, &x, &position_covariance}) {
    std::fill_n(array->mutable_data(), array->size(), std::nan(""));
  }
  double* time_out = time.mutable_data();
  double* interval_out = interval.mutable_data();
  double* nis_out = nis.mutable_data();
  double* tau_out = tau.mutable_data();
  double* distance_out = distance.mutable_data();
  double* truth_out = truth_xy.mutable_data();
  double* z_out = measured.mutable_data();
  double* x_out = x.mutable_data();
  double* p_out = position_covariance.mutable_data();
  double* square_out = probe_square.mutable_data();
  double* above_out = probe_above.mutable_data();
  double* count_out = probe_count.mutable_data();
  std::int64_t* samples_out = samples.mutable_data();
  std::uint8_t* status_out = status.mutable_data();
  {
    py::gil_scoped_release release;
    for (py::ssize_t run = 0; run < runs; ++run) {
      Adaptive filter = prototype;
      math::Random random(seed, first_run + static_cast<std::uint64_t>(run));
      TrackingProbe seen = probe;
      py::ssize_t row = run * steps;
      typename Adaptive::Position start;
      start(0) = static_cast<Scalar>(truth.position[0]);
      start(1) = static_cast<Scalar>(truth.position[1]);
      Status result = filter.reset(
          random_start ? deviate<Adaptive>(state, covariance, random) : state, covariance, start);
      if (result == Status::kOk) {
        result = track(filter, sensor, truth, noise, random, static_cast<std::uint32_t>(steps),
                       duration_s, seen, [&](const TrackingStep<Adaptive, kSize>& step) {
                         time_out[row] = step.time_s;
                         interval_out[row] = static_cast<double>(step.filter.interval());
                         nis_out[row] = static_cast<double>(step.correction.nis);
                         const auto& law = step.filter.policy().mahalanobis.memory;
                         tau_out[row] = static_cast<double>(law.tau);
                         distance_out[row] = static_cast<double>(law.mahalanobis_squared);
                         const auto p = step.filter.P();
                         for (int i = 0; i < 2; ++i) {
                           truth_out[row * 2 + i] = step.truth.position[i];
                           z_out[row * 2 + i] = step.z[i];
                           for (int j = 0; j < 2; ++j) {
                             p_out[row * 4 + i * 2 + j] = static_cast<double>(p(i, j));
                           }
                         }
                         for (int i = 0; i < kStates; ++i) {
                           x_out[row * kStates + i] = static_cast<double>(step.filter.x()(i));
                         }
                         ++row;
                       });
      }
      samples_out[run] = row - run * steps;
      status_out[run] = static_cast<std::uint8_t>(result);
      square_out[run] = seen.square_sum;
      above_out[run] = seen.above;
      count_out[run] = seen.count;
    }
  }
  py::dict result;
  result["time_s"] = time;
  result["interval_s"] = interval;
  result["truth"] = truth_xy;
  result["z"] = measured;
  result["x"] = x;
  result["position_covariance"] = position_covariance;
  result["nis"] = nis;
  result["tau"] = tau;
  result["mahalanobis_squared"] = distance;
  result["samples"] = samples;
  result["status"] = status;
  result["probe_square_sum"] = probe_square;
  result["probe_above"] = probe_above;
  result["probe_count"] = probe_count;
  return result;
}

template <class Scalar>
void bind_simulation(py::module_& m) {
  m.def("simulate_tracking", &simulate<Scalar>, py::arg("filter"), py::arg("x0").noconvert(),
        py::arg("P0").noconvert(), py::arg("sensor"), py::arg("scenario"));
}

}  // namespace

void bind_tracking(py::module_& m) {
  bind_simulation<float>(m);
  bind_simulation<double>(m);
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
