#include <algorithm>

#include "auvest/math/random.hpp"
#include "binders.hpp"

namespace auvest {
namespace bindings {
namespace {

template <class Scalar, class Draw>
py::array_t<Scalar> filled(py::ssize_t count, Draw draw) {
  if (count < 0) throw py::value_error("count must not be negative");
  py::array_t<Scalar> result(count);
  Scalar* out = result.mutable_data();
  for (py::ssize_t i = 0; i < count; ++i) out[i] = draw();
  return result;
}

template <class Scalar>
void bind_draws(py::class_<math::Random>& c) {
  c.def(
      named<Scalar>("uniform").c_str(),
      [](math::Random& random, py::ssize_t count) {
        return filled<Scalar>(count, [&random] { return random.uniform<Scalar>(); });
      },
      py::arg("count"), "Uniform deviates in [0, 1).");
  c.def(
      named<Scalar>("normal").c_str(),
      [](math::Random& random, py::ssize_t count) {
        return filled<Scalar>(count, [&random] { return random.normal<Scalar>(); });
      },
      py::arg("count"), "Standard normal deviates.");
}

}  // namespace

void bind_random(py::module_& m) {
  py::class_<math::Random> c(m, "Random", "xoshiro128++: the same stream on every target.");
  c.def(py::init<std::uint64_t, std::uint64_t>(), py::arg("seed"), py::arg("stream") = 0);
  c.def("copy", [](const math::Random& random) { return random; });
  c.def("save", [](const math::Random& random) {
    std::uint32_t state[math::Random::kStateWords];
    random.get_state(state);
    return py::array_t<std::uint32_t>(math::Random::kStateWords, state);
  });
  c.def(
      "restore",
      [](math::Random& random, const Array<std::uint32_t>& words) {
        require_shape(words, {math::Random::kStateWords}, "words");
        std::uint32_t state[math::Random::kStateWords];
        std::copy_n(words.data(), math::Random::kStateWords, state);
        random.set_state(state);
      },
      py::arg("words").noconvert());
  c.def("next_u32", &math::Random::next_u32, "32 random bits.");
  bind_draws<float>(c);
  bind_draws<double>(c);
}

}  // namespace bindings
}  // namespace auvest
