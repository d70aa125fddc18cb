// The filters of the family, in both precisions, and what they are made of.
//
// Single steps are fast: arguments in their usual forms are read here, and whatever is not in such
// a form is answered with kUnclear, upon which the Python layer looks closer, converts or explains.
#include <dlfcn.h>

#include <cmath>

#include "desk/function_models.hpp"
#include "handles.hpp"
#include "plain.hpp"

namespace auvest {
namespace bindings {
namespace {

using desk::kMaxInputs;
using desk::kMaxPlace;
using desk::kMaxSize;

/// Answers of single steps; from 0 on they are a Status.
const int kUnclear = -1;

/// Exactly `size` plain numbers, or one that stands for itself; NaN may be among them.
template <class Scalar, int Most>
bool take_row(py::handle given, Scalar (&row)[Most], int size) {
  double numbers[Most];
  const bool single = size == 1 && plain::take_any(given, numbers[0]);
  if (!single && !plain::take_any(given, size, numbers)) return false;
  for (int i = 0; i < size; ++i) {
    row[i] = std::numeric_limits<Scalar>::quiet_NaN();
    if (!std::isnan(numbers[i]) && !plain::narrow(numbers[i], row[i])) return false;
  }
  return true;
}

template <class Scalar>
int predict(FilterHandle<Scalar>& handle, const py::object& dt, const py::object& input) {
  const Occupied<Scalar> occupied(handle);
  Scalar step = std::numeric_limits<Scalar>::quiet_NaN();  // the filter's own interval
  if (!dt.is_none() && (!plain::take(dt, step) || !(step >= Scalar(0)))) return kUnclear;
  Scalar values[kMaxInputs];
  const int inputs = handle.filter->inputs();
  if (input.is_none() != (inputs == 0)) return kUnclear;
  if (inputs > 0) {
    if (!take_row(input, values, inputs)) return kUnclear;
    for (int i = 0; i < inputs; ++i) {
      if (std::isnan(values[i])) return kUnclear;
    }
  }
  handle.status = handle.filter->predict(step, values);
  return static_cast<int>(handle.status);
}

template <class Scalar>
int update(FilterHandle<Scalar>& handle, const py::object& z, const SensorHandle<Scalar>& sensor,
           const py::object& place, const py::object& age) {
  const Occupied<Scalar> occupied(handle);
  if (sensor->states != handle.filter->states()) return kUnclear;
  Scalar values[kMaxSize];
  Scalar there[kMaxPlace];
  Scalar elapsed = Scalar(0);
  bool missing = z.is_none();
  if (!missing) {
    if (!take_row(z, values, sensor->size)) return kUnclear;
    int gone = 0;
    for (int i = 0; i < sensor->size; ++i) gone += std::isnan(values[i]) ? 1 : 0;
    if (gone > 0 && gone < sensor->size) return kUnclear;
    missing = gone > 0;
  }
  if (!place.is_none()) {
    if (sensor->place == 0 || !take_row(place, there, sensor->place)) return kUnclear;
    for (int i = 0; i < sensor->place; ++i) {
      if (std::isnan(there[i])) return kUnclear;
    }
  }
  if (!age.is_none() && (!plain::take(age, elapsed) || !(elapsed >= Scalar(0)))) {
    return kUnclear;
  }
  if (place.is_none() && !sensor->stands && !missing) return kUnclear;
  if (missing) {
    handle.report = desk::Report<Scalar>();
    handle.status = Status::kOk;
    return 0;
  }
  const auto report =
      handle.filter->update(values, sensor, place.is_none() ? nullptr : there, elapsed);
  handle.status = report.status;
  if (report.status == Status::kOk) handle.report = report;
  return static_cast<int>(report.status);
}

template <class Scalar>
int feedback(FilterHandle<Scalar>& handle, const py::object& reference) {
  const Occupied<Scalar> occupied(handle);
  Scalar desired[2];
  if (!reference.is_none()) {
    if (!take_row(reference, desired, 2)) return kUnclear;
    if (std::isnan(desired[0]) || std::isnan(desired[1])) return kUnclear;
  }
  handle.status = handle.filter->feedback(reference.is_none() ? nullptr : desired);
  return static_cast<int>(handle.status);
}

template <class Scalar>
py::array_t<Scalar> vector(const Scalar* values, int size) {
  return py::array_t<Scalar>(size, values);
}

/// What the last update reported as a dict; None if nothing was measured.
template <class Scalar>
py::object report(const FilterHandle<Scalar>& handle) {
  require_idle(handle);
  const auto& r = handle.report;
  if (r.size == 0) return py::none();
  py::dict result;
  result["innovation"] = vector(r.innovation, r.size);
  result["S"] = vector(r.S, r.size * r.size).reshape({r.size, r.size});
  result["nis"] = r.nis;
  result["near_field"] = r.near_field;
  result["standardised"] = vector(r.standardised, r.size);
  result["weight"] = vector(r.weight, r.size);
  result["decision"] = r.decision;
  result["iterations"] = r.iterations;
  result["recovered"] = r.recovered;
  return result;
}

/// A column of `record`, or null where it is None; the Python layer has checked the shapes.
template <class Element>
const Element* column(const py::dict& record, const char* name) {
  const py::object value = record[name];
  if (value.is_none()) return nullptr;
  return py::cast<py::array_t<Element, py::array::c_style>>(value).data();
}

/// What Python gives as a record; `given` must live as long as it.
template <class Scalar>
desk::Record<Scalar> to_record(const py::dict& given, const py::list& sensors) {
  const auto z = given["z"].cast<Array<Scalar>>();
  desk::Record<Scalar> record;
  record.rows = static_cast<std::size_t>(z.shape(0));
  record.width = static_cast<std::size_t>(z.shape(1));
  record.z = z.data();
  record.dt = column<Scalar>(given, "dt");
  record.input = column<Scalar>(given, "input");
  record.place = column<Scalar>(given, "place");
  record.age = column<Scalar>(given, "age_s");
  record.reference = column<Scalar>(given, "reference");
  record.sensor = column<std::int32_t>(given, "sensor");
  for (const auto& sensor : sensors) {
    record.sensors.push_back(sensor.cast<SensorHandle<Scalar>>());
  }
  return record;
}

/// Rows of a record; see desk::Record. Gives how many were done, the status and the columns.
template <class Scalar>
py::tuple run(FilterHandle<Scalar>& handle, const py::dict& given, const py::list& sensors,
              bool covariance) {
  const Occupied<Scalar> occupied(handle);
  const desk::Record<Scalar> record = to_record<Scalar>(given, sensors);
  const auto rows = static_cast<py::ssize_t>(record.rows);
  const auto m = static_cast<py::ssize_t>(record.width);
  const py::ssize_t n = handle.filter->states();
  const py::ssize_t full = covariance ? rows : 0;
  const bool sums = handle.filter->components() > 1;
  py::array_t<Scalar> x({rows, n}), p({full, n, n}), s({full, m, m});
  py::array_t<Scalar> innovation({rows, m}), standardised({rows, m}), weight({rows, m});
  py::array_t<Scalar> nis(rows), interval(rows);
  py::array_t<std::uint8_t> decision(rows), iterations(rows);
  py::array_t<bool> near_field(rows), recovered(rows), too_late(rows);
  py::array_t<std::uint8_t> convergence(sums ? rows : 0), size(sums ? rows : 0);
  desk::Columns<Scalar> out;
  out.x = x.mutable_data();
  out.P = covariance ? p.mutable_data() : nullptr;
  out.innovation = innovation.mutable_data();
  out.S = covariance ? s.mutable_data() : nullptr;
  out.standardised = standardised.mutable_data();
  out.weight = weight.mutable_data();
  out.nis = nis.mutable_data();
  out.interval = interval.mutable_data();
  out.decision = decision.mutable_data();
  out.iterations = iterations.mutable_data();
  out.near_field = near_field.mutable_data();
  out.recovered = recovered.mutable_data();
  out.too_late = too_late.mutable_data();
  out.convergence = sums ? convergence.mutable_data() : nullptr;
  out.size = sums ? size.mutable_data() : nullptr;
  std::size_t done;
  {
    py::gil_scoped_release release;
    done = handle.filter->run(record, out, handle.report, handle.status);
  }
  py::dict result;
  result["x"] = x;
  result["P"] = p;
  result["innovation"] = innovation;
  result["S"] = s;
  result["nis"] = nis;
  result["near_field"] = near_field;
  result["standardised"] = standardised;
  result["weight"] = weight;
  result["decision"] = decision;
  result["iterations"] = iterations;
  result["recovered"] = recovered;
  result["interval_s"] = interval;
  result["too_late"] = too_late;
  result["convergence"] = convergence;
  result["mixture_size"] = size;
  return py::make_tuple(done, handle.status, result);
}

/// Smooths the first rows of a record; see desk::AnyFilter. `end` is the smoothed belief after them
/// or None, lag_s NaN for all that comes later. Gives the status, x (rows, n), P (rows, n, n), and
/// the smoothed belief before the first row.
template <class Scalar>
py::tuple smooth(const FilterHandle<Scalar>& handle, const py::dict& given, const py::list& sensors,
                 py::ssize_t rows, const py::object& end, double lag_s) {
  require_idle(handle);
  const desk::Record<Scalar> record = to_record<Scalar>(given, sensors);
  const py::ssize_t n = handle.filter->states();
  py::array_t<Scalar> x({rows, n}), p({rows, n, n}), start_x(n), start_p({n, n});
  Array<Scalar> end_x, end_p;
  desk::Smoothed<Scalar> out;
  out.rows = static_cast<std::size_t>(rows);
  out.end_x = out.end_P = nullptr;
  if (!end.is_none()) {
    const auto pair = end.cast<py::tuple>();
    end_x = pair[0].cast<Array<Scalar>>();
    end_p = pair[1].cast<Array<Scalar>>();
    require_shape(end_x, {n}, "end");
    require_shape(end_p, {n, n}, "end");
    out.end_x = end_x.data();
    out.end_P = end_p.data();
  }
  out.x = x.mutable_data();
  out.P = p.mutable_data();
  out.start_x = start_x.mutable_data();
  out.start_P = start_p.mutable_data();
  out.lag_s = lag_s;
  const auto from = handle.filter->clone();
  Status status;
  {
    py::gil_scoped_release release;
    status = from->smooth(record, out);
  }
  return py::make_tuple(status, x, p, py::make_tuple(start_x, start_p));
}

template <class Scalar>
py::array_t<Scalar> numbers(const std::vector<Scalar>& values) {
  return py::array_t<Scalar>(static_cast<py::ssize_t>(values.size()), values.data());
}

template <class Scalar>
std::vector<Scalar> numbers(const py::dict& state, const char* name) {
  const auto array = state[name].cast<Array<Scalar>>();
  require_shape(array, {-1}, name);
  return std::vector<Scalar>(array.data(), array.data() + array.size());
}

/// The state as flat arrays, and the descriptions of the sensors of remembered updates ("" for a
/// prediction).
template <class Scalar>
py::tuple save(const FilterHandle<Scalar>& handle) {
  require_idle(handle);
  const auto state = handle.filter->save();
  py::dict result;
  result["x"] = numbers(state.x);
  result["P"] = numbers(state.P);
  result["input"] = numbers(state.input);
  result["policy"] = numbers(state.policy);
  result["recovery"] = numbers(state.recovery);
  if (!state.mixture.empty()) result["mixture"] = numbers(state.mixture);
  result["base"] = numbers(state.base);
  result["events"] = numbers(state.events);
  py::list sensors;
  for (const auto& sensor : state.sensors) {
    sensors.append(sensor == nullptr ? std::string() : sensor->description);
  }
  return py::make_tuple(result, sensors);
}

/// Takes back what save() gave; `sensors` are handles, None for a prediction.
template <class Scalar>
void restore(FilterHandle<Scalar>& handle, const py::dict& given, const py::list& sensors) {
  const Occupied<Scalar> occupied(handle);
  desk::FilterState<Scalar> state;
  state.x = numbers<Scalar>(given, "x");
  state.P = numbers<Scalar>(given, "P");
  state.input = numbers<Scalar>(given, "input");
  state.policy = numbers<Scalar>(given, "policy");
  state.recovery = numbers<Scalar>(given, "recovery");
  if (given.contains("mixture")) state.mixture = numbers<Scalar>(given, "mixture");
  state.base = numbers<Scalar>(given, "base");
  state.events = numbers<Scalar>(given, "events");
  for (const auto& sensor : sensors) {
    state.sensors.push_back(sensor.is_none() ? nullptr : sensor.cast<SensorHandle<Scalar>>());
  }
  require_ok(handle.filter->restore(state));
  handle.status = Status::kOk;
}

/// The report and the status as they were when the filter was saved.
template <class Scalar>
void set_report(FilterHandle<Scalar>& handle, const py::object& given, Status status) {
  desk::Report<Scalar> r;
  if (!given.is_none()) {
    const auto values = given.cast<py::dict>();
    const auto take = [&values](const char* name, Scalar* out, int size) {
      const auto array = values[name].cast<Array<Scalar>>();
      if (array.size() != size) throw py::value_error(std::string(name) + " has the wrong size");
      std::copy_n(array.data(), size, out);
    };
    r.size = static_cast<int>(values["innovation"].cast<Array<Scalar>>().size());
    if (r.size < 1 || r.size > kMaxSize) throw py::value_error("innovation has the wrong size");
    take("innovation", r.innovation, r.size);
    take("S", r.S, r.size * r.size);
    take("standardised", r.standardised, r.size);
    take("weight", r.weight, r.size);
    r.nis = values["nis"].cast<Scalar>();
    r.near_field = values["near_field"].cast<bool>();
    r.decision = values["decision"].cast<Decision>();
    r.iterations = values["iterations"].cast<std::uint8_t>();
    r.recovered = values["recovered"].cast<bool>();
  }
  handle.report = r;
  handle.status = status == Status::kRecoveriesRepeat ? Status::kOk : status;  // not a call's
}

template <class Scalar>
desk::FilterOptions<Scalar> to_options(const py::dict& given, const AnyKernel<Scalar>& kernel,
                                       const AnyInterval<Scalar>& policy) {
  using Kind = typename AnyLinearisation<Scalar>::Kind;
  desk::FilterOptions<Scalar> options;
  options.kind = static_cast<Kind>(given["linearisation"].cast<std::uint8_t>());
  options.points =
      from_dict<typename SigmaPoints<Scalar>::Params>(given["points"].cast<py::dict>());
  AnyRecovery<Scalar> recovery;
  const auto rejections = given["rejections"].cast<std::uint8_t>();  // 0: no recovery
  recovery.enabled = rejections > 0;
  if (recovery.enabled) recovery.streak.params.rejections = rejections;
  typename desk::FilterOptions<Scalar>::Rule::Params params;
  params.residual = given["post_fit"].cast<bool>() ? Residual::kPostFit : Residual::kInnovation;
  params.max_iterations = given["max_iterations"].cast<std::uint8_t>();
  params.tolerance = given["tolerance"].cast<Scalar>();
  options.rule = typename desk::FilterOptions<Scalar>::Rule(kernel, recovery, params);
  require_ok(options.rule.check());
  options.policy = policy;
  options.late_s = given["late_s"].cast<Scalar>();
  options.longest_step_s = given["longest_step_s"].cast<Scalar>();
  options.components = given["components"].cast<std::uint8_t>();
  options.headings = given["headings"].cast<std::uint8_t>();
  if (!(options.longest_step_s > Scalar(0))) throw StatusError(Status::kBadParameter);
  return options;
}

/// The components of the belief: weights (n), means (n, states) and covariances (n, states,
/// states).
template <class Scalar>
py::tuple mixture(const FilterHandle<Scalar>& handle) {
  require_idle(handle);
  const py::ssize_t n = handle.filter->size();
  const py::ssize_t states = handle.filter->states();
  py::array_t<Scalar> weight(n), x({n, states}), p({n, states, states});
  for (py::ssize_t k = 0; k < n; ++k) {
    handle.filter->component(static_cast<int>(k), *weight.mutable_data(k), x.mutable_data(k, 0),
                             p.mutable_data(k, 0, 0));
  }
  return py::make_tuple(weight, x, p);
}

template <class Scalar>
py::object law(const FilterHandle<Scalar>& handle) {
  require_idle(handle);
  const auto& policy = handle.filter->policy();
  if (policy.kind != AnyInterval<Scalar>::Kind::kMahalanobis) return py::none();
  const auto& m = policy.mahalanobis.memory;
  py::dict result;
  result["tau"] = m.tau;
  result["ratio"] = m.ratio;
  result["mahalanobis_squared"] = m.mahalanobis_squared;
  return result;
}

/// Everything that can be made by name: the registry's models, and those of libraries loaded since.
template <class Scalar>
desk::Catalogue<Scalar>& catalogue() {
  static auto* const all = [] {  // never destroyed: it lives as long as the process
    auto* made = new desk::Catalogue<Scalar>();
    desk::add_models<2>(*made);
    desk::add_models<3>(*made);
    desk::add_models<4>(*made);
    desk::add_models<6>(*made);
    desk::add_models<8>(*made);
    if constexpr (std::is_same<Scalar, double>::value) desk::add_function_filters(*made);
    return made;
  }();
  return *all;
}

/// Adds the models of a compiled library to the catalogues. The library stays.
void load_library(const std::string& path) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) throw py::import_error(dlerror());
  void* const symbol = dlsym(library, "auvest_add_models");
  if (symbol == nullptr) throw py::import_error(path + " is no library of models");
  using AddModels = void(desk::Catalogue<float>&, desk::Catalogue<double>&);
  reinterpret_cast<AddModels*>(symbol)(catalogue<float>(), catalogue<double>());
}

template <class Scalar>
void bind_precision(py::module_& m) {
  using Filter = FilterHandle<Scalar>;
  using Process = desk::AnyProcess<Scalar>;
  using Sensor = desk::AnySensor<Scalar>;

  py::class_<Process, std::shared_ptr<Process>>(m, named<Scalar>("Process").c_str(),
                                                "A process model.")
      .def_readonly("states", &Process::states)
      .def_readonly("inputs", &Process::inputs)
      .def(
          "f",
          [](const Process& p, const Array<Scalar>& x, Scalar dt, const Array<Scalar>& input) {
            require_shape(x, {p.states}, "x");
            require_shape(input, {p.inputs}, "input");
            py::array_t<Scalar> out(p.states);
            p.f(x.data(), dt, input.data(), out.mutable_data());
            return out;
          },
          py::arg("x").noconvert(), py::arg("dt"), py::arg("input").noconvert(),
          "The state (n,) after dt seconds.")
      .def(
          "Phi",
          [](const Process& p, const Array<Scalar>& x, Scalar dt, const Array<Scalar>& input) {
            require_shape(x, {p.states}, "x");
            require_shape(input, {p.inputs}, "input");
            py::array_t<Scalar> out({p.states, p.states});
            p.Phi(x.data(), dt, input.data(), out.mutable_data());
            return out;
          },
          py::arg("x").noconvert(), py::arg("dt"), py::arg("input").noconvert(),
          "Jacobian (n, n) of f.")
      .def(
          "Q",
          [](const Process& p, Scalar dt, const Array<Scalar>& input) {
            require_shape(input, {p.inputs}, "input");
            py::array_t<Scalar> out({p.states, p.states});
            p.Q(dt, input.data(), out.mutable_data());
            return out;
          },
          py::arg("dt"), py::arg("input").noconvert(), "Process noise covariance (n, n).");

  py::class_<Sensor, std::shared_ptr<Sensor>>(m, named<Scalar>("Sensor").c_str(),
                                              "A measurement model for a number of states.")
      .def_readonly("states", &Sensor::states)
      .def_readonly("size", &Sensor::size)
      .def_readonly("place", &Sensor::place)
      .def_readwrite("description", &Sensor::description)
      .def_readwrite("stands", &Sensor::stands)
      .def(
          "h",
          [](const Sensor& sensor, const Array<Scalar>& x) {
            require_shape(x, {-1, sensor.states}, "x");
            py::array_t<Scalar> z({x.shape(0), py::ssize_t(sensor.size)});
            sensor.measure(x.data(), z.mutable_data(), static_cast<std::size_t>(x.shape(0)));
            return z;
          },
          py::arg("x").noconvert(), "Noise-free measurements (K, m) of states (K, n).");

  py::class_<Filter>(m, named<Scalar>("Filter").c_str(), "A filter of the family.")
      .def(py::init([](const std::shared_ptr<Process>& process, const AnyKernel<Scalar>& kernel,
                       const AnyInterval<Scalar>& policy, const py::dict& options) {
             Filter made;
             const auto make = catalogue<Scalar>().filters.at(process->states);
             made.filter = make(process, to_options(options, kernel, policy));
             if (made.filter == nullptr) throw StatusError(Status::kBadParameter);
             return made;
           }),
           py::arg("process"), py::arg("kernel"), py::arg("policy"), py::arg("options"))
      .def(
          "reset",
          [](Filter& f, const Array<Scalar>& x0, const Array<Scalar>& p0,
             const Array<Scalar>& reference) {
            const Occupied<Scalar> occupied(f);
            const py::ssize_t n = f.filter->states();
            require_shape(x0, {n}, "x0");
            require_shape(p0, {n, n}, "P0");
            require_shape(reference, {2}, "reference");
            require_ok(f.filter->reset(x0.data(), p0.data(), reference.data()));
            f.report = desk::Report<Scalar>();
          },
          py::arg("x0").noconvert(), py::arg("P0").noconvert(), py::arg("reference").noconvert())
      .def("copy",
           [](const Filter& f) {
             require_idle(f);
             Filter twin;
             twin.filter = f.filter->clone();
             twin.report = f.report;
             twin.status = f.status;
             return twin;
           })
      .def("predict", &predict<Scalar>, py::arg("dt"), py::arg("input"))
      .def("update", &update<Scalar>, py::arg("z"), py::arg("sensor"), py::arg("place"),
           py::arg("age_s"))
      .def("feedback", &feedback<Scalar>, py::arg("reference"))
      .def("run", &run<Scalar>, py::arg("record"), py::arg("sensors"), py::arg("covariance"))
      .def("smooth", &smooth<Scalar>, py::arg("record"), py::arg("sensors"), py::arg("rows"),
           py::arg("end"), py::arg("lag_s"))
      .def("save", &save<Scalar>)
      .def("restore", &restore<Scalar>, py::arg("state"), py::arg("sensors"))
      .def("set_report", &set_report<Scalar>, py::arg("report"), py::arg("status"))
      .def_property_readonly("report", &report<Scalar>)
      .def_property_readonly("law", &law<Scalar>)
      .def_property_readonly("mixture", &mixture<Scalar>)
      .def_property_readonly("convergence",
                             [](const Filter& f) {
                               require_idle(f);
                               return f.filter->convergence();
                             })
      .def_property_readonly(
          "status",
          [](const Filter& f) { return f.status == Status::kOk ? f.filter->status() : f.status; })
      .def_property_readonly("nis",
                             [](const Filter& f) {
                               require_idle(f);
                               return f.report.size > 0 ? f.report.nis
                                                        : std::numeric_limits<Scalar>::quiet_NaN();
                             })
      .def_property_readonly("interval",
                             [](const Filter& f) {
                               require_idle(f);
                               return f.filter->interval();
                             })
      .def_property_readonly("x",
                             [](const Filter& f) {
                               require_idle(f);
                               py::array_t<Scalar> x(f.filter->states());
                               f.filter->x(x.mutable_data());
                               return x;
                             })
      .def_property_readonly("P", [](const Filter& f) {
        require_idle(f);
        py::array_t<Scalar> p({f.filter->states(), f.filter->states()});
        f.filter->P(p.mutable_data());
        return p;
      });

  m.def(
      named<Scalar>("is_coarse").c_str(),
      [](Scalar x, Scalar variance) { return math::is_coarse(x, variance); }, py::arg("x"),
      py::arg("variance"),
      "Whether the precision is too coarse at x for a number with this variance.");
  m.def(
      named<Scalar>("make_process").c_str(),
      [](const std::string& name, const Array<Scalar>& values) {
        const auto& entry = catalogue<Scalar>().processes.at(name);
        require_shape(values, {py::ssize_t(entry.parameters.names.size())}, "values");
        Status status = Status::kOk;
        const auto process = entry.make(values.data(), status);
        require_ok(status);
        return std::const_pointer_cast<Process>(process);
      },
      py::arg("name"), py::arg("values").noconvert());
  m.def(
      named<Scalar>("make_sensor").c_str(),
      [](const std::string& name, int states, const Array<Scalar>& values) {
        const auto& entry = catalogue<Scalar>().sensors.at({name, states});
        require_shape(values, {py::ssize_t(entry.parameters.names.size())}, "values");
        Status status = Status::kOk;
        const auto sensor = entry.make(values.data(), status);
        require_ok(status);
        return sensor;
      },
      py::arg("name"), py::arg("states"), py::arg("values").noconvert());
  if (!std::is_same<Scalar, double>::value) return;

  const auto defaults = [](const desk::Parameters& parameters) {
    py::dict result;
    for (std::size_t i = 0; i < parameters.names.size(); ++i) {
      result[parameters.names[i].c_str()] = parameters.defaults[i];
    }
    return result;
  };
  m.def(
      "process_defaults",
      [defaults](const std::string& name) {
        return defaults(catalogue<Scalar>().processes.at(name).parameters);
      },
      py::arg("name"), "The parameters of a process by name, in the order of make_process.");
  m.def(
      "sensor_defaults",
      [defaults](const std::string& name) {
        for (const auto& entry : catalogue<Scalar>().sensors) {
          if (entry.first.first == name) return defaults(entry.second.parameters);
        }
        throw py::key_error(name);
      },
      py::arg("name"), "The parameters of a sensor by name, in the order of make_sensor.");
  m.def(
      "sensor_states",
      [](const std::string& name) {
        py::list states;
        for (const auto& entry : catalogue<Scalar>().sensors) {
          if (entry.first.first == name) states.append(entry.first.second);
        }
        return states;
      },
      py::arg("name"), "Numbers of states that a sensor is made for.");
  m.def(
      "models",
      [] {
        py::list processes, sensors;
        for (const auto& entry : catalogue<Scalar>().processes) processes.append(entry.first);
        for (const auto& entry : catalogue<Scalar>().sensors) {
          sensors.append(py::make_tuple(entry.first.first, entry.first.second));
        }
        return py::make_tuple(processes, sensors);
      },
      "Names of all processes, and names and numbers of states of all sensors.");
}

}  // namespace

void bind_filters(py::module_& m) {
  m.attr("UNCLEAR") = kUnclear;
  m.attr("MAX_PLACE") = kMaxPlace;
  m.attr("MAX_COMPONENTS") = desk::kMaxComponents;
  py::enum_<Convergence>(m, "Convergence", "What the ranges say about where the craft is.")
      .value("not_converged", Convergence::kNotConverged)
      .value("ambiguous", Convergence::kAmbiguous)
      .value("settling", Convergence::kSettling)
      .value("settled", Convergence::kSettled);
  m.def("describe", static_cast<const char* (*)(Convergence)>(&describe), py::arg("convergence"),
        "One line of English for a convergence.");
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def("load_library", &load_library, py::arg("path"));
  m.def("sigma_points_defaults", [] { return to_dict(SigmaPoints<double>::Params()); });
}

}  // namespace bindings
}  // namespace auvest
