#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "auvest/models/range_bearing.hpp"
#include "desk/side_by_side.hpp"
#include "handles.hpp"
#include "run_lanes.hpp"
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

/// Where the samples of all runs go, row by row, and how each run ended.
struct TrackingColumns {
  double *time_s, *interval_s, *truth, *z, *x, *covariance, *nis, *tau, *distance;
  double *square_sum, *above, *count;
  std::int64_t* samples;
  std::uint8_t* status;

  template <class Scalar>
  void put(py::ssize_t row, const TrackingWorld& world, Scalar nis_now, Scalar interval,
           const AnyInterval<Scalar>& policy, const Vector<Scalar, 6>& estimate,
           const Matrix<Scalar, 6, 6>& P) const {
    const auto& law = policy.mahalanobis.memory;
    time_s[row] = world.time_s;
    interval_s[row] = static_cast<double>(interval);
    nis[row] = static_cast<double>(nis_now);
    tau[row] = static_cast<double>(law.tau);
    distance[row] = static_cast<double>(law.mahalanobis_squared);
    for (int i = 0; i < 2; ++i) {
      truth[row * 2 + i] = world.truth.position[i];
      z[row * 2 + i] = world.z[i];
      for (int j = 0; j < 2; ++j) {
        covariance[row * 4 + i * 2 + j] = static_cast<double>(P(i, j));
      }
    }
    for (int i = 0; i < 6; ++i) x[row * 6 + i] = static_cast<double>(estimate(i));
  }
};

/// Monte Carlo over the closed loop: run r draws from the stream first_run + r of the seed, so the
/// runs may be shared out to any number of threads. Side by side where the filter's models run in
/// lanes and no error is wanted between samples, one by one where not: the same bits.
template <class Scalar>
class TrackingRuns {
 public:
  using Filter = desk::FilterFor<Scalar, 6>;
  using Adaptive = typename Filter::Adaptive;
  using Sensor = RangeBearing<Scalar, 6>;
  using Beside = desk::SideBySide<Scalar, 6>;

  TrackingRuns(const FilterHandle<Scalar>& handle, const Array<Scalar>& x0, const Array<Scalar>& p0,
               const SensorHandle<Scalar>& sensor, const py::dict& scenario,
               const std::string& lanes)
      : start_(filter_for<Scalar, 6>(handle)),
        sensor_(model_of<Sensor>(sensor)),
        x0_(to_matrix<6, 1>(x0, "x0")),
        p0_(to_matrix<6, 6>(p0, "P0")),
        truth_(scenario["track"].cast<Track>()),
        noise_(scenario["noise"].cast<SensorNoise>()),
        seed_(scenario["seed"].cast<std::uint64_t>()),
        first_(scenario["first_run"].cast<std::uint64_t>()),
        steps_(scenario["steps"].cast<py::ssize_t>()),
        duration_s_(scenario["duration_s"].cast<double>()),
        random_start_(scenario["random_start"].cast<bool>()),
        width_(steps_of(lanes, room_)) {
    probe_.period_s = scenario["probe_period_s"].cast<double>();
    probe_.budget_m = scenario["budget_m"].cast<double>();
  }

  void run(py::ssize_t runs, const TrackingColumns& out) const {
    Sensor lifted = sensor_;
    lifted.params.lift_smallest();  // as track() does
    const typename Beside::Sensors sensors{std::make_shared<desk::SensorOf<Sensor>>(lifted)};
    const auto started = start_.clone();  // what is not done in lanes is done by copies of it
    const Status begun = started->reset(x0_.data(), p0_.data(), desired_at_start().data());
    Beside beside(static_cast<const Filter&>(*started), sensors, width_);
    const bool possible =
        begun == Status::kOk && beside.possible() && runs > 1 && !(probe_.period_s > 0);
    for (py::ssize_t run = 0; run < runs; run += possible ? desk::kLanes : 1) {
      if (possible) {
        const auto left = std::min<py::ssize_t>(runs - run, desk::kLanes);
        side_by_side(beside, run, static_cast<int>(left), out);
      } else {
        alone(run, out);
      }
    }
  }

 private:
  typename Adaptive::Position desired_at_start() const {
    return {static_cast<Scalar>(truth_.position[0]), static_cast<Scalar>(truth_.position[1])};
  }

  /// The world of a run, and its filter at the start.
  TrackingWorld begin(py::ssize_t run, Adaptive& filter, Status& status) const {
    math::Random random(seed_, first_ + static_cast<std::uint64_t>(run));
    status = filter.reset(random_start_ ? deviate<Adaptive>(x0_, p0_, random) : x0_, p0_,
                          desired_at_start());
    return {truth_, noise_, random, static_cast<double>(sensor_.params.station_x_m),
            static_cast<double>(sensor_.params.station_y_m)};
  }

  void alone(py::ssize_t run, const TrackingColumns& out) const {
    Adaptive filter = start_.filter();
    TrackingProbe seen = probe_;
    Status status = Status::kOk;
    TrackingWorld world = begin(run, filter, status);
    py::ssize_t row = run * steps_;
    if (status == Status::kOk) {
      status = track(filter, sensor_, world, static_cast<std::uint32_t>(steps_), duration_s_, seen,
                     [&](const TrackingStep<Adaptive, 2>& step) {
                       out.put(row, world, step.correction.nis, filter.interval(), filter.policy(),
                               filter.x(), filter.P());
                       ++row;
                     });
    }
    out.samples[run] = row - run * steps_;
    out.status[run] = static_cast<std::uint8_t>(status);
    out.square_sum[run] = seen.square_sum;
    out.above[run] = seen.above;
    out.count[run] = seen.count;
  }

