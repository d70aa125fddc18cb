// The Python class of a robust filter, the same for every filter, process and precision.
#pragma once

#include <limits>

#include "any_kernel.hpp"
#include "any_recovery.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "binders.hpp"
#include "params.hpp"

namespace auvest {
namespace bindings {

/// The sensors of the package for a filter of N states.
template <int N, class Scalar>
LeaderRange<Scalar, N> for_states(const PlanarLeaderRange<Scalar>& sensor) {
  return LeaderRange<Scalar, N>(sensor.params);
}

template <int N, class Scalar>
RangeBearing<Scalar, N> for_states(const PlanarRangeBearing<Scalar>& sensor) {
  typename RangeBearing<Scalar, N>::Params params;
  params.station_x_m = sensor.params.station_x_m;
  params.station_y_m = sensor.params.station_y_m;
  params.sigma_range_m = sensor.params.sigma_range_m;
  params.sigma_bearing_rad = sensor.params.sigma_bearing_rad;
  params.near_field = sensor.params.near_field;
  return RangeBearing<Scalar, N>(params);
}

/// Where the sensor, or what it ranges to, stands.
template <class Scalar, int N>
void place(LeaderRange<Scalar, N>& sensor, Scalar x, Scalar y) {
  sensor.params.leader_x_m = x;
  sensor.params.leader_y_m = y;
}

template <class Scalar, int N>
void place(RangeBearing<Scalar, N>& sensor, Scalar x, Scalar y) {
  sensor.params.station_x_m = x;
  sensor.params.station_y_m = y;
}

/// Size of a process's input, 0 if it has none.
template <class Process>
constexpr auto input_size(int) -> decltype(Process::Input::RowsAtCompileTime, 0) {
  return Process::Input::RowsAtCompileTime;
}
template <class Process>
constexpr int input_size(long) {
  return 0;
}

template <class Plain>
class RobustBinder {
 public:
  using Scalar = typename Plain::Scalar;
  using Process = typename Plain::Process;
  using Any = AnyKernel<Scalar>;
  using Rule = RobustUpdate<Any, AnyRecovery<Scalar>>;
  using Filter = Robust<Plain, Rule>;
  static constexpr int kStates = Filter::kStates;
  static constexpr int kInput = input_size<Process>(0);

  /// `make(process, params)` builds the plain filter; params is the dict of its own parameters.
  template <class Make>
  static void bind(py::module_& m, const std::string& stem, Make make) {
    py::class_<Filter> type(m, named<Scalar>(stem).c_str());
    type.def(py::init([make](const Process& process, const Any& kernel, const py::dict& rule,
                             const py::dict& params) {
               return Filter(make(process, params), to_rule(kernel, rule));
             }),
             py::arg("process"), py::arg("kernel"), py::arg("rule"), py::arg("params"))
        .def(
            "reset",
            [](Filter& filter, const Array<Scalar>& x0, const Array<Scalar>& p0) {
              require_ok(filter.reset(to_matrix<kStates, 1>(x0, "x0"),
                                      to_matrix<kStates, kStates>(p0, "P0")));
            },
            py::arg("x0").noconvert(), py::arg("P0").noconvert())
        .def(
            "predict",
            [](Filter& filter, Scalar dt, const Array<Scalar>& input) {
              require_shape(input, {kInput}, "motion");
              require_ok(predict(filter, dt, input.data(), HasInput<(kInput > 0)>()));
            },
            py::arg("dt"), py::arg("motion").noconvert())
        .def("save", &save)
        .def("restore", &restore, py::arg("state"))
        .def_property_readonly("x", [](const Filter& f) { return to_array(f.x()); })
        .def_property_readonly("P", [](const Filter& f) { return to_array(f.P()); });
    bind_sensor<PlanarLeaderRange<Scalar>>(type);
    bind_sensor<PlanarRangeBearing<Scalar>>(type);
  }

 private:
  template <bool>
  struct HasInput {};

  static Status predict(Filter& filter, Scalar dt, const Scalar*, HasInput<false>) {
    return filter.predict(dt);
  }
  static Status predict(Filter& filter, Scalar dt, const Scalar* values, HasInput<true>) {
    Vector<Scalar, kInput> input;
    for (int i = 0; i < kInput; ++i) input(i) = values[i];
    return filter.predict(dt, input);
  }

