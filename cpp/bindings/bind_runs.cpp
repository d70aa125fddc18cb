// Records of many runs through one filter (desk/side_by_side.hpp).
#include "desk/side_by_side.hpp"
#include "handles.hpp"
#include "run_lanes.hpp"

namespace auvest {
namespace bindings {
namespace {

/// An array (runs or 1, rows, ...) of a record, or None: what each run has of it.
template <class Element>
class OfRuns {
 public:
  OfRuns(const py::dict& record, const char* name) {
    const py::object value = record[name];
    if (value.is_none()) return;
    const auto array = py::cast<py::array_t<Element, py::array::c_style>>(value);
    data_ = array.data();
    stride_ = array.shape(0) > 1 ? static_cast<std::size_t>(array.size() / array.shape(0)) : 0;
  }
  const Element* operator[](std::size_t run) const {
    return data_ != nullptr ? data_ + run * stride_ : nullptr;
  }

 private:
  const Element* data_ = nullptr;
  std::size_t stride_ = 0;
};

/// The same of a column to be filled, (runs, rows, ...) or None.
template <class Element>
class ToRuns {
 public:
  ToRuns(const py::dict& columns, const char* name) {
    const py::object value = columns[name];
    if (value.is_none()) return;
    auto array = py::cast<py::array_t<Element, py::array::c_style>>(value);
    data_ = array.mutable_data();
    stride_ = static_cast<std::size_t>(array.size() / array.shape(0));
  }
  Element* operator[](std::size_t run) const {
    return data_ != nullptr ? data_ + run * stride_ : nullptr;
  }

 private:
  Element* data_ = nullptr;
  std::size_t stride_ = 0;
};

/// Runs of a record, each from where the filter is, into `columns`; the Python layer has checked
/// the shapes. Gives of each run how many rows were done, how many of these not in lanes, and the
/// status.
template <class Scalar>
py::tuple run_each(const FilterHandle<Scalar>& handle, const py::dict& given,
                   const py::list& sensors, const py::dict& columns, const std::string& lanes) {
  require_idle(handle);
  desk::LaneSteps<Scalar> room;
  const desk::LaneSteps<Scalar>* const steps = steps_of(lanes, room);
  const auto whole = given["z"].cast<Array<Scalar>>();
  const auto runs = static_cast<std::size_t>(whole.shape(0));
  desk::Record<Scalar> record;
  record.rows = static_cast<std::size_t>(whole.shape(1));
  record.width = static_cast<std::size_t>(whole.shape(2));
  for (const auto& sensor : sensors) {
    record.sensors.push_back(sensor.cast<SensorHandle<Scalar>>());
  }
  const OfRuns<std::int32_t> sensor(given, "sensor");
  record.sensor = sensor[0];
  const OfRuns<Scalar> z(given, "z"), dt(given, "dt"), input(given, "input"), place(given, "place"),
      age(given, "age_s"), reference(given, "reference");
  const ToRuns<Scalar> x(columns, "x"), p(columns, "P"), innovation(columns, "innovation"),
      s(columns, "S"), standardised(columns, "standardised"), weight(columns, "weight"),
      nis(columns, "nis"), interval(columns, "interval_s");
  const ToRuns<std::uint8_t> decision(columns, "decision"), iterations(columns, "iterations"),
      convergence(columns, "convergence"), size(columns, "mixture_size");
  const ToRuns<bool> near_field(columns, "near_field"), recovered(columns, "recovered"),
      too_late(columns, "too_late");
  std::vector<desk::Record<Scalar>> records(runs, record);
  std::vector<desk::Columns<Scalar>> outs(runs);
  for (std::size_t r = 0; r < runs; ++r) {
    records[r].z = z[r];
    records[r].dt = dt[r];
    records[r].input = input[r];
    records[r].place = place[r];
    records[r].age = age[r];
    records[r].reference = reference[r];
    outs[r] = {x[r],          p[r],         innovation[r], s[r],           standardised[r],
               weight[r],     nis[r],       interval[r],   decision[r],    iterations[r],
               near_field[r], recovered[r], too_late[r],   convergence[r], size[r]};
  }
  const auto start = handle.filter->clone();
  std::vector<desk::RunEnd> ends(runs);
  {
    py::gil_scoped_release release;
    desk::run_each(*start, records.data(), outs.data(), runs, steps, ends.data());
  }
  py::array_t<std::int64_t> rows(static_cast<py::ssize_t>(runs));
  py::array_t<std::int64_t> alone(static_cast<py::ssize_t>(runs));
  py::array_t<std::uint8_t> status(static_cast<py::ssize_t>(runs));
  for (std::size_t r = 0; r < runs; ++r) {
    rows.mutable_data()[r] = static_cast<std::int64_t>(ends[r].rows);
    alone.mutable_data()[r] = static_cast<std::int64_t>(ends[r].alone);
    status.mutable_data()[r] = static_cast<std::uint8_t>(ends[r].status);
  }
  return py::make_tuple(rows, alone, status);
}

template <class Scalar>
void bind_precision(py::module_& m) {
  m.def("run_each", &run_each<Scalar>, py::arg("filter"), py::arg("record"), py::arg("sensors"),
        py::arg("columns"), py::arg("lanes"));
}

}  // namespace

void bind_runs(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
}

}  // namespace bindings
}  // namespace auvest
