// Measures the errors of the math folder: every float for sin, cos, exp, log and wrap, random and
// adversarial pairs for atan2. Prints the table of docs/algorithms/math.md.
//
//   math_accuracy [--quick] [--only FUNCTION] [--threads N]
//
// --quick takes every 509th float and fewer pairs; --only takes the functions that begin so. Exit
// code: 0, or 1 if an error exceeds 2 ulp or a special value is wrong; 2 for a wrong argument. The
// table goes to stdout, progress to stderr.
//
// Unit: the spacing of the target format at the true value (2^-149 below FLT_MIN). The true value
// is libm's double for float, libm's 80-bit long double for double. A correctly rounded result
// scores at most 0.5.

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <iomanip>
#include <iostream>
#include <limits>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "auvest/math/angle.hpp"
#include "auvest/math/exponential.hpp"
#include "auvest/math/random.hpp"
#include "auvest/math/trigonometry.hpp"

namespace {

namespace math = auvest::math;

const double kWrong = 1e30;  // the score of a wrong special value
const double kLimitUlp = 2.0;

double float_error_ulp(float computed, double truth) {
  if (std::isnan(truth)) return std::isnan(computed) ? 0.0 : kWrong;
  const float rounded = static_cast<float>(truth);
  if (std::isinf(rounded) || std::isinf(computed)) return rounded == computed ? 0.0 : kWrong;
  if (truth == 0.0) {
    const bool same = computed == 0.0f && std::signbit(computed) == std::signbit(truth);
    return same ? 0.0 : kWrong;
  }
  uint64_t bits;
  std::memcpy(&bits, &truth, sizeof bits);
  int exponent = static_cast<int>((bits >> 52) & 0x7ffu) - 1023;
  if (exponent < -126) exponent = -126;
  uint64_t scale_bits = static_cast<uint64_t>(1023 + 23 - exponent) << 52;
  double scale;
  std::memcpy(&scale, &scale_bits, sizeof scale);
  return std::fabs(static_cast<double>(computed) - truth) * scale;
}

double double_error_ulp(double computed, long double truth) {
  if (std::isnan(truth)) return std::isnan(computed) ? 0.0 : kWrong;
  if (truth == 0.0L)
    return computed == 0.0 && std::signbit(computed) == std::signbit(truth) ? 0.0 : kWrong;
  int exponent = std::ilogb(truth);
  if (exponent < -1022) exponent = -1022;
  const long double spacing = std::ldexp(1.0L, exponent - 52);
  return static_cast<double>(std::fabs(static_cast<long double>(computed) - truth) / spacing);
}

/// The largest error in one range of one function.
struct Row {
  std::string function, range;
  double worst_ulp = 0.0;
  uint64_t count = 0;
  std::string at;
};

struct Cell {
  double worst_ulp = -1.0;
  uint64_t count = 0;
  double x = 0.0, y = 0.0;

  void take(double error, double x_at, double y_at = 0.0) {
    ++count;
    if (error > worst_ulp) {
      worst_ulp = error;
      x = x_at;
      y = y_at;
    }
  }

  void merge(const Cell& other) {
    count += other.count;
    if (other.worst_ulp > worst_ulp) {
      worst_ulp = other.worst_ulp;
      x = other.x;
      y = other.y;
    }
  }
};

using Cells = std::vector<Cell>;

/// Runs `work(chunk, cells)` for all chunks on all threads and merges the cells.
template <class Work>
Cells run_chunks(const std::string& name, uint32_t chunks, unsigned threads, std::size_t ranges,
                 Work work) {
  std::atomic<uint32_t> next(0);
  std::mutex mutex;
  Cells total(ranges);
  std::vector<std::thread> pool;
  for (unsigned t = 0; t < threads; ++t) {
    pool.emplace_back([&]() {
      Cells cells(ranges);
      for (uint32_t chunk = next++; chunk < chunks; chunk = next++) {
        work(chunk, cells);
        if (chunk % 16 == 0) {
          std::lock_guard<std::mutex> lock(mutex);
          std::cerr << "\r" << name << " " << 100 * chunk / chunks << " %   " << std::flush;
        }
      }
      std::lock_guard<std::mutex> lock(mutex);
      for (std::size_t i = 0; i < ranges; ++i) total[i].merge(cells[i]);
    });
  }
  for (std::thread& thread : pool) thread.join();
  std::cerr << "\r" << name << " done    \n";
  return total;
}

/// The table of all functions.
class Report {
 public:
  Report(bool quick, const std::string& only, unsigned threads)
      : stride_(quick ? 509u : 1u), only_(only), threads_(threads) {}