  /// As alone(), for `count` runs from `first` on.
  void side_by_side(Beside& beside, py::ssize_t first, int count,
                    const TrackingColumns& out) const {
    std::vector<TrackingWorld> worlds;
    Status status[desk::kLanes];
    bool on[desk::kLanes];
    beside.begin(count);
    for (int lane = 0; lane < count; ++lane) {
      Adaptive filter = start_.filter();
      worlds.push_back(begin(first + lane, filter, status[lane]));
      beside.start(lane, filter);
      on[lane] = status[lane] == Status::kOk;
      out.samples[first + lane] = 0;
    }
    bool any = true;
    for (py::ssize_t k = 0; k < steps_ && any; ++k) {
      for (int lane = 0; lane < count; ++lane) {
        on[lane] = on[lane] && sample(beside, lane, worlds[static_cast<std::size_t>(lane)]);
        if (!on[lane]) beside.leave(lane);
      }
      beside.step(0);
      any = false;
      for (int lane = 0; lane < count; ++lane) {
        if (!on[lane]) continue;
        const TrackingWorld& world = worlds[static_cast<std::size_t>(lane)];
        status[lane] = finish(beside, lane, world);
        on[lane] = status[lane] == Status::kOk;
        any = any || on[lane];
        if (!on[lane]) continue;
        const auto belief = beside.belief(lane);
        const Scalar nis = beside.measured(lane) ? beside.rows().nis[lane] : Scalar(std::nan(""));
        out.put((first + lane) * steps_ + k, world, nis, beside.interval(lane), beside.policy(lane),
                belief.x, belief.P);
        out.samples[first + lane] = k + 1;
      }
    }
    for (int lane = 0; lane < count; ++lane) {
      out.status[first + lane] = static_cast<std::uint8_t>(status[lane]);
      out.square_sum[first + lane] = out.above[first + lane] = out.count[first + lane] = 0;
    }
  }

  /// Asks for the next sample of a run; whether there is one.
  bool sample(Beside& beside, int lane, TrackingWorld& world) const {
    const Scalar interval = beside.interval(lane);
    if (world.time_s + static_cast<double>(interval) > duration_s_) return false;
    const bool measured = world.sample(static_cast<double>(interval));
    const Scalar z[2] = {static_cast<Scalar>(world.z[0]), static_cast<Scalar>(world.z[1])};
    beside.dt(lane, interval);
    beside.z(lane, measured ? z : nullptr, 2);
    return true;
  }

  /// What a filter says of the sample, and of the position desired then.
  Status finish(Beside& beside, int lane, const TrackingWorld& world) const {
    if (beside.status(lane) != Status::kOk) return beside.status(lane);
    double desired[2];
    world.truth.desired(world.time_s, desired);
    const Scalar reference[2] = {static_cast<Scalar>(desired[0]), static_cast<Scalar>(desired[1])};
    return beside.feedback(lane, reference);
  }

  const Filter& start_;
  Sensor sensor_;
  typename Adaptive::State x0_;
  typename Adaptive::Covariance p0_;
  Track truth_;
  SensorNoise noise_;
  std::uint64_t seed_, first_;
  py::ssize_t steps_;
  double duration_s_;
  bool random_start_;
  TrackingProbe probe_;
  desk::LaneSteps<Scalar> room_;
  const desk::LaneSteps<Scalar>* width_;
};

/// Rows after a run's end are NaN.
template <class Scalar>
py::dict simulate(const FilterHandle<Scalar>& handle, const Array<Scalar>& x0,
                  const Array<Scalar>& p0, const SensorHandle<Scalar>& sensor,
                  const py::dict& scenario, const std::string& lanes) {
  require_idle(handle);
  const TrackingRuns<Scalar> tracking(handle, x0, p0, sensor, scenario, lanes);
  const auto runs = scenario["runs"].cast<py::ssize_t>();
  const auto steps = scenario["steps"].cast<py::ssize_t>();
  py::dict result;
  const auto column = [&](const char* name, const std::vector<py::ssize_t>& shape) {
    py::array_t<double> array(shape);
    std::fill_n(array.mutable_data(), array.size(), std::nan(""));
    result[name] = array;
    return array.mutable_data();
  };
  TrackingColumns out;
  out.time_s = column("time_s", {runs, steps});
  out.interval_s = column("interval_s", {runs, steps});
  out.truth = column("truth", {runs, steps, 2});
  out.z = column("z", {runs, steps, 2});
  out.x = column("x", {runs, steps, 6});
  out.covariance = column("position_covariance", {runs, steps, 2, 2});
  out.nis = column("nis", {runs, steps});
  out.tau = column("tau", {runs, steps});
  out.distance = column("mahalanobis_squared", {runs, steps});
  out.square_sum = column("probe_square_sum", {runs});
  out.above = column("probe_above", {runs});
  out.count = column("probe_count", {runs});
  py::array_t<std::int64_t> samples(runs);
  py::array_t<std::uint8_t> status(runs);
  result["samples"] = samples;
  result["status"] = status;
  out.samples = samples.mutable_data();
  out.status = status.mutable_data();
  {
    py::gil_scoped_release release;
    tracking.run(runs, out);
  }
  return result;
}

template <class Scalar>
void bind_simulation(py::module_& m) {
  m.def("simulate_tracking", &simulate<Scalar>, py::arg("filter"), py::arg("x0").noconvert(),
        py::arg("P0").noconvert(), py::arg("sensor"), py::arg("scenario"), py::arg("lanes"));
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
