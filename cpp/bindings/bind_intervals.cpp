#include "auvest/runtime/any_interval.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar>
AnyInterval<Scalar> checked(const AnyInterval<Scalar>& policy) {
  require_ok(policy.check());
  return policy;
}

template <class Scalar>
void bind_interval(py::module_& m) {
  using Policy = AnyInterval<Scalar>;
  using Kind = typename Policy::Kind;
  py::class_<Policy>(m, named<Scalar>("Interval").c_str(), "A policy for the sampling interval.")
      .def_static(
          "fixed",
          [](const py::dict& params) {
            Policy policy;
            policy.kind = Kind::kFixed;
            policy.fixed =
                FixedInterval<Scalar>(from_dict<typename FixedInterval<Scalar>::Params>(params));
            return checked(policy);
          },
          py::arg("params"), "A constant interval.")
      .def_static(
          "mahalanobis",
          [](const py::dict& params) {
            Policy policy;
            policy.kind = Kind::kMahalanobis;
            policy.mahalanobis = MahalanobisInterval<Scalar>(
                from_dict<typename MahalanobisInterval<Scalar>::Params>(params));
            return checked(policy);
          },
          py::arg("params"), "The paper's law, Eqs. (7) to (12).")
      .def_static(
          "covariance_budget",
          [](const py::dict& params) {
            Policy policy;
            policy.kind = Kind::kCovarianceBudget;
            policy.budget = CovarianceBudget<Scalar>(
                from_dict<typename CovarianceBudget<Scalar>::Params>(params));
            return checked(policy);
          },
          py::arg("params"), "The largest interval within an error budget.");
}

}  // namespace

void bind_intervals(py::module_& m) {
  bind_interval<float>(m);
  bind_interval<double>(m);
  m.def("fixed_interval_defaults", [] { return to_dict(FixedInterval<double>::Params()); });
  m.def("covariance_budget_defaults", [] { return to_dict(CovarianceBudget<double>::Params()); });
  m.def(
      "mahalanobis_interval_defaults",
      [](const std::string& preset) {
        using Params = MahalanobisInterval<double>::Params;
        if (preset == "figure3") return to_dict(Params::figure3());
        if (preset == "table1") return to_dict(Params::table1());
        throw py::value_error("preset must be 'figure3' or 'table1'");
      },
      py::arg("preset"));
}

}  // namespace bindings
}  // namespace auvest
