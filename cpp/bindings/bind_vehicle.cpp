#include <memory>

#include "auvest/vehicle/bluerov2_heavy.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"
#include "auvest/vehicle/stable_step.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

/// A hull whose vehicle and degrees of freedom are chosen at run time.
template <class Scalar>
class AnyHull {
 public:
  virtual ~AnyHull() = default;
  virtual int velocities() const = 0;
  virtual int actuators() const = 0;
  virtual std::vector<int> axes() const = 0;
  virtual Matrix<Scalar, 6, 6> mass_matrix() const = 0;
  virtual Scalar largest_stable_step(const Scalar* state, const Scalar* command,
                                     bool rk4) const = 0;
  /// Takes `count` steps, the command of row k held over step k; writes count + 1 states. Says how
  /// many were done.
  virtual py::ssize_t run(Scalar* states, const Scalar* commands, const Scalar* current, Scalar dt,
                          py::ssize_t count, bool rk4, Status& status) const = 0;
};

template <class Hull>
class HullOf final : public AnyHull<typename Hull::Scalar> {
 public:
  using Scalar = typename Hull::Scalar;

  explicit HullOf(const typename Hull::Params& params) : hull_(params) {
    require_ok(hull_.check());
  }

  int velocities() const override { return Hull::kVelocities; }
  int actuators() const override { return Hull::kActuators; }
  std::vector<int> axes() const override {
    std::vector<int> kept;
    for (int i = 0; i < Hull::kVelocities; ++i) kept.push_back(Hull::Freedom::axis(i));
    return kept;
  }
  Matrix<Scalar, 6, 6> mass_matrix() const override { return hull_.mass_matrix(); }

  Scalar largest_stable_step(const Scalar* state, const Scalar* command, bool rk4) const override {
    const auto x = vector<Hull::kStates>(state);
    const auto c = vector<Hull::kActuators>(command);
    return rk4 ? auvest::largest_stable_step<Rk4>(hull_, x, c)
               : auvest::largest_stable_step<SemiImplicit>(hull_, x, c);
  }

  py::ssize_t run(Scalar* states, const Scalar* commands, const Scalar* current, Scalar dt,
                  py::ssize_t count, bool rk4, Status& status) const override {
    auto x = vector<Hull::kStates>(states);
    const auto stream = vector<3>(current);
    status = Status::kOk;
    for (py::ssize_t k = 0; k < count; ++k) {
      const auto command = vector<Hull::kActuators>(commands + k * Hull::kActuators);
      status = rk4 ? advance<Rk4>(hull_, x, command, stream, dt)
                   : advance<SemiImplicit>(hull_, x, command, stream, dt);
      if (status != Status::kOk) return k;
      for (int i = 0; i < Hull::kStates; ++i) states[(k + 1) * Hull::kStates + i] = x(i);
    }
    return count;
  }

 private:
  template <int Size>
  static Vector<Scalar, Size> vector(const Scalar* from) {
    Vector<Scalar, Size> result;
    for (int i = 0; i < Size; ++i) result(i) = from[i];
    return result;
  }

  Hull hull_;
};

/// Reads and writes nested parameters as a dict of dicts.
class ToDict {
 public:
  explicit ToDict(py::dict& out) : out_(out) {}
  void operator()(const char* name, bool& value) { out_[name] = value; }
  void operator()(const char* name, float& value) { out_[name] = static_cast<double>(value); }
  void operator()(const char* name, double& value) { out_[name] = value; }
  template <class Group>
  void operator()(const char* name, Group& group) {
    py::dict inner;
    group.visit(ToDict(inner));
    out_[name] = inner;
  }

 private:
  py::dict& out_;
};

class FromDict {
 public:
  explicit FromDict(const py::dict& in) : in_(in) {}
  void operator()(const char* name, bool& value) {
    if (in_.contains(name)) value = in_[name].cast<bool>();
  }
  void operator()(const char* name, float& value) {
    if (in_.contains(name)) value = static_cast<float>(in_[name].cast<double>());
  }
  void operator()(const char* name, double& value) {
    if (in_.contains(name)) value = in_[name].cast<double>();
  }
  template <class Group>
  void operator()(const char* name, Group& group) {
    if (in_.contains(name)) group.visit(FromDict(in_[name].cast<py::dict>()));
  }

