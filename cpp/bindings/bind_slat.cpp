#include <pybind11/stl.h>

#include "slat_binder.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
void bind_sonar(py::module_& m) {
  using Device = Sonar<Scalar>;
  py::class_<Device>(m, named<Scalar>("Sonar").c_str(),
                     "Range and bearing between slave and master, Eqs. (5) and (6).")
      .def(py::init([](const py::dict& values, const std::string& bearing) {
             auto params = from_dict<typename Device::Params>(values);
             if (bearing == "master_to_slave") {
               params.bearing = Bearing::kMasterToSlave;
             } else if (bearing == "slave_to_master") {
               params.bearing = Bearing::kSlaveToMaster;
             } else if (bearing == "from_heading") {
               params.bearing = Bearing::kFromHeading;
             } else {
               throw py::value_error(
                   "bearing must be 'master_to_slave', 'slave_to_master' or 'from_heading'");
             }
             const Device sonar(params);
             require_ok(sonar.check(3));
             return sonar;
           }),
           py::arg("params"), py::arg("bearing"));
}

/// What a filter is told in a run of the scenario, and the truth at its pings; the world's random
/// numbers are those that `simulate` takes for that run.
py::dict record_slat(const SlatScenario& scenario, std::uint64_t seed, std::uint64_t run) {
  SlatScribe scribe;
  std::vector<double> time, truth, masters;
  math::Random world(seed, 2 * run);
  math::Random unused(seed, 2 * run + 1);
  require_ok(run_slat(scribe, Sonar<double>(), scenario, world, unused,
                      [&](const SlatStep<SlatScribe>& step) {
                        time.push_back(step.time_s);
                        for (int i = 0; i < 2; ++i) truth.push_back(step.slave.position[i]);
                        for (int n = 0; n < scenario.count; ++n) {
                          for (int i = 0; i < 2; ++i) {
                            masters.push_back(step.masters[n].position[i]);
                          }
                        }
                      }));
  const auto steps = static_cast<py::ssize_t>(scribe.steps.size());
  const auto echoes = static_cast<py::ssize_t>(scribe.heard.size());
  const py::ssize_t count = scenario.count;
  py::array_t<double> u(std::vector<py::ssize_t>{steps, 2});
  py::array_t<double> changes(std::vector<py::ssize_t>{steps, count, 2});
  py::array_t<double> priors(std::vector<py::ssize_t>{count, 6});
  py::array_t<double> z(std::vector<py::ssize_t>{echoes, 2});
  py::array_t<std::int64_t> step(echoes), master(echoes);
  for (py::ssize_t k = 0; k < steps; ++k) {
    const SlatScribe::Step& one = scribe.steps[static_cast<std::size_t>(k)];
    for (int i = 0; i < 2; ++i) {
      u.mutable_at(k, i) = one.reading(i);
      for (int n = 0; n < scenario.count; ++n) changes.mutable_at(k, n, i) = one.changes[n](i);
    }
  }
  for (int n = 0; n < scenario.count; ++n) {
    for (int i = 0; i < 6; ++i) {
      priors.mutable_at(n, i) = scribe.priors[static_cast<std::size_t>(n)].x(i);
    }
  }
  for (py::ssize_t k = 0; k < echoes; ++k) {
    const SlatScribe::Heard& one = scribe.heard[static_cast<std::size_t>(k)];
    step.mutable_at(k) = static_cast<std::int64_t>(one.step);
    master.mutable_at(k) = one.echo.master;
    for (int i = 0; i < 2; ++i) z.mutable_at(k, i) = one.echo.z(i);
  }
  py::dict result;
  result["u"] = u;
  result["changes"] = changes;
  result["priors"] = priors;
  result["step"] = step;
  result["master"] = master;
  result["z"] = z;
  result["time_s"] = py::array_t<double>(static_cast<py::ssize_t>(time.size()), time.data());
  result["truth"] =
      py::array_t<double>({static_cast<py::ssize_t>(time.size()), py::ssize_t(2)}, truth.data());
  result["masters"] = py::array_t<double>(
      {static_cast<py::ssize_t>(time.size()), count, py::ssize_t(2)}, masters.data());
  return result;
}

}  // namespace

template <class Scalar, int Pose>
SlatInterface<Scalar, Pose>::~SlatInterface() = default;
template struct SlatInterface<float, 2>;
template struct SlatInterface<float, 3>;
template struct SlatInterface<double, 2>;
template struct SlatInterface<double, 3>;

