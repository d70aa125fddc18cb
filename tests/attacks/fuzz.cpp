// libFuzzer drives the filters with bytes: every process, sensor and kind of the registry with any
// kernel, recovery, policy and memory, and the filters of slat/. Beside what the sanitizers see:
//
//   - a call that is refused leaves the filter as it was;
//   - after one that is not, all numbers are finite and P is a covariance;
//   - what it saves it restores, and goes on with the same bits as the one that was saved; but for
//     covariances below the format, which rounding may have lost.
//
// `make fuzz SECONDS=15` runs it, PRECISION=double in double precision. From the environment:
//
//   AUVEST_FUZZ_FAMILY   gaussian or slat: the others are left out
//   AUVEST_FUZZ_TRACE    anything: says the calls, for a case that libFuzzer has kept
//
// AUVEST_FUZZ_SCALAR is float or double.

// Calls, where the library forces inlining: half of the time to compile.
#include "auvest/config.hpp"
#undef AUVEST_INLINE
#define AUVEST_INLINE inline

#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/dead_reckoning.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "auvest/slat/outage.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/slat/slatf_joint.hpp"
#include "bindings/slat_state.hpp"
#include "desk/states.hpp"

namespace {

using namespace auvest;
using Scalar = AUVEST_FUZZ_SCALAR;

const double kEpsilon = double(std::numeric_limits<Scalar>::epsilon());
const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

// ---- What is said.

void say(const char* format, ...) {
  static const bool wanted = std::getenv("AUVEST_FUZZ_TRACE") != nullptr;
  if (!wanted) return;
  std::va_list arguments;
  va_start(arguments, format);
  std::vfprintf(stderr, format, arguments);
  va_end(arguments);
  std::fputc('\n', stderr);
}

[[noreturn]] void broken(const char* promise, const std::string& who) {
  std::fprintf(stderr, "BROKEN: %s: %s\n", who.c_str(), promise);
  std::abort();
}

// ---- Numbers from bytes.

/// Behind the input go bytes that follow from it: a short one is a whole attack too.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : at_(data), left_(size) {
    for (std::size_t i = 0; i < size; ++i) more_ = (more_ ^ data[i]) * 1099511628211ull;
  }

  std::uint8_t byte() {
    if (left_ == 0) {
      more_ = more_ * 6364136223846793005ull + 1442695040888963407ull;
      return std::uint8_t(more_ >> 56);
    }
    --left_;
    return *at_++;
  }
  int below(int n) { return byte() % n; }

  /// From -scale to scale, or something odd where this is asked for.
  Scalar number(double scale) {
    static const double odd[] = {kNan, kInfinity, -kInfinity, 1e-45, 1e-38, 1e-30,  0.0,  -0.0,
                                 1e9,  -1e20,     1e30,       3e38,  1e-6,  1000.0, 16.0, 1.0};
    if (odd_ && byte() % 8 == 0) return Scalar(odd[byte() % 16]);
    const int high = byte();
    return Scalar(scale * ((high << 8 | byte()) - 32768) / 32768.0);
  }
  Scalar positive(double scale) {
    const Scalar value = number(scale);
    return value < Scalar(0) ? -value : value;
  }
  /// Most are near 1 s; some are hours.
  Scalar step() { return positive(byte() % 16 == 0 ? 4000.0 : 2.0); }
  void allow_odd(bool odd) { odd_ = odd; }

  template <int N>
  Matrix<Scalar, N, 1> vector(double scale) {
    Matrix<Scalar, N, 1> x;
    for (int i = 0; i < N; ++i) x(i) = number(scale);
    return x;
  }
  /// L L' with a positive diagonal.
  template <int N>
  Matrix<Scalar, N, N> covariance(double scale) {
    std::vector<Scalar> numbers = spread(N, scale);
    Matrix<Scalar, N, N> p;
    for (int i = 0; i < N * N; ++i) p.data()[i] = numbers[std::size_t(i)];
    return p;
  }
  /// The position's deviations are of the size of `scale`; those of other states are smaller.
  std::vector<Scalar> spread(int n, double scale) {
    const std::size_t size = std::size_t(n);
    std::vector<double> root(size * size, 0.0);
    for (std::size_t i = 0; i < size; ++i) {
      const double own = i < 2 ? scale : 0.03 * scale;
      for (std::size_t j = 0; j < i; ++j) root[i * size + j] = 0.3 * double(number(own));
      root[i * size + i] = double(positive(own)) + 0.01 * own;
    }
    std::vector<Scalar> p(size * size);
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < size; ++k) sum += root[i * size + k] * root[j * size + k];
        p[i * size + j] = Scalar(sum);
      }
    }
    return p;
  }

 private:
  const std::uint8_t* at_;
  std::size_t left_;
  std::uint64_t more_ = 14695981039346656037ull;
  bool odd_ = false;
};