  /// Every float (every 509th): `computed(x)` against `truth(x)`; `range_of(x)` picks the row.
  template <class Computed, class Truth, class RangeOf>
  void unary(const std::string& function, const std::vector<std::string>& ranges, Computed computed,
             Truth truth, RangeOf range_of) {
    if (!wanted(function)) return;
    const uint64_t kChunk = 1u << 24;
    const uint64_t stride = stride_;
    const Cells cells =
        run_chunks(function, 256, threads_, ranges.size(), [&](uint32_t chunk, Cells& mine) {
          const uint64_t begin = chunk * kChunk;
          uint64_t pattern = (begin + stride - 1) / stride * stride;
          for (; pattern < begin + kChunk; pattern += stride) {
            const float x = math::from_bits(static_cast<uint32_t>(pattern));
            const std::size_t range = range_of(x);
            mine[range].take(float_error_ulp(computed(x), truth(static_cast<double>(x))),
                             static_cast<double>(x));
          }
        });
    add(function, ranges, cells, false);
  }

  /// Pairs from `pair(random, y, x)`, one row.
  template <class Pair, class Error>
  void binary(const std::string& function, const std::string& range, uint32_t chunks, Pair pair,
              Error error) {
    if (!wanted(function)) return;
    if (stride_ != 1u) chunks = (chunks + 63) / 64;
    const Cells cells =
        run_chunks(function + ", " + range, chunks, threads_, 1, [&](uint32_t chunk, Cells& mine) {
          math::Random random(2024, chunk);
          for (uint32_t i = 0; i < (1u << 20); ++i) {
            double x, y;
            pair(random, y, x);
            mine[0].take(error(y, x), x, y);
          }
        });
    add(function, std::vector<std::string>(1, range), cells, true);
  }

  bool print() const {
    bool good = true;
    std::cout << "| function | range | arguments | largest error (ulp) | at |\n"
              << "|---|---|---:|---:|---|\n";
    for (const Row& row : rows_) {
      std::cout << "| " << row.function << " | " << row.range << " | " << row.count << " | ";
      if (row.worst_ulp >= kWrong) {
        std::cout << "wrong special value";
      } else {
        std::cout << std::fixed << std::setprecision(3) << row.worst_ulp;
      }
      std::cout << " | " << row.at << " |\n";
      good = good && row.worst_ulp <= kLimitUlp;
    }
    return good;
  }

 private:
  bool wanted(const std::string& function) const {
    return function.compare(0, only_.size(), only_) == 0;
  }

  void add(const std::string& function, const std::vector<std::string>& ranges, const Cells& cells,
           bool pair) {
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      std::ostringstream at;
      at << std::setprecision(17);
      if (cells[i].worst_ulp <= 0.0) {
        at << "-";
      } else if (pair) {
        at << "(" << cells[i].y << ", " << cells[i].x << ")";
      } else {
        at << std::setprecision(9) << cells[i].x;
      }
      Row row;
      row.function = function;
      row.range = ranges[i];
      row.worst_ulp = cells[i].worst_ulp;
      row.count = cells[i].count;
      row.at = at.str();
      rows_.push_back(row);
    }
  }

  uint32_t stride_;
  std::string only_;
  unsigned threads_;
  std::vector<Row> rows_;
};

double wrap_truth(double a) {
  return std::isfinite(a) ? std::atan2(std::sin(a), std::cos(a))
                          : std::numeric_limits<double>::quiet_NaN();
}

/// Two angles that differ by the width of the seam at pi are neighbours on the circle.
double wrap_truth_near(double a, float computed) {
  const double truth = wrap_truth(a);
  const double turn = 6.283185307179586232;
  if (static_cast<double>(computed) - truth > 3.2) return truth + turn;
  if (truth - static_cast<double>(computed) > 3.2) return truth - turn;
  return truth;
}

double float_atan2_error(double y, double x) {
  return float_error_ulp(math::atan2(static_cast<float>(y), static_cast<float>(x)),
                         std::atan2(y, x));
}

double double_atan2_error(double y, double x) {
  return double_error_ulp(math::atan2(y, x),
                          std::atan2(static_cast<long double>(y), static_cast<long double>(x)));
}

void any_floats(math::Random& random, double& y, double& x) {
  y = static_cast<double>(math::from_bits(random.next_u32()));
  x = static_cast<double>(math::from_bits(random.next_u32()));
}

void box_floats(math::Random& random, double& y, double& x) {
  y = static_cast<double>(2.0f * random.uniform<float>() - 1.0f);
  x = static_cast<double>(2.0f * random.uniform<float>() - 1.0f);
}

/// Ratios a few ulp from where something changes: 1, 0, powers of two (where the error of the
/// quotient weighs most), and quotients near the underflow.
void edge_floats(math::Random& random, double& y, double& x) {
  const uint32_t word = random.next_u32();
  const float large =
      math::from_bits((random.next_u32() & 0x007fffffu) | ((96u + (word >> 8) % 64u) << 23));
  const int power = static_cast<int>((word >> 16) % 160u) - ((word & 8u) != 0 ? 148 : 10);
  float small = std::ldexp(large, power < 4 ? power : 0);
  small = math::from_bits(math::to_bits(small) + (random.next_u32() % 65u) - 32u);
  if ((word & 1u) != 0) {
    y = static_cast<double>(small);
    x = static_cast<double>(large);
  } else {
    y = static_cast<double>(large);
    x = static_cast<double>(small);
  }
  if ((word & 2u) != 0) y = -y;
  if ((word & 4u) != 0) x = -x;
}