  static Rule to_rule(const Any& kernel, const py::dict& values) {
    AnyRecovery<Scalar> recovery;
    const auto rejections = values["rejections"].cast<std::uint8_t>();  // 0: no recovery
    recovery.enabled = rejections > 0;
    if (recovery.enabled) recovery.streak.params.rejections = rejections;
    typename Rule::Params params;
    params.residual = values["post_fit"].cast<bool>() ? Residual::kPostFit : Residual::kInnovation;
    params.max_iterations = values["max_iterations"].cast<std::uint8_t>();
    params.tolerance = values["tolerance"].cast<Scalar>();
    const Rule rule(kernel, recovery, params);
    require_ok(rule.check());
    return rule;
  }

  template <class Sensor>
  static void bind_sensor(py::class_<Filter>& type) {
    type.def("update", &update<Sensor>, py::arg("z").noconvert(), py::arg("sensor"))
        .def("run", &run<Sensor>, py::arg("z").noconvert(), py::arg("dt").noconvert(),
             py::arg("motion").noconvert(), py::arg("position").noconvert(), py::arg("sensor"),
             py::arg("covariance"));
  }

  /// As a matrix, whatever its size: to_array makes a vector of one number.
  template <int Size>
  static py::array to_square(const Matrix<Scalar, Size, Size>& s) {
    return to_array(s).reshape({Size, Size});
  }

  template <class Sensor>
  static py::tuple update(Filter& filter, const Array<Scalar>& z, const Sensor& sensor) {
    const auto u = filter.update(to_matrix<Sensor::kSize, 1>(z, "z"), for_states<kStates>(sensor));
    require_ok(u.status);
    return py::make_tuple(to_array(u.innovation), to_square(u.S), u.nis, u.near_field,
                          to_array(u.standardised), to_array(u.weight), u.decision, u.iterations,
                          u.recovered);
  }

  /// A record of T rows: dt[k] is the time before row k and input[k] what drove the process in it;
  /// a NaN row of z is a missing measurement, a NaN row of position leaves the sensor where it is.
  /// Without `covariance` P and S have no rows.
  template <class Sensor>
  static py::dict run(Filter& filter, const Array<Scalar>& z, const Array<Scalar>& dt,
                      const Array<Scalar>& input, const Array<Scalar>& position,
                      const Sensor& sensor, bool covariance) {
    constexpr int kSize = Sensor::kSize;
    using Update = RobustCorrection<Scalar, kSize>;
    require_shape(z, {-1, kSize}, "z");
    const py::ssize_t rows = z.shape(0);
    require_shape(dt, {rows}, "dt");
    require_shape(input, {rows, kInput}, "motion");
    require_shape(position, {rows, 2}, "position");

    py::array_t<Scalar> x({rows, py::ssize_t(kStates)});
    const py::ssize_t full = covariance ? rows : 0;
    py::array_t<Scalar> p({full, py::ssize_t(kStates), py::ssize_t(kStates)});
    py::array_t<Scalar> s({full, py::ssize_t(kSize), py::ssize_t(kSize)});
    const std::vector<py::ssize_t> measured{rows, kSize};
    py::array_t<Scalar> innovation(measured), standardised(measured), weight(measured);
    py::array_t<Scalar> nis(rows);
    py::array_t<std::uint8_t> decision(rows), iterations(rows);
    py::array_t<bool> near_field(rows), recovered(rows);
    Scalar* x_out = x.mutable_data();
    Scalar* p_out = p.mutable_data();
    Scalar* s_out = s.mutable_data();
    Scalar* innovation_out = innovation.mutable_data();
    Scalar* standardised_out = standardised.mutable_data();
    Scalar* weight_out = weight.mutable_data();
    Scalar* nis_out = nis.mutable_data();
    std::uint8_t* decision_out = decision.mutable_data();
    std::uint8_t* iterations_out = iterations.mutable_data();
    bool* near_out = near_field.mutable_data();
    bool* recovered_out = recovered.mutable_data();
    const Scalar* z_in = z.data();
    const Scalar* dt_in = dt.data();
    const Scalar* input_in = input.data();
    const Scalar* position_in = position.data();

    py::ssize_t done = 0;
    Status status = Status::kOk;
    Matrix<Scalar, kSize, kSize> last_s;
    {
      py::gil_scoped_release release;
      const auto own = for_states<kStates>(sensor);
      const Update nothing = missing<kSize>();
      last_s = nothing.S;
      for (; done < rows; ++done) {
        const typename Filter::BeliefType before = filter.belief();
        status = predict(filter, dt_in[done], input_in + done * kInput, HasInput<(kInput > 0)>());
        Update u = nothing;
        Vector<Scalar, kSize> value;
        bool given = false;
        for (int i = 0; i < kSize; ++i) {
          value(i) = z_in[done * kSize + i];
          given = given || !math::is_nan(value(i));
        }
        if (status == Status::kOk && given) {
          auto placed = own;
          const Scalar* at = position_in + done * 2;
          if (!math::is_nan(at[0])) place(placed, at[0], at[1]);
          u = filter.update(value, placed);
          status = u.status;
        }
        if (status != Status::kOk) {
          filter.restore(before);
          break;
        }
        copy_to(filter.x(), x_out + done * kStates);
        last_s = u.S;
        if (covariance) {
          copy_to(filter.P(), p_out + done * kStates * kStates);
          copy_to(u.S, s_out + done * kSize * kSize);
        }
        copy_to(u.innovation, innovation_out + done * kSize);
        copy_to(u.standardised, standardised_out + done * kSize);
        copy_to(u.weight, weight_out + done * kSize);
        nis_out[done] = u.nis;
        decision_out[done] = static_cast<std::uint8_t>(u.decision);
        iterations_out[done] = u.iterations;
        near_out[done] = u.near_field;
        recovered_out[done] = u.recovered;
      }
    }
    py::dict result;
    result["done"] = done;
    result["status"] = status;
    result["x"] = x;
    result["P"] = p;
    result["innovation"] = innovation;
    result["S"] = s;
    result["last_S"] = to_square(last_s);
    result["nis"] = nis;
    result["near_field"] = near_field;
    result["standardised"] = standardised;
    result["weight"] = weight;
    result["decision"] = decision;
    result["iterations"] = iterations;
    result["recovered"] = recovered;
    return result;
  }