// ---- What must hold of a belief.

/// Whether correlations with `slack` on the diagonal are positive definite: that is how negative an
/// eigenvalue may be by rounding. A variance of 0 has no correlations.
bool is_covariance(const std::vector<Scalar>& p, int n, double slack, bool singular) {
  const std::size_t size = std::size_t(n);
  std::vector<double> c(size * size);
  for (std::size_t i = 0; i < size; ++i) {
    const double variance = double(p[i * size + i]);
    if (!(singular ? variance >= 0 : variance > 0)) return false;
  }
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = 0; j < size; ++j) {
      const double scale = std::sqrt(double(p[i * size + i])) * std::sqrt(double(p[j * size + j]));
      c[i * size + j] = i == j ? 1 + slack : scale > 0 ? double(p[i * size + j]) / scale : 0;
    }
  }
  for (std::size_t k = 0; k < size; ++k) {  // Cholesky, in place
    for (std::size_t j = 0; j < k; ++j) c[k * size + k] -= c[k * size + j] * c[k * size + j];
    if (!(c[k * size + k] > 0)) return false;
    c[k * size + k] = std::sqrt(c[k * size + k]);
    for (std::size_t i = k + 1; i < size; ++i) {
      for (std::size_t j = 0; j < k; ++j) c[i * size + k] -= c[i * size + j] * c[k * size + j];
      c[i * size + k] /= c[k * size + k];
    }
  }
  return true;
}

/// Whether all variances are so small that their last digits are subnormal: a saved covariance may
/// be lost in rounding then.
bool is_below_format(const std::vector<Scalar>& p, int n) {
  const Scalar least = (std::numeric_limits<Scalar>::min)() / (4 * Scalar(kEpsilon));
  bool below = true;
  for (int i = 0; i < n; ++i) below = below && p[std::size_t(i * n + i)] < least;
  return below;
}

[[noreturn]] void no_belief(const char* why, const std::vector<Scalar>& p, const std::string& who) {
  for (std::size_t i = 0; i < p.size(); ++i) say("P[%zu] = %.9g", i, double(p[i]));
  broken(why, who);
}

void require_belief(const std::vector<Scalar>& x, const std::vector<Scalar>& p, double slack,
                    bool singular, const std::string& who) {
  bool finite = true;
  for (Scalar value : x) finite = finite && std::isfinite(value);
  for (Scalar value : p) finite = finite && std::isfinite(value);
  if (!finite) {
    no_belief("x or P is not finite after ok", p, who);
  } else if (!is_covariance(p, int(x.size()), slack, singular)) {
    no_belief("P is indefinite after ok", p, who);
  }
}

// ---- The Gaussian filters, as Python puts them together.

using Filter = desk::AnyFilter<Scalar>;

const desk::Catalogue<Scalar>& catalogue() {
  static const desk::Catalogue<Scalar> all = [] {
    desk::Catalogue<Scalar> made;
    desk::add_models<2>(made);
    desk::add_models<3>(made);
    desk::add_models<4>(made);
    desk::add_models<6>(made);
    return made;
  }();
  return all;
}

