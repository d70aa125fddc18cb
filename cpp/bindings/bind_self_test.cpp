#include "auvest/self_test.hpp"

#include "binders.hpp"

namespace auvest {
namespace bindings {

void bind_self_test(py::module_& m) {
  py::enum_<SelfTestPart>(m, "SelfTestPart", "What the self-test looks at.")
      .value("none", SelfTestPart::kNone)
      .value("rounding", SelfTestPart::kRounding)
      .value("expression", SelfTestPart::kExpression)
      .value("contraction", SelfTestPart::kContraction)
      .value("subnormals", SelfTestPart::kSubnormals)
      .value("math", SelfTestPart::kMath)
      .value("prediction", SelfTestPart::kPrediction)
      .value("correction", SelfTestPart::kCorrection)
      .value("update", SelfTestPart::kUpdate)
      .value("interval", SelfTestPart::kInterval);

  py::class_<SelfTestResult>(m, "SelfTestResult", "What the self-test found.")
      .def_readonly("failed", &SelfTestResult::failed, "The first part that failed, or none.")
      .def_readonly("index", &SelfTestResult::index,
                    "Which probe of that part failed; for the golden trace its step.")
      .def_property_readonly("ok", &SelfTestResult::ok, "True if nothing failed.")
      .def_property_readonly(
          "message", [](const SelfTestResult& result) { return describe(result.failed); },
          "One line of English.")
      .def("__repr__", [](const SelfTestResult& result) {
        return std::string("SelfTestResult(") + describe(result.failed) + ")";
      });

  m.def("self_test", &self_test,
        "Tell whether this process keeps the library's float32 bits; see SelfTestResult.");
}

}  // namespace bindings
}  // namespace auvest