std::vector<std::string> instruction_sets(bool single_precision) {
  std::vector<std::string> sets{"scalar"};
#if AUVEST_VECTOR_LANES
  if (single_precision) {
    sets.push_back("sse2");
    if (__builtin_cpu_supports("avx2")) sets.push_back("avx2");
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("fma")) {
      sets.push_back("avx512");
    }
  }
#else
  static_cast<void>(single_precision);
#endif
  return sets;
}

AnyResampling resampling_named(const std::string& name) {
  AnyResampling policy;
  if (name == "systematic") {
    policy.kind = AnyResampling::Kind::kSystematic;
  } else if (name == "stratified") {
    policy.kind = AnyResampling::Kind::kStratified;
  } else if (name == "residual") {
    policy.kind = AnyResampling::Kind::kResidual;
  } else if (name == "multinomial") {
    policy.kind = AnyResampling::Kind::kMultinomial;
  } else {
    throw py::value_error(
        "resampling must be 'systematic', 'stratified', 'residual' or 'multinomial'");
  }
  return policy;
}

void bind_slat(py::module_& m) {
  bind_sonar<float>(m);
  bind_sonar<double>(m);
  m.def("slat_lanes", &instruction_sets, py::arg("single_precision"),
        "Instruction sets in whose lanes particles can run here, the widest last.");
  m.def("compass_motion_defaults", [] { return to_dict(CompassMotion<double>::Params()); });
  m.def("unicycle_motion_defaults", [] { return to_dict(UnicycleMotion<double>::Params()); });
  m.def("piecewise_acceleration_defaults",
        [] { return to_dict(PiecewiseAcceleration<double>::Params()); });
  m.def("imm_defaults", [] {
    const ThreeModels<double>::Params params;
    py::dict result;
    result["switch_rate_hz"] = params.switch_rate_hz;
    result["straight"] = to_dict(ConstantVelocity<double>::Params());
    result["turning"] = to_dict(CoordinatedTurn<double>::Params());
    return result;
  });
  m.attr("slat_max_imm_masters") = kImmMasters;
  m.def("sonar_defaults", [] { return to_dict(Sonar<double>::Params()); });
  m.def("slatf_defaults", [] { return to_dict(SlatfParams<double>()); });
  m.def("slatf_joint_defaults", [] { return to_dict(SlatfJointParams<double>()); });
  m.def("slatf_shared_defaults", [] { return to_dict(SlatfSharedParams<double>()); });
  m.def("ekf_slat_defaults", [] { return to_dict(EkfSlatParams<double>()); });
  m.attr("slat_max_masters") = static_cast<int>(AnySlat<float, 2>::kMasters);
  m.attr("slat_unknown_master") = kUnknownMaster;

  py::class_<SlatScenario>(m, "SlatScenario", "Section 7 of the SLATF paper.")
      .def(py::init([](const py::dict& params, const py::dict& slave,
                       const std::vector<py::dict>& masters) {
             SlatScenario scenario = from_dict<SlatScenario>(params);
             if (masters.empty() || masters.size() > SlatScenario::kMasters) {
               throw py::value_error("masters must be 1 to 4");
             }
             scenario.slave = from_dict<SlatVehicle>(slave);
             scenario.count = static_cast<int>(masters.size());
             for (std::size_t n = 0; n < masters.size(); ++n) {
               scenario.masters[n] = from_dict<SlatVehicle>(masters[n]);
             }
             return scenario;
           }),
           py::arg("params"), py::arg("slave"), py::arg("masters"));
  m.def("slat_scenario_defaults", [] {
    const SlatScenario scenario;
    py::list masters;
    for (const SlatVehicle& master : scenario.masters) masters.append(to_dict(master));
    py::dict result;
    result["params"] = to_dict(scenario);
    result["slave"] = to_dict(scenario.slave);
    result["masters"] = masters;
    return result;
  });

  m.def("slat_record", &record_slat, py::arg("scenario"), py::arg("seed"), py::arg("run"),
        "What a filter is told in a run of the scenario.");

  SlatBinder<CompassMotion<float>>::bind(m, "compass");
  SlatBinder<CompassMotion<double>>::bind(m, "compass");
  SlatBinder<UnicycleMotion<float>>::bind(m, "unicycle");
  SlatBinder<UnicycleMotion<double>>::bind(m, "unicycle");
}

}  // namespace bindings
}  // namespace auvest