std::vector<Scalar> changed(const desk::Parameters& parameters, Bytes& bytes) {
  std::vector<Scalar> values;
  for (double usual : parameters.defaults) {
    values.push_back(Scalar(usual));
    if (bytes.below(4) == 0) values.back() = bytes.number(usual == 0 ? 1.0 : 3 * usual);
  }
  return values;
}

/// A model with some parameters changed; null where they are refused.
template <class Entry>
auto made(const Entry& entry, Bytes& bytes) {
  const std::vector<Scalar> values = changed(entry.parameters, bytes);
  Status why;
  return entry.make(values.data(), why);
}

AnyKernel<Scalar> kernel(Bytes& bytes) {
  AnyKernel<Scalar> made;
  made.kind = typename AnyKernel<Scalar>::Kind(bytes.below(4));
  return made;
}

AnyInterval<Scalar> policy(Bytes& bytes) {
  AnyInterval<Scalar> made;
  made.kind = typename AnyInterval<Scalar>::Kind(bytes.below(3));
  if (bytes.below(2)) made.fixed.params.interval_s = bytes.positive(3);
  if (bytes.below(2)) made.budget.params.position_sigma_m = bytes.positive(5);
  if (bytes.below(2)) made.mahalanobis.params.gamma1_m2 = bytes.positive(5);
  if (bytes.below(2)) made.mahalanobis.params.epsilon = bytes.positive(2);
  return made;
}

bool same(const std::vector<Scalar>& a, const std::vector<Scalar>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Scalar)) == 0);
}
bool same(const desk::FilterState<Scalar>& a, const desk::FilterState<Scalar>& b) {
  return same(a.x, b.x) && same(a.P, b.P) && same(a.input, b.input) && same(a.policy, b.policy) &&
         same(a.recovery, b.recovery) && same(a.base, b.base) && same(a.events, b.events) &&
         same(a.mixture, b.mixture) && a.sensors == b.sensors;
}

/// A filter and what it is made of.
class Gaussian {
 public:
  static void attack(Bytes& bytes) {
    Gaussian one(bytes);
    if (one.filter_ == nullptr || !one.start()) return;
    for (int calls = bytes.below(60); calls > 0; --calls) one.call();
  }

 private:
  explicit Gaussian(Bytes& bytes) : bytes_(bytes) {
    auto entry = catalogue().processes.begin();
    std::advance(entry, bytes.below(int(catalogue().processes.size())));
    process_ = made(entry->second, bytes);
    if (process_ == nullptr) return;
    for (const auto& sensor : catalogue().sensors) {
      if (sensor.first.second != process_->states) continue;
      auto model = made(sensor.second, bytes);
      if (model != nullptr) sensors_.push_back(std::move(model));
    }
    using Options = desk::FilterOptions<Scalar>;
    options_.kind = typename Options::Linearisation::Kind(bytes.below(3));
    static const double alphas[] = {1e-6, 1e-3, 0.5, 1.0};
    options_.points.alpha = Scalar(alphas[bytes.below(4)]);
    AnyRecovery<Scalar> recovery;
    recovery.enabled = bytes.below(2) == 1;
    typename Options::Rule::Params rule;
    if (bytes.below(2)) rule.residual = Residual::kPostFit;
    options_.rule = typename Options::Rule(kernel(bytes), recovery, rule);
    options_.policy = policy(bytes);
    if (process_->states > 1 && bytes.below(4) == 0) options_.components = 8;
    options_.late_s = bytes.below(3) == 0 ? bytes.positive(5) : Scalar(0);
    if (!(options_.late_s >= Scalar(0)) || !std::isfinite(options_.late_s)) return;
    if (options_.rule.check() != Status::kOk) return;
    static const char* const kinds[] = {"EKF", "UKF", "CKF"};
    name_ = kinds[int(options_.kind)] + std::string(" of ") + entry->first;
    filter_ = make();
    say("%s, late %g, policy %d, components %d", name_.c_str(), double(options_.late_s),
        int(options_.policy.kind), options_.components);
  }

