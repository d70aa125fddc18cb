// Cost of one sonar step (predict and update) of SLATF, float32, one thread, with the widest vector
// registers that the program is compiled for.
//
//     slat_step RECORD VERSION PARTICLES REPEATS [ESTIMATES]
//
// RECORD: float32 numbers, runs x 200 steps x (speed, yaw rate, range, bearing), native byte order.
// VERSION: 1 or 2, of SLATF; 3: SlatfJoint, particle by particle; 4: SlatfShared. Without a gate:
// the paper. Goes through all runs REPEATS times and prints the processor's time of the fastest
// pass in nanoseconds per particle and step; writes the estimates of the last pass to ESTIMATES:
// runs x 200 x (master x, y, slave x, y). `make bench` calls it (slat_speed.py).
#if defined(AUVEST_SIMD_ARCH)
#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions
#endif

#include <sys/mman.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <vector>

#include "auvest/auvest.hpp"

namespace {

using auvest::Vector;

#if defined(AUVEST_SIMD_ARCH)
using Lanes = auvest::SimdLanes<xsimd::AUVEST_SIMD_ARCH>;
bool processor_has_lanes() {
#if defined(__AVX512F__)
  if (!__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512vl")) {
    return false;
  }
#endif
  return xsimd::available_architectures().AUVEST_SIMD_ARCH != 0;
}
#else
using Lanes = auvest::OneLane<float>;
bool processor_has_lanes() { return true; }
#endif

using Motion = auvest::UnicycleMotion<float>;
using Master = auvest::EulerAcceleration<float>;

using First = auvest::Slatf1<Motion, Master, 1, auvest::SystematicResampling, Lanes>;
using Second = auvest::Slatf2<Motion, Master, 1, auvest::SystematicResampling, Lanes>;
using Joint = auvest::SlatfJoint<Motion, Master, 1>;
using Shared = auvest::SlatfShared<Motion, Master, 1, auvest::SystematicResampling, Lanes>;

constexpr int kSteps = 200;
constexpr float kSeconds = 0.5f;

struct Row {
  Vector<float, 2> reading;  ///< speed, yaw rate
  Vector<float, 2> echo;     ///< range, bearing
};

std::vector<float> read_numbers(const char* path) {
  std::vector<float> numbers;
  std::FILE* file = std::fopen(path, "rb");
  float number;
  while (file != nullptr && std::fread(&number, sizeof number, 1, file) == 1) {
    numbers.push_back(number);
  }
  if (file != nullptr) std::fclose(file);
  return numbers;
}

Motion make_motion() {
  Motion::Params p;
  p.sigma_speed_m_s = 0.1f;
  p.sigma_yaw_rate_rad_s = 0.005f;
  return Motion(p);
}

Master make_master() {
  auvest::AccelerationNoise<float> noise;
  noise.position = 0.02f;
  noise.velocity = 0.002f;
  noise.acceleration = 0.0002f;
  return Master(noise);
}

auvest::Sonar<float> make_sonar() {
  auvest::Sonar<float>::Params p;
  p.sigma_range_m = 1;
  p.sigma_bearing_rad = 0.05f;
  p.bearing = auvest::Bearing::kFromHeading;
  return auvest::Sonar<float>(p);
}

/// The master on its ellipse, the slave at the origin.
template <class Filter>
void start(Filter& filter, int particles, auvest::math::Random& random) {
  typename Filter::SlaveBelief slave;
  auvest::math::set_zero(slave.x);
  auvest::math::set_zero(slave.P);
  typename Filter::MasterBelief master;
  master.x << 105, 30, 0, 1.8849556f, 0, 0;
  auvest::math::set_zero(master.P);
  const float variances[6] = {25, 25, 4, 4, 0.1f, 0.1f};
  for (int i = 0; i < 6; ++i) master.P(i, i) = variances[i];
  if (filter.reset(slave, particles, random) != auvest::Status::kOk ||
      filter.add_master(master) != auvest::Status::kOk) {
    std::exit(1);
  }
}

template <class Filter>
void read_positions(const Filter& filter, Vector<float, 2>& master, Vector<float, 2>& slave) {
  const typename Filter::Positions mean = filter.positions();
  master = mean.masters[0];
  slave = mean.slave;
}
void read_positions(const Joint& filter, Vector<float, 2>& master, Vector<float, 2>& slave) {
  master = filter.master(0).x.head<2>();
  slave = filter.slave().x.head<2>();
}

/// One run over the record.
template <class Filter>
void run(Filter& filter, int particles, std::uint64_t seed, const Row* record, float* estimates) {
  const auvest::Sonar<float> sonar = make_sonar();
  auvest::math::Random random(seed);
  start(filter, particles, random);
  for (int k = 0; k < kSteps; ++k) {
    auvest::Echo<float> seen;
    seen.z = record[k].echo;
    seen.master = 0;
    if (filter.step(kSeconds, record[k].reading, nullptr, &seen, 1, sonar, random) !=
        auvest::Status::kOk) {
      std::exit(1);
    }
    Vector<float, 2> master, slave;
    read_positions(filter, master, slave);
    for (int i = 0; i < 2; ++i) {
      *estimates++ = master(i);
      estimates[1] = slave(i);
    }
    estimates += 2;
  }
}

/// On whole cache lines and, where there is enough of it, on huge pages, as NumPy's arrays are.
float* allocate(std::size_t numbers) {
  const std::size_t page = std::size_t(1) << 21;
  const std::size_t bytes = (numbers * sizeof(float) + page - 1) / page * page;
  void* storage = nullptr;
  if (posix_memalign(&storage, page, bytes) != 0) std::exit(1);
#if defined(MADV_HUGEPAGE)
  madvise(storage, bytes, MADV_HUGEPAGE);
#endif
  return static_cast<float*>(storage);
}

template <class Filter>
int measure(const std::vector<Row>& record, int particles, int repeats, const char* output) {
  const std::unique_ptr<float, void (*)(void*)> storage(
      allocate(Filter::Set::storage_size(particles)), std::free);
  typename Filter::Params params;
  params.gate = 0;
  Filter filter(make_motion(), make_master(), params, storage.get(), particles);
  const std::size_t runs = record.size() / kSteps;
  std::vector<float> estimates(runs * kSteps * 4);
  double least = 1e30;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const std::clock_t begin = std::clock();
    for (std::size_t r = 0; r < runs; ++r) {
      run(filter, particles, r, &record[r * kSteps], &estimates[r * kSteps * 4]);
    }
    const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    least = seconds < least ? seconds : least;
  }
  std::printf("%.4f\n", least * 1e9 / (static_cast<double>(record.size()) * particles));
  if (output == nullptr) return 0;
  std::FILE* file = std::fopen(output, "wb");
  if (file == nullptr) return 1;
  const std::size_t written = std::fwrite(estimates.data(), sizeof(float), estimates.size(), file);
  return std::fclose(file) == 0 && written == estimates.size() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  const int version = argc > 4 ? std::atoi(argv[2]) : 0;
  const int particles = argc > 4 ? std::atoi(argv[3]) : 0;
  const int repeats = argc > 4 ? std::atoi(argv[4]) : 0;
  const std::vector<float> numbers = argc > 4 ? read_numbers(argv[1]) : std::vector<float>();
  if (version < 1 || version > 4 || particles < 1 || repeats < 1 || numbers.empty() ||
      numbers.size() % (4 * kSteps) != 0) {
    std::fputs("usage: slat_step RECORD VERSION PARTICLES REPEATS [ESTIMATES]\n", stderr);
    return 2;
  }
  if (!processor_has_lanes()) return 77;
  std::vector<Row> record(numbers.size() / 4);
  for (std::size_t i = 0; i < record.size(); ++i) {
    record[i].reading << numbers[4 * i], numbers[4 * i + 1];
    record[i].echo << numbers[4 * i + 2], numbers[4 * i + 3];
  }
  const char* output = argc > 5 ? argv[5] : nullptr;
  switch (version) {
    case 1:
      return measure<First>(record, particles, repeats, output);
    case 2:
      return measure<Second>(record, particles, repeats, output);
    case 3:
      return measure<Joint>(record, particles, repeats, output);
    default:
      return measure<Shared>(record, particles, repeats, output);
  }
}