 private:
  const py::dict& in_;
};

template <class Scalar, class Vehicle>
std::shared_ptr<AnyHull<Scalar>> make(typename Vehicle::Params params, const py::dict& changes,
                                      int freedom) {
  params.visit(FromDict(changes));
  switch (freedom) {
    case 3:
      return std::make_shared<HullOf<Hull<Vehicle, ThreeDof>>>(params);
    case 4:
      return std::make_shared<HullOf<Hull<Vehicle, FourDof>>>(params);
    case 5:
      return std::make_shared<HullOf<Hull<Vehicle, FiveDof>>>(params);
    default:
      return std::make_shared<HullOf<Hull<Vehicle, SixDof>>>(params);
  }
}

template <class Scalar>
void bind_precision(py::module_& m) {
  using Any = AnyHull<Scalar>;
  py::class_<Any, std::shared_ptr<Any>>(m, named<Scalar>("Hull").c_str(), "A hull in the water.")
      .def_property_readonly("velocities", &Any::velocities)
      .def_property_readonly("actuators", &Any::actuators)
      .def_property_readonly("axes",
                             [](const Any& hull) {
                               py::list axes;
                               for (const int axis : hull.axes()) axes.append(axis);
                               return axes;
                             })
      .def_property_readonly("mass_matrix",
                             [](const Any& hull) { return to_array(hull.mass_matrix()); })
      .def(
          "largest_stable_step",
          [](const Any& hull, const Array<Scalar>& state, const Array<Scalar>& command, bool rk4) {
            require_shape(state, {2 * hull.velocities() + hull.actuators()}, "state");
            require_shape(command, {hull.actuators()}, "command");
            return hull.largest_stable_step(state.data(), command.data(), rk4);
          },
          py::arg("state").noconvert(), py::arg("command").noconvert(), py::arg("rk4"))
      .def(
          "run",
          [](const Any& hull, const Array<Scalar>& state, const Array<Scalar>& commands,
             const Array<Scalar>& current, Scalar dt, bool rk4) {
            const py::ssize_t size = 2 * hull.velocities() + hull.actuators();
            require_shape(state, {size}, "state");
            require_shape(commands, {-1, hull.actuators()}, "commands");
            require_shape(current, {3}, "current");
            const py::ssize_t count = commands.shape(0);
            py::array_t<Scalar> states(std::vector<py::ssize_t>{count + 1, size});
            Scalar* const out = states.mutable_data();
            std::copy_n(state.data(), size, out);
            Status status = Status::kOk;
            py::ssize_t done = 0;
            {
              py::gil_scoped_release release;
              done = hull.run(out, commands.data(), current.data(), dt, count, rk4, status);
            }
            return py::make_tuple(done, status, states);
          },
          py::arg("state").noconvert(), py::arg("commands").noconvert(),
          py::arg("current").noconvert(), py::arg("dt"), py::arg("rk4"));
  m.def(("make_hull_" + std::string(Precision<Scalar>::kName)).c_str(),
        [](const std::string& vehicle, int freedom, const py::dict& changes) {
          if (vehicle == "remus100") {
            return make<Scalar, Torpedo<Scalar>>(remus100<Scalar>(), changes, freedom);
          }
          if (vehicle == "bluerov2_heavy") {
            return make<Scalar, Rov<Scalar, 8>>(bluerov2_heavy<Scalar>(), changes, freedom);
          }
          throw py::value_error("no such vehicle");
        },
        py::arg("vehicle"), py::arg("freedom"), py::arg("changes"));
}

}  // namespace

void bind_vehicle(py::module_& m) {
  bind_precision<float>(m);
  bind_precision<double>(m);
  m.def(
      "vehicle_parameters",
      [](const std::string& vehicle) {
        py::dict result;
        if (vehicle == "remus100") {
          auto params = remus100<double>();
          params.visit(ToDict(result));
        } else if (vehicle == "bluerov2_heavy") {
          auto params = bluerov2_heavy<double>();
          params.visit(ToDict(result));
        } else {
          throw py::value_error("no such vehicle");
        }
        return result;
      },
      py::arg("vehicle"));
}

}  // namespace bindings
}  // namespace auvest