  std::unique_ptr<Filter> make() const {
    return catalogue().filters.at(process_->states)(process_, options_);
  }

  bool start() {
    const int n = process_->states;
    std::vector<Scalar> x;
    for (int i = 0; i < n; ++i) x.push_back(bytes_.number(i < 2 ? 100 : 3));
    static const double scales[] = {0.1, 1.0, 10.0, 1000.0};
    const std::vector<Scalar> p = bytes_.spread(n, scales[bytes_.below(4)]);
    for (Scalar value : x) say("x0 %.9g", double(value));
    for (Scalar value : p) say("P0 %.9g", double(value));
    const Scalar reference[] = {x[0], x[1]};
    return filter_->reset(x.data(), p.data(), reference) == Status::kOk;
  }

  void call() {
    const auto before = filter_->save();
    Status status;
    const int what = bytes_.below(8);
    if (what == 7) {
      twin_ = make();
      say("restore");
      if (twin_->restore(before) != Status::kOk) {
        if (!is_below_format(before.P, process_->states)) {
          no_belief("a saved state is refused", before.P, name_);
        }
        twin_.reset();
      }
      return;
    }
    if (what <= 2) {
      const Scalar dt = bytes_.step();
      Scalar input[desk::kMaxInputs];
      for (Scalar& value : input) value = bytes_.number(2);
      status = filter_->predict(dt, input);
      if (twin_) twin_->predict(dt, input);
      say("predict(%.9g; %.9g, %.9g, %.9g): %d", double(dt), double(input[0]), double(input[1]),
          double(input[2]), int(status));
    } else if (what <= 5 && !sensors_.empty()) {
      const std::size_t which = std::size_t(bytes_.below(int(sensors_.size())));
      const auto& sensor = sensors_[which];
      Scalar z[desk::kMaxSize], place[desk::kMaxPlace];
      for (Scalar& value : z) value = bytes_.number(100);
      for (Scalar& value : place) value = bytes_.number(100);
      const Scalar* there = sensor->place > 0 && bytes_.below(2) ? place : nullptr;
      const Scalar age = options_.late_s > Scalar(0) ? bytes_.positive(4) : Scalar(0);
      status = filter_->update(z, sensor, there, age).status;
      if (twin_) twin_->update(z, sensor, there, age);
      say("update(%.9g, %.9g; sensor %zu, place %.9g, %.9g, age %.9g): %d", double(z[0]),
          double(z[1]), which, there ? double(place[0]) : kNan, there ? double(place[1]) : kNan,
          double(age), int(status));
    } else {
      const Scalar reference[] = {bytes_.number(100), bytes_.number(100)};
      status = filter_->feedback(reference);
      if (twin_) twin_->feedback(reference);
      say("feedback(%.9g, %.9g): %d", double(reference[0]), double(reference[1]), int(status));
    }
    const auto after = filter_->save();
    if (twin_ && !same(after, twin_->save())) broken("restored, it goes on with other bits", name_);
    if (status != Status::kOk) {
      if (!same(before, after)) broken("changed by a refusal", name_);
      return;
    }
    // The correlations are rounded a few times per step, each by up to n / 2 units.
    require_belief(after.x, after.P, 8 * process_->states * kEpsilon, false, name_);
    if (!(filter_->interval() > Scalar(0)) || !std::isfinite(filter_->interval())) {
      broken("the interval is none", name_);
    }
  }

  Bytes& bytes_;
  std::shared_ptr<const desk::AnyProcess<Scalar>> process_;
  std::vector<std::shared_ptr<const desk::AnySensor<Scalar>>> sensors_;
  desk::FilterOptions<Scalar> options_;
  std::string name_;
  std::unique_ptr<Filter> filter_, twin_;
};

