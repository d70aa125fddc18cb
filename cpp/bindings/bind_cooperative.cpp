#include "auvest/models/leader_range.hpp"
#include "handles.hpp"
#include "simulation/cooperative.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Kind>
Kind one_of(const py::dict& values, const char* name,
            std::initializer_list<std::pair<const char*, Kind>> kinds) {
  const auto given = values[name].cast<std::string>();
  for (const auto& kind : kinds) {
    if (given == kind.first) return kind.second;
  }
  throw py::value_error(std::string(name) + " is not one of its names");
}

CooperativeScenario to_scenario(const py::dict& values) {
  CooperativeScenario s;
  s.noise.kind = one_of<RangeNoise::Kind>(values, "kind",
                                          {{"contaminated", RangeNoise::Kind::kContaminated},
                                           {"multipath", RangeNoise::Kind::kMultipath},
                                           {"student", RangeNoise::Kind::kStudent}});
  s.noise.sigma_m = values["sigma_m"].cast<double>();
  s.noise.outlier_fraction = values["outlier_fraction"].cast<double>();
  s.noise.outlier_sigma_m = values["outlier_sigma_m"].cast<double>();
  s.noise.degrees_of_freedom = values["degrees_of_freedom"].cast<std::uint32_t>();
  s.timing = one_of<RangeTiming>(values, "timing",
                                 {{"at-once", RangeTiming::kAtOnce},
                                  {"own-time", RangeTiming::kOwnTime},
                                  {"as-if-fresh", RangeTiming::kAsIfFresh}});
  s.dt_s = values["dt_s"].cast<double>();
  s.range_every = values["range_every"].cast<std::uint32_t>();
  s.sigma_speed = values["sigma_speed"].cast<double>();
  s.sigma_heading = values["sigma_heading"].cast<double>();
  s.dropout = values["dropout"].cast<double>();
  s.late = values["late"].cast<double>();
  s.late_steps = values["late_steps"].cast<std::uint32_t>();
  return s;
}

/// The true positions of slave and leaders: (steps, 2) and (steps, 2, 2).
py::tuple fleet(double dt_s, py::ssize_t steps) {
  py::array_t<double> slave({steps, py::ssize_t(2)});
  py::array_t<double> leaders({steps, py::ssize_t(2), py::ssize_t(2)});
  CooperativeFleet truth;
  for (py::ssize_t k = 0; k < steps; ++k) {
    truth.advance(dt_s);
    for (int i = 0; i < 2; ++i) {
      double there[2];
      truth.leader(i, there);
      slave.mutable_at(k, i) = truth.position[i];
      for (int j = 0; j < 2; ++j) leaders.mutable_at(k, i, j) = there[j];
    }
  }
  return py::make_tuple(slave, leaders);
}