  /// What a missing measurement records.
  template <int Size>
  static RobustCorrection<Scalar, Size> missing() {
    const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
    RobustCorrection<Scalar, Size> nothing(Status::kOk);
    nothing.innovation.setConstant(nan);
    nothing.S.setConstant(nan);
    nothing.standardised.setConstant(nan);
    nothing.weight.setConstant(nan);
    nothing.nis = nan;
    return nothing;
  }

  static py::dict save(const Filter& filter) {
    const auto& streak = filter.rule().recovery.streak;
    py::dict state;
    state["x"] = to_array(filter.x());
    state["P"] = to_array(filter.P());
    state["recovery"] = py::make_tuple(streak.count, streak.variance, to_array(streak.recent));
    return state;
  }

  static void restore(Filter& filter, const py::dict& state) {
    typename Filter::BeliefType belief;
    belief.x = to_matrix<kStates, 1>(state["x"].cast<Array<Scalar>>(), "x");
    belief.P = to_matrix<kStates, kStates>(state["P"].cast<Array<Scalar>>(), "P");
    Rule rule = filter.rule();
    const auto recovery = state["recovery"].cast<py::tuple>();
    rule.recovery.streak.count = recovery[0].cast<std::uint8_t>();
    rule.recovery.streak.variance = recovery[1].cast<Scalar>();
    rule.recovery.streak.recent = to_matrix<2, 3>(recovery[2].cast<Array<Scalar>>(), "recovery");
    require_ok(filter.restore(belief, rule));
  }
};

/// Binds a filter for every process in both precisions: e.g. RobustEkf_SpeedHeading_float32.
template <template <class> class Plain, class Make>
void bind_robust(py::module_& m, const std::string& name, Make make) {
  const auto bind = [&](auto scalar) {
    using Scalar = decltype(scalar);
    RobustBinder<Plain<SpeedHeading<Scalar>>>::bind(m, name + "_SpeedHeading", make);
    RobustBinder<Plain<SpeedHeading<Scalar, true>>>::bind(m, name + "_SpeedHeadingBias", make);
    RobustBinder<Plain<SpeedHeading<Scalar, false, true>>>::bind(m, name + "_SpeedHeadingScale",
                                                                 make);
    RobustBinder<Plain<SpeedHeading<Scalar, true, true>>>::bind(m, name + "_SpeedHeadingBiasScale",
                                                                make);
    RobustBinder<Plain<Odometry<Scalar>>>::bind(m, name + "_Odometry", make);
    RobustBinder<Plain<EulerAcceleration<Scalar>>>::bind(m, name + "_EulerAcceleration", make);
    RobustBinder<Plain<ExactAcceleration<Scalar>>>::bind(m, name + "_ExactAcceleration", make);
  };
  bind(float());
  bind(double());
}

}  // namespace bindings
}  // namespace auvest
