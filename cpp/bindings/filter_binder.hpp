// The Python class of a filter, the same for every filter, process and precision.
#pragma once

#include <cmath>
#include <vector>

#include "any_interval.hpp"
#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/scenarios/tracking.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {

template <class Filter>
class FilterBinder {
 public:
  using Scalar = typename Filter::Scalar;
  using Process = typename Filter::Process;
  using Policy = AnyInterval<Scalar>;
  using Adaptive = AdaptiveInterval<Filter, Policy>;
  using Sensor = PlanarRangeBearing<Scalar>;
  static constexpr int kStates = Filter::kStates;
  static constexpr int kSize = Sensor::kSize;
  using Update = Correction<Scalar, kSize>;

  /// `make(process, params)` builds the filter; params is the dict of its own parameters.
  template <class Make>
  static void bind(py::module_& m, const std::string& stem, Make make) {
    py::class_<Adaptive>(m, named<Scalar>(stem).c_str())
        .def(py::init([make](const Process& process, const Policy& policy, const py::dict& params) {
               return Adaptive(make(process, params), policy);
             }),
             py::arg("process"), py::arg("policy"), py::arg("params"))
        .def("reset", &reset, py::arg("x0").noconvert(), py::arg("P0").noconvert(),
             py::arg("reference").noconvert())
        .def(
            "predict", [](Adaptive& filter, Scalar dt) { require_ok(filter.predict(dt)); },
            py::arg("dt"))
        .def("update", &update, py::arg("z").noconvert(), py::arg("sensor"))
        .def(
            "feedback",
            [](Adaptive& filter, const Array<Scalar>& reference) {
              require_ok(filter.feedback(to_matrix<2, 1>(reference, "reference")));
            },
            py::arg("reference").noconvert())
        .def("run", &run, py::arg("z").noconvert(), py::arg("dt").noconvert(),
             py::arg("reference").noconvert(), py::arg("sensor"), py::arg("covariance"))
        .def("simulate", &simulate, py::arg("x0").noconvert(), py::arg("P0").noconvert(),
             py::arg("sensor"), py::arg("scenario"))
        .def("save", &save)
        .def("restore", &restore, py::arg("state"))
        .def_property_readonly("x", [](const Adaptive& f) { return to_array(f.x()); })
        .def_property_readonly("P", [](const Adaptive& f) { return to_array(f.P()); })
        .def_property_readonly("interval", [](const Adaptive& f) { return f.interval(); })
        .def_property_readonly("law", [](const Adaptive& f) { return memory(f.policy()); });
  }

 private:
  static void reset(Adaptive& filter, const Array<Scalar>& x0, const Array<Scalar>& p0,
                    const Array<Scalar>& reference) {
    require_ok(filter.reset(to_matrix<kStates, 1>(x0, "x0"), to_matrix<kStates, kStates>(p0, "P0"),
                            to_matrix<2, 1>(reference, "reference")));
  }

  static py::tuple update(Adaptive& filter, const Array<Scalar>& z, const Sensor& sensor) {
    const Update u = filter.update(to_matrix<kSize, 1>(z, "z"), sensor);
    require_ok(u.status);
    return py::make_tuple(to_array(u.innovation), to_array(u.S), u.nis, u.near_field);
  }

  /// A record of T rows. dt[k] is the time before row k, NaN for the interval the filter chose;
  /// a NaN row of z is a missing measurement; a NaN row of reference stands for the estimate.
  /// Without `covariance` P and S have no rows.
  static py::dict run(Adaptive& filter, const Array<Scalar>& z, const Array<Scalar>& dt,
                      const Array<Scalar>& reference, const Sensor& sensor, bool covariance) {
    require_shape(z, {-1, kSize}, "z");
    const py::ssize_t rows = z.shape(0);
    require_shape(dt, {rows}, "dt");
    require_shape(reference, {rows, 2}, "reference");

    py::array_t<Scalar> x({rows, py::ssize_t(kStates)});
    const py::ssize_t full = covariance ? rows : 0;
    py::array_t<Scalar> p({full, py::ssize_t(kStates), py::ssize_t(kStates)});
    py::array_t<Scalar> innovation({rows, py::ssize_t(kSize)});
    py::array_t<Scalar> s({full, py::ssize_t(kSize), py::ssize_t(kSize)});
    py::array_t<Scalar> nis(rows);
    py::array_t<Scalar> interval(rows);
    py::array_t<bool> near_field(rows);
    Scalar* x_out = x.mutable_data();
    Scalar* p_out = p.mutable_data();
    Scalar* innovation_out = innovation.mutable_data();
    Scalar* s_out = s.mutable_data();
    Scalar* nis_out = nis.mutable_data();
    Scalar* interval_out = interval.mutable_data();
    bool* near_out = near_field.mutable_data();
    const Scalar* z_in = z.data();
    const Scalar* dt_in = dt.data();
    const Scalar* reference_in = reference.data();

    py::ssize_t done = 0;
    Status status = Status::kOk;
    Update nothing(Status::kOk);  // what a missing measurement records
    Matrix<Scalar, kSize, kSize> last_s;
    {
      py::gil_scoped_release release;
      const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
      for (int i = 0; i < kSize; ++i) {
        nothing.innovation(i) = nan;
        for (int j = 0; j < kSize; ++j) nothing.S(i, j) = nan;
      }
      nothing.nis = nan;
      last_s = nothing.S;
      for (; done < rows; ++done) {
        const typename Adaptive::BeliefType before = filter.belief();
        const Scalar elapsed = math::is_nan(dt_in[done]) ? filter.interval() : dt_in[done];
        status = filter.predict(elapsed);
        Update u = nothing;
        const Scalar* measured = z_in + done * kSize;
        if (status == Status::kOk && !(math::is_nan(measured[0]) && math::is_nan(measured[1]))) {
          typename Sensor::Measurement m;
          m(0) = measured[0];
          m(1) = measured[1];
          u = filter.update(m, sensor);
          status = u.status;
        }
        if (status == Status::kOk) {
          typename Adaptive::Position desired;
          for (int i = 0; i < 2; ++i) {
            const Scalar given = reference_in[done * 2 + i];
            desired(i) = math::is_nan(given) ? filter.x()(i) : given;
          }
          status = filter.feedback(desired);
        }
        if (status != Status::kOk) {
          filter.Filter::restore(before);
          break;
        }
        copy_to(filter.x(), x_out + done * kStates);
        copy_to(u.innovation, innovation_out + done * kSize);
        last_s = u.S;
        if (covariance) {
          copy_to(filter.P(), p_out + done * kStates * kStates);
          copy_to(u.S, s_out + done * kSize * kSize);
        }
        nis_out[done] = u.nis;
        interval_out[done] = filter.interval();
        near_out[done] = u.near_field;
      }
    }
    py::dict result;
    result["done"] = done;
    result["status"] = status;
    result["x"] = x;
    result["P"] = p;
    result["innovation"] = innovation;
    result["S"] = s;
    result["last_S"] = to_array(last_s);
    result["nis"] = nis;
    result["interval"] = interval;
    result["near_field"] = near_field;
    return result;
  }