// ---- The filters of slat/.

const int kMasters = 2;
const int kParticles = 12;

template <class Filter>
struct Owned {
  std::vector<Scalar> storage;
  Filter filter;

  template <class Make>
  Owned(std::size_t size, const Make& make) : storage(size), filter(make(storage.data())) {}
};

struct SlatNumbers {
  std::vector<Scalar> numbers;
  std::vector<std::int64_t> counts;

  bool operator==(const SlatNumbers& other) const {
    return same(numbers, other.numbers) && counts == other.counts;
  }
};

template <class Filter>
SlatNumbers saved(const Filter& filter) {
  bindings::SlatState<Scalar> state = {};
  StateKeeper<Scalar> counter(state);
  Filter::visit_state(filter, counter);
  SlatNumbers result;
  result.numbers.resize(state.number_count);
  result.counts.resize(state.count_count);
  state.numbers = result.numbers.data();
  state.counts = result.counts.data();
  StateKeeper<Scalar> keeper(state);
  Filter::visit_state(filter, keeper);
  return result;
}

template <class Filter>
bool restore(Filter& filter, const SlatNumbers& state) {
  StateReturner<Scalar> returner(
      {state.numbers.data(), state.numbers.size(), state.counts.data(), state.counts.size()});
  Filter::visit_state(filter, returner);
  return returner.complete();
}

template <int N>
void require_belief(const Belief<Scalar, N>& belief, double slack, const std::string& who) {
  const std::vector<Scalar> x(belief.x.data(), belief.x.data() + N);
  const std::vector<Scalar> p(belief.P.data(), belief.P.data() + N * N);
  require_belief(x, p, slack, true, who);
}

template <class Filter, class Make>
void attack_slat(Bytes& bytes, const char* name, std::size_t storage, double slack,
                 const Make& make) {
  using Twin = Owned<Filter>;
  Twin owned(storage, make);
  std::unique_ptr<Twin> twin;
  Filter& filter = owned.filter;
  math::Random random(bytes.byte()), twin_random(0);
  typename Filter::SlaveBelief pose;
  pose.x = bytes.vector<Filter::kPose>(50);
  pose.P = bytes.covariance<Filter::kPose>(3);
  say("%s", name);
  if (filter.reset(pose, random) != Status::kOk) return;
  for (int calls = bytes.below(60); calls > 0; --calls) {
    const SlatNumbers before = saved(filter);
    Status status;
    const int what = bytes.below(9);
    if (what == 8) {
      twin.reset(new Twin(storage, make));
      say("restore");
      if (!restore(twin->filter, before)) {
        for (std::size_t i = 0; i < before.numbers.size(); ++i) {
          say("state[%zu] = %.9g", i, double(before.numbers[i]));
        }
        broken("a saved state is refused", name);
      }
      twin_random = random;
      continue;
    }
    if (what == 7) {
      typename Filter::MasterBelief master;
      master.x = bytes.vector<6>(50);
      master.P = bytes.covariance<6>(2);
      status = filter.add_master(master);
      if (twin) twin->filter.add_master(master);
      say("add_master: %d", int(status));
    } else if (what <= 3) {
      const Scalar dt = bytes.step();
      const typename Filter::Control u = bytes.vector<2>(3);
      status = filter.predict(dt, u, random);
      if (twin) twin->filter.predict(dt, u, twin_random);
      say("predict(%.9g; %.9g, %.9g): %d", double(dt), double(u(0)), double(u(1)), int(status));
    } else {
      typename Sonar<Scalar>::Params params;
      params.sigma_range_m = bytes.positive(3);
      params.sigma_bearing_rad = bytes.positive(0.3);
      params.bearing = Bearing(bytes.below(3));
      const Sonar<Scalar> sonar(params);
      Echo<Scalar> echoes[kMasters];
      const int count = bytes.below(kMasters + 1);
      for (int s = 0; s < count; ++s) {
        echoes[s].z(0) = bytes.positive(100);
        echoes[s].z(1) = bytes.number(4);
        echoes[s].master = bytes.below(kMasters + 2) - 1;
        say("echo(%.9g, %.9g) of %d", double(echoes[s].z(0)), double(echoes[s].z(1)),
            echoes[s].master);
      }
      status = filter.update(echoes, count, sonar, random);
      if (twin) twin->filter.update(echoes, count, sonar, twin_random);
      say("update(sigma %.9g, %.9g): %d", double(params.sigma_range_m),
          double(params.sigma_bearing_rad), int(status));
    }
    if (twin && !(saved(filter) == saved(twin->filter))) {
      broken("restored, it goes on with other bits", name);
    }
    if (status != Status::kOk) {
      if (!(before == saved(filter))) broken("changed by a refusal", name);
      continue;
    }
    require_belief(filter.slave(), slack, name);
    if constexpr (Filter::kMasters > 0) {
      for (int n = 0; n < filter.masters(); ++n) {
        require_belief(filter.master(n), slack, std::string(name) + ", a master");
      }
    }
  }
}

