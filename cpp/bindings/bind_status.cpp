#include "binders.hpp"

namespace auvest {
namespace bindings {

void bind_status(py::module_& m) {
  py::enum_<Status>(m, "Status", "What an operation of the core reports.")
      .value("ok", Status::kOk)
      .value("not_initialised", Status::kNotInitialised)
      .value("not_finite", Status::kNotFinite)
      .value("time_backwards", Status::kTimeBackwards)
      .value("bad_parameter", Status::kBadParameter)
      .value("not_positive_definite", Status::kNotPositiveDefinite)
      .value("alpha_too_small", Status::kAlphaTooSmall)
      .value("overflow", Status::kOverflow)
      .value("unstable_step", Status::kUnstableStep)
      .value("steep_pitch", Status::kSteepPitch)
      .value("step_too_long", Status::kStepTooLong)
      .value("impossible_range", Status::kImpossibleRange)
      .value("far_from_origin", Status::kFarFromOrigin)
      .value("recoveries_repeat", Status::kRecoveriesRepeat)
      .value("implausible", Status::kImplausible);
  m.def("describe", static_cast<const char* (*)(Status)>(&describe), py::arg("status"),
        "One line of English for a status.");

  static py::exception<StatusError> error(m, "StatusError", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const StatusError& e) {
      py::object instance = py::reinterpret_borrow<py::object>(error)(e.what());
      instance.attr("status") = e.status;
      PyErr_SetObject(error.ptr(), instance.ptr());
    }
  });
}

}  // namespace bindings
}  // namespace auvest
