// Cost of one RK4 step of the torpedo's hull in six degrees of freedom, one thread.
//
//     hull_step PRECISION STEPS REPEATS
//
// PRECISION: double, float, or lanes: float, as many runs at once as a vector register of the
// instruction set holds that the program is compiled for. Flies kRuns runs REPEATS times, each with
// its own rudder; prints the processor's time of the fastest pass in nanoseconds per run and step,
// and then the last state of each run. `make bench` calls it (vehicle_speed.py).
#if defined(AUVEST_SIMD_ARCH)
#include "auvest/math/simd.hpp"  // before the hull, which finds its functions
#endif

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace {

constexpr int kRuns = 16;
constexpr double kStep = 0.05;
constexpr int kExitNoLanes = 3;  // this processor has not what the program is compiled for

template <class Scalar>
using Body = auvest::Hull<auvest::Torpedo<Scalar>>;

/// Run r from 1.5 m/s and 900 rpm, with rudder, stern planes and 1,000 rpm, in a current.
double rudder(int run) { return 0.01 * (run - 8); }

template <class Scalar, class Value, int Width>
struct Fleet {
  static constexpr int kStates = Body<Scalar>::kStates;
  using State = auvest::Vector<Value, kStates>;

  Body<Scalar> hull{auvest::remus100<Scalar>()};
  State states[kRuns / Width];

  void fly(int steps, const auvest::Vector<Value, 3>* commands) {
    auvest::Vector<Value, 3> current;
    current(0) = Value(Scalar(0.3));
    current(1) = Value(Scalar(-0.2));
    current(2) = Value(Scalar(0));
    for (int g = 0; g < kRuns / Width; ++g) {
      State x;
      for (int i = 0; i < kStates; ++i) x(i) = Value(Scalar(0));
      x(6) = Value(Scalar(1.5));
      x(14) = Value(Scalar(15));
      for (int k = 0; k < steps; ++k) {
        auvest::Rk4::step(hull, x, commands[g], current, Scalar(kStep));
      }
      states[g] = x;
    }
  }
};

template <class Scalar, class Value, int Width, class Gather, class Lane>
void measure(int steps, int repeats, Gather gather, Lane lane) {
  static Fleet<Scalar, Value, Width> fleet;
  auvest::Vector<Value, 3> commands[kRuns / Width];
  for (int g = 0; g < kRuns / Width; ++g) {
    Scalar rudders[Width];
    for (int i = 0; i < Width; ++i) rudders[i] = Scalar(rudder(g * Width + i));
    commands[g](0) = gather(rudders);
    commands[g](1) = Value(Scalar(0.017));
    commands[g](2) = Value(Scalar(16.6));
  }
  double least = 1e30;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const std::clock_t begin = std::clock();
    fleet.fly(steps, commands);
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    least = seconds < least ? seconds : least;
  }
  std::printf("%.4f\n", least * 1e9 / (static_cast<double>(steps) * kRuns));
  for (int run = 0; run < kRuns; ++run) {
    for (int i = 0; i < fleet.kStates; ++i) {
      std::printf("%.9g ", static_cast<double>(lane(fleet.states[run / Width](i), run % Width)));
    }
    std::printf("\n");
  }
}

template <class Scalar>
void measure_scalar(int steps, int repeats) {
  measure<Scalar, Scalar, 1>(
      steps, repeats, [](const Scalar* from) { return *from; },
      [](Scalar value, int) { return value; });
}

#if defined(AUVEST_SIMD_ARCH)
int measure_lanes(int steps, int repeats) {
  using Arch = xsimd::AUVEST_SIMD_ARCH;
  using Value = auvest::math::FloatBatch<Arch>;
#if defined(__AVX512F__)
  if (!__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512vl")) {
    return kExitNoLanes;
  }
#endif
  if (xsimd::available_architectures().AUVEST_SIMD_ARCH == 0) return kExitNoLanes;
  measure<float, Value, Value::kWidth>(
      steps, repeats, [](const float* from) { return Value(Value::Batch::load_unaligned(from)); },
      [](const Value& value, int lane) {
        float lanes[Value::kWidth];
        value.v.store_unaligned(lanes);
        return lanes[lane];
      });
  return 0;
}
#else
int measure_lanes(int, int) { return kExitNoLanes; }
#endif

}  // namespace

int main(int argc, char** argv) {
  const int steps = argc == 4 ? std::atoi(argv[2]) : 0;
  const int repeats = argc == 4 ? std::atoi(argv[3]) : 0;
  if (steps < 1 || repeats < 1) {
    std::fputs("usage: hull_step double|float|lanes STEPS REPEATS\n", stderr);
    return 2;
  }
  if (std::strcmp(argv[1], "lanes") == 0) return measure_lanes(steps, repeats);
  if (std::strcmp(argv[1], "double") == 0) {
    measure_scalar<double>(steps, repeats);
  } else {
    measure_scalar<float>(steps, repeats);
  }
  return 0;
}