void box_doubles(math::Random& random, double& y, double& x) {
  y = 2.0 * random.uniform<double>() - 1.0;
  x = 2.0 * random.uniform<double>() - 1.0;
}

void wide_doubles(math::Random& random, double& y, double& x) {
  const int a = static_cast<int>(random.next_u32() % 2100u) - 1050;
  const int b = static_cast<int>(random.next_u32() % 121u) - 60;
  box_doubles(random, y, x);
  y = std::ldexp(y, a);
  x = std::ldexp(x, a + b);
}

/// Ratios a few ulp from the nodes i/32 of the table and from the borders of their intervals.
void edge_doubles(math::Random& random, double& y, double& x) {
  const uint32_t word = random.next_u32();
  x = 0.5 + random.uniform<double>();
  y = x * static_cast<double>(word % 129u) / 128.0;
  for (uint32_t i = (word >> 16) % 4u; i > 0; --i)
    y = std::nextafter(y, (word & 8u) != 0 ? 9.0 : -9.0);
  if ((word & 0x100u) != 0) std::swap(x, y);
  if ((word & 0x200u) != 0) y = -y;
  if ((word & 0x400u) != 0) x = -x;
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false;
  std::string only;
  unsigned threads = std::thread::hardware_concurrency();
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--quick") {
      quick = true;
    } else if (argument == "--only" && i + 1 < argc) {
      only = argv[++i];
    } else if (argument == "--threads" && i + 1 < argc) {
      threads = static_cast<unsigned>(std::atoi(argv[++i]));
    } else {
      std::cerr << "usage: math_accuracy [--quick] [--only FUNCTION] [--threads N]\n";
      return 2;
    }
  }
  if (threads == 0) threads = 1;

  Report report(quick, only, threads);
  const std::vector<std::string> angle_ranges = {"\\|x\\| <= pi/4", "\\|x\\| <= 96", "the rest"};
  const auto angle_range = [](float x) -> std::size_t {
    const float size = std::fabs(x);
    return size <= 0.785398186f ? 0 : size <= 96.0f ? 1 : 2;
  };
  report.unary(
      "sin", angle_ranges, [](float x) { return math::sin(x); },
      [](double x) { return std::sin(x); }, angle_range);
  report.unary(
      "cos", angle_ranges, [](float x) { return math::cos(x); },
      [](double x) { return std::cos(x); }, angle_range);
  report.unary(
      "exp", {"normal result", "subnormal result", "0, inf, NaN"},
      [](float x) { return math::exp(x); }, [](double x) { return std::exp(x); },
      [](float x) -> std::size_t {
        return x >= -87.3365478f && x <= 88.7228317f ? 0 : x >= -104.0f && x < 0.0f ? 1 : 2;
      });
  report.unary(
      "log", {"normal x", "subnormal x", "the rest"}, [](float x) { return math::log(x); },
      [](double x) { return std::log(x); },
      [](float x) -> std::size_t {
        return !(x > 0.0f) || std::isinf(x) ? 2 : x >= std::numeric_limits<float>::min() ? 0 : 1;
      });
  // The truth of wrap depends on the side of the seam, so the computed value is passed along.
  {
    const std::vector<std::string> ranges = {"\\|a\\| <= pi (unchanged)", "\\|a\\| <= 3 pi",
                                             "the rest"};
    report.unary(
        "wrap", ranges, [](float a) { return math::wrap(a); },
        [](double a) {
          const float x = static_cast<float>(a);
          if (x == -math::pi<float>()) return static_cast<double>(math::pi<float>());
          if (std::fabs(x) <= math::pi<float>()) return a;
          return wrap_truth_near(a, math::wrap(x));
        },
        [](float a) -> std::size_t {
          const float size = std::fabs(a);
          return size <= math::pi<float>() ? 0 : size <= 9.424777f ? 1 : 2;
        });
  }
  report.binary("atan2 (float)", "any two floats", 256, any_floats, float_atan2_error);
  report.binary("atan2 (float)", "[-1, 1)^2", 256, box_floats, float_atan2_error);
  report.binary("atan2 (float)", "edges", 256, edge_floats, float_atan2_error);
  report.binary("atan2 (double)", "[-1, 1)^2", 128, box_doubles, double_atan2_error);
  report.binary("atan2 (double)", "wide", 64, wide_doubles, double_atan2_error);
  report.binary("atan2 (double)", "edges", 64, edge_doubles, double_atan2_error);
  return report.print() ? 0 : 1;
}