/// Monte Carlo: run r draws from the stream first_run + r of the seed, so the runs may be shared
/// out to any number of threads. Every run starts from the prototype's belief, moved by `offset`,
/// or from a draw of it. Rows after a run's end are NaN.
template <class Scalar>
py::dict cooperate_many(const FilterHandle<Scalar>& handle,
                        const SensorHandle<Scalar>& handle_of_sensor, const py::dict& values) {
  using Filter = typename desk::FilterFor<Scalar, 2>::Robust;
  require_idle(handle);
  const Filter& prototype = filter_for<Scalar, 2>(handle).filter();
  const auto& sensor = model_of<LeaderRange<Scalar, 2>>(handle_of_sensor);
  const CooperativeScenario scenario = to_scenario(values);
  const auto seed = values["seed"].cast<std::uint64_t>();
  const auto first_run = values["first_run"].cast<std::uint64_t>();
  const auto runs = values["runs"].cast<py::ssize_t>();
  const auto steps = values["steps"].cast<py::ssize_t>();
  const auto random_start = values["random_start"].cast<bool>();
  const double offset[2] = {values["offset_x_m"].cast<double>(),
                            values["offset_y_m"].cast<double>()};

  const std::vector<py::ssize_t> flat{runs, steps};
  py::array_t<double> error(std::vector<py::ssize_t>{runs, steps, 2});
  py::array_t<double> covariance(std::vector<py::ssize_t>{runs, steps, 2, 2});
  py::array_t<double> nis(flat), weight(flat);
  py::array_t<std::int64_t> samples(runs), recoveries(runs);
  py::array_t<std::int64_t> taken(runs), too_late(runs), lost(runs), overflowed(runs);
  py::array_t<std::uint8_t> status(runs);
  for (auto* array : {&error, &covariance, &nis, &weight}) {
    std::fill_n(array->mutable_data(), array->size(), std::nan(""));
  }
  double* error_out = error.mutable_data();
  double* covariance_out = covariance.mutable_data();
  double* nis_out = nis.mutable_data();
  double* weight_out = weight.mutable_data();
  std::int64_t* samples_out = samples.mutable_data();
  std::int64_t* recoveries_out = recoveries.mutable_data();
  std::int64_t* taken_out = taken.mutable_data();
  std::int64_t* too_late_out = too_late.mutable_data();
  std::int64_t* lost_out = lost.mutable_data();
  std::int64_t* overflowed_out = overflowed.mutable_data();
  std::uint8_t* status_out = status.mutable_data();
  {
    py::gil_scoped_release release;
    for (py::ssize_t run = 0; run < runs; ++run) {
      Filter filter = prototype;
      math::Random random(seed, first_run + static_cast<std::uint64_t>(run));
      typename Filter::State start = prototype.x();
      for (int i = 0; i < 2; ++i) start(i) = start(i) + static_cast<Scalar>(offset[i]);
      if (random_start) {
        Matrix<Scalar, 2, 2> root;
        Matrix<Scalar, 1, 2> none;
        math::factor_leading(prototype.P(), root, none);
        double first = 0;
        double second = 0;
        random.normal_pair(first, second);
        start(0) = start(0) + root(0, 0) * static_cast<Scalar>(first);
        start(1) = start(1) + root(1, 0) * static_cast<Scalar>(first) +
                   root(1, 1) * static_cast<Scalar>(second);
      }
      py::ssize_t row = run * steps;
      std::int64_t recovered = 0;
      MessageCounts sum;
      Status result = filter.reset(start, prototype.P());
      if (result == Status::kOk) {
        result = cooperate(filter, sensor, scenario, random, static_cast<std::uint32_t>(steps),
                           [&](const auto& step) {
                             const auto p = step.filter.P();
                             for (int i = 0; i < 2; ++i) {
                               error_out[row * 2 + i] =
                                   static_cast<double>(step.filter.x()(i)) - step.fleet.position[i];
                               for (int j = 0; j < 2; ++j) {
                                 covariance_out[row * 4 + i * 2 + j] = static_cast<double>(p(i, j));
                               }
                             }
                             if (step.correction != nullptr) {
                               nis_out[row] = static_cast<double>(step.correction->nis);
                               weight_out[row] = static_cast<double>(step.correction->weight(0));
                               recovered += step.correction->recovered ? 1 : 0;
                             }
                             sum.taken += step.messages.taken;
                             sum.too_late += step.messages.too_late;
                             sum.lost += step.messages.lost;
                             sum.overflowed += step.messages.overflowed;
                             ++row;
                           });
      }
      samples_out[run] = row - run * steps;
      recoveries_out[run] = recovered;
      taken_out[run] = sum.taken;
      too_late_out[run] = sum.too_late;
      lost_out[run] = sum.lost;
      overflowed_out[run] = sum.overflowed;
      status_out[run] = static_cast<std::uint8_t>(result);
    }
  }
  py::dict result;
  result["error"] = error;
  result["covariance"] = covariance;
  result["nis"] = nis;
  result["weight"] = weight;
  result["samples"] = samples;
  result["recoveries"] = recoveries;
  result["taken"] = taken;
  result["too_late"] = too_late;
  result["lost"] = lost;
  result["overflowed"] = overflowed;
  result["status"] = status;
  return result;
}

}  // namespace

void bind_cooperative(py::module_& m) {
  m.def("cooperate", &cooperate_many<float>, py::arg("slave"), py::arg("sensor"),
        py::arg("scenario"));
  m.def("cooperate", &cooperate_many<double>, py::arg("slave"), py::arg("sensor"),
        py::arg("scenario"));
  m.def("cooperative_fleet", &fleet, py::arg("dt_s"), py::arg("steps"));
  m.def("cooperative_defaults", [] {
    const CooperativeScenario s;
    py::dict result;
    result["sigma_m"] = s.noise.sigma_m;
    result["outlier_fraction"] = s.noise.outlier_fraction;
    result["outlier_sigma_m"] = s.noise.outlier_sigma_m;
    result["degrees_of_freedom"] = s.noise.degrees_of_freedom;
    result["dt_s"] = s.dt_s;
    result["range_every"] = s.range_every;
    result["sigma_speed"] = s.sigma_speed;
    result["sigma_heading"] = s.sigma_heading;
    result["late_steps"] = s.late_steps;
    result["messages_in_flight"] = kMessagesInFlight + 0;
    result["most_late_steps"] = CooperativeScenario::kMostLateSteps + 0;
    return result;
  });
}

}  // namespace bindings
}  // namespace auvest
