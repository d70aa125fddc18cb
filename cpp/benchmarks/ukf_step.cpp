// Cost of one step (predict and update) of the fast UKF: six states, range and bearing.
//
//     ukf_step [steps]     prints nanoseconds per step, float and double
//
// Under valgrind --tool=callgrind --toggle-collect=ukf_step_double (or ..._float) the instructions
// collected are those of the steps alone; `make bench` does that and divides.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "auvest/auvest.hpp"

namespace {

using auvest::Matrix;
using auvest::Vector;

template <class Scalar>
using Filter = auvest::Ukf<auvest::EulerAcceleration<Scalar>>;
template <class Scalar>
using Sonar = auvest::RangeBearing<Scalar, 6>;

template <class Scalar>
Sonar<Scalar> make_sonar() {
  typename Sonar<Scalar>::Params p;
  p.station_x_m = Scalar(10);
  p.station_y_m = Scalar(-20);
  p.sigma_range_m = Scalar(1);
  p.sigma_bearing_rad = Scalar(0.05);
  return Sonar<Scalar>(p);
}

template <class Scalar>
Filter<Scalar> make_filter() {
  auvest::AccelerationNoise<Scalar> noise;
  noise.position = Scalar(0.02);
  noise.velocity = Scalar(0.002);
  noise.acceleration = Scalar(0.0002);
  typename Filter<Scalar>::Params points;
  points.alpha = Scalar(1e-3);
  Filter<Scalar> filter{auvest::EulerAcceleration<Scalar>(noise), points};
  Vector<Scalar, 6> x = Vector<Scalar, 6>::Zero();
  x(0) = Scalar(690);
  x(1) = Scalar(5);
  x(3) = Scalar(3);
  Matrix<Scalar, 6, 6> P = Matrix<Scalar, 6, 6>::Zero();
  const double variances[6] = {100, 100, 10, 10, 1, 1};
  for (int i = 0; i < 6; ++i) P(i, i) = Scalar(variances[i]);
  if (filter.reset(x, P) != auvest::Status::kOk) std::exit(1);
  return filter;
}

/// Noisy measurements of a figure of eight, 300 to 700 m in front of the station.
template <class Scalar>
std::vector<Vector<Scalar, 2>> make_record(int steps) {
  auvest::math::Random random(1);
  std::vector<Vector<Scalar, 2>> record;
  const double rate = auvest::math::two_pi<double>() / 600;
  for (int k = 1; k <= steps; ++k) {
    double v_r = 0;
    double v_b = 0;
    random.normal_pair(v_r, v_b);
    const double dx = 500 + 200 * auvest::math::cos(rate * 0.5 * k) - 10;
    const double dy = 200 * auvest::math::sin(2 * rate * 0.5 * k) + 20;
    record.push_back(Vector<Scalar, 2>(
        static_cast<Scalar>(auvest::math::sqrt(dx * dx + dy * dy) + v_r),
        static_cast<Scalar>(auvest::math::wrap(auvest::math::atan2(dy, dx) + 0.05 * v_b))));
  }
  return record;
}

template <class Scalar, class Step>
void run(const char* name, int steps, Step step) {
  Filter<Scalar> filter = make_filter<Scalar>();
  const Sonar<Scalar> sonar = make_sonar<Scalar>();
  const auto record = make_record<Scalar>(steps);
  bool ok = true;
  const auto start = std::chrono::steady_clock::now();
  for (const auto& z : record) ok = step(filter, sonar, z) && ok;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  std::printf("%s %.1f ns/step%s, x = %.6f\n", name, elapsed.count() / steps * 1e9,
              ok ? "" : " FAILED", static_cast<double>(filter.x()(0)));
}

template <class Scalar>
inline bool step(Filter<Scalar>& filter, const Sonar<Scalar>& sonar, const Vector<Scalar, 2>& z) {
  return filter.predict(Scalar(0.5)) == auvest::Status::kOk &&
         filter.update(z, sonar).status == auvest::Status::kOk;
}

}  // namespace

extern "C" __attribute__((noinline)) bool ukf_step_double(Filter<double>& filter,
                                                          const Sonar<double>& sonar,
                                                          const Vector<double, 2>& z) {
  return step(filter, sonar, z);
}

extern "C" __attribute__((noinline)) bool ukf_step_float(Filter<float>& filter,
                                                         const Sonar<float>& sonar,
                                                         const Vector<float, 2>& z) {
  return step(filter, sonar, z);
}

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 100000;
  if (steps < 1) {
    std::fputs("usage: ukf_step [steps >= 1]\n", stderr);
    return 2;
  }
  run<double>("double", steps, ukf_step_double);
  run<float>("float", steps, ukf_step_float);
}