void attack_slat(Bytes& bytes) {
  using Compass = CompassMotion<Scalar>;
  using Unicycle = UnicycleMotion<Scalar>;
  using Master = PiecewiseAcceleration<Scalar>;
  // A summary of particles is a difference of sums; slave and masters are rounded in each step as
  // one, which may start singular.
  const double slack = 1000 * kEpsilon;
  SlatfParams<Scalar> params;
  params.gate = Scalar(bytes.below(2) ? 16 : 0);
  params.birth_velocity_m_s = Scalar(params.gate > Scalar(0) && bytes.below(2) ? 1 : 0);
  switch (bytes.below(6)) {
    case 0: {
      using F = EkfSlat<Compass, Master, kMasters>;
      return attack_slat<F>(bytes, "EkfSlat, compass", 0, slack,
                            [](Scalar*) { return F(Compass(), Master()); });
    }
    case 1: {
      using F = EkfSlat<Unicycle, Master, kMasters>;
      return attack_slat<F>(bytes, "EkfSlat, unicycle", 0, slack,
                            [](Scalar*) { return F(Unicycle(), Master()); });
    }
    case 2: {
      using F = Slatf<Compass, Master, MotionProposal, kMasters>;
      return attack_slat<F>(
          bytes, "Slatf 1.0", F::Set::storage_size(kParticles), slack,
          [&](Scalar* s) { return F(Compass(), Master(), params, s, kParticles); });
    }
    case 3: {
      using F = Slatf<Unicycle, Master, MeasurementProposal, kMasters>;
      return attack_slat<F>(
          bytes, "Slatf 2.0", F::Set::storage_size(kParticles), slack,
          [&](Scalar* s) { return F(Unicycle(), Master(), params, s, kParticles); });
    }
    case 4: {
      using F = SlatfJoint<Compass, Master, kMasters>;
      return attack_slat<F>(
          bytes, "SlatfJoint", F::Set::storage_size(kParticles), slack,
          [&](Scalar* s) { return F(Compass(), Master(), typename F::Params(), s, kParticles); });
    }
    default: {
      using F = DeadReckoning<Unicycle>;
      return attack_slat<F>(bytes, "DeadReckoning", 0, slack,
                            [](Scalar*) { return F(Unicycle()); });
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  static const char* const family = std::getenv("AUVEST_FUZZ_FAMILY");
  const int what = bytes.byte();
  bytes.allow_odd(what & 1);
  if (family != nullptr ? *family == 's' : (what & 6) == 0) {
    attack_slat(bytes);
  } else {
    Gaussian::attack(bytes);
  }
  return 0;
}