  /// Monte Carlo over the closed loop: run r draws from the stream first_run + r of the seed, so
  /// the runs may be shared out to any number of threads. Rows after a run's end are NaN.
  static py::dict simulate(const Adaptive& prototype, const Array<Scalar>& x0,
                           const Array<Scalar>& p0, const Sensor& sensor,
                           const py::dict& scenario) {
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
    for (auto* array : {&time, &interval, &nis, &tau, &distance, &truth_xy, &measured, &x,
                        &position_covariance}) {
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
        Status result = filter.reset(random_start ? deviate(state, covariance, random) : state,
                                     covariance, start);
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

  /// A draw from N(x, P): six normal deviates, in pairs.
  static typename Adaptive::State deviate(typename Adaptive::State x,
                                          const typename Adaptive::Covariance& p,
                                          math::Random& random) {
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

  static py::dict memory(const Policy& policy) {
    py::dict result;
    if (policy.kind != Policy::Kind::kMahalanobis) return result;
    const auto& m = policy.mahalanobis.memory;
    result["tau"] = m.tau;
    result["ratio"] = m.ratio;
    result["mahalanobis_squared"] = m.mahalanobis_squared;
    return result;
  }

  static py::dict save(const Adaptive& filter) {
    const auto& m = filter.policy().mahalanobis.memory;
    py::dict state;
    state["x"] = to_array(filter.x());
    state["P"] = to_array(filter.P());
    state["interval"] = filter.interval();
    state["law"] = py::make_tuple(m.tau, m.interval, m.ratio, m.mahalanobis_squared,
                                  to_array(m.last_estimate), to_array(m.last_reference));
    return state;
  }

  static void restore(Adaptive& filter, const py::dict& state) {
    typename Adaptive::BeliefType belief;
    belief.x = to_matrix<kStates, 1>(state["x"].cast<Array<Scalar>>(), "x");
    belief.P = to_matrix<kStates, kStates>(state["P"].cast<Array<Scalar>>(), "P");
    Policy policy = filter.policy();
    const auto law = state["law"].cast<py::tuple>();
    auto& m = policy.mahalanobis.memory;
    m.tau = law[0].cast<Scalar>();
    m.interval = law[1].cast<Scalar>();
    m.ratio = law[2].cast<Scalar>();
    m.mahalanobis_squared = law[3].cast<Scalar>();
    m.last_estimate = to_matrix<2, 1>(law[4].cast<Array<Scalar>>(), "last_estimate");
    m.last_reference = to_matrix<2, 1>(law[5].cast<Array<Scalar>>(), "last_reference");
    require_ok(filter.restore(belief, policy, state["interval"].cast<Scalar>()));
  }
};

/// Binds a filter for both discretisations and both precisions: e.g. Ukf_exact_float32.
template <template <class> class Filter, class Make>
void bind_filter(py::module_& m, const std::string& name, Make make) {
  FilterBinder<Filter<EulerAcceleration<float>>>::bind(m, name + "_euler", make);
  FilterBinder<Filter<EulerAcceleration<double>>>::bind(m, name + "_euler", make);
  FilterBinder<Filter<ExactAcceleration<float>>>::bind(m, name + "_exact", make);
  FilterBinder<Filter<ExactAcceleration<double>>>::bind(m, name + "_exact", make);
}

}  // namespace bindings
}  // namespace auvest
