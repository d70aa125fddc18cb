// The same bits in the lanes of one instruction set as in scalar code: elementary functions, and
// whole filters. Compiled once per instruction set, with AUVEST_SIMD_ARCH naming it for xsimd.
#define DOCTEST_CONFIG_IMPLEMENT
#include "auvest/particles/simd_lanes.hpp"  // before the filters, which find its functions

#include <doctest/doctest.h>

#include <cstdio>
#include <cstring>
#include <vector>

#include "auvest/math/bits.hpp"
#include "auvest/math/counter_random.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/slat/slatf.hpp"
#include "auvest/vehicle/bluerov2_heavy.hpp"
#include "auvest/vehicle/integrate.hpp"
#include "auvest/vehicle/remus100.hpp"

namespace {

namespace math = auvest::math;
using math::Random;
using Arch = xsimd::AUVEST_SIMD_ARCH;
using Lanes = auvest::SimdLanes<Arch>;
using Value = Lanes::Value;

/// Numbers of all sizes and the special ones.
std::vector<float> arguments() {
  std::vector<float> x = {0.0f,  -0.0f, 1e-40f, -1e-40f, 3.14159274f, -3.14159274f, 9.424777f,
                          9.43f, 96.0f, 96.01f, -1e30f,  INFINITY,    -INFINITY,    NAN};
  Random random(1);
  for (int i = 0; i < 200000; ++i) {
    const uint32_t bits = random.next_u32();
    x.push_back(math::from_bits(bits));
    x.push_back(20.0f * random.uniform<float>() - 10.0f);
  }
  while (x.size() % 64 != 0) x.push_back(1.0f);
  return x;
}

bool same(float a, float b) { return math::to_bits(a) == math::to_bits(b); }

template <class Scalar, class Batch>
void check_function(const std::vector<float>& x, Scalar scalar, Batch batch) {
  std::size_t different = 0;
  for (std::size_t i = 0; i < x.size(); i += Lanes::kWidth) {
    float result[Lanes::kWidth];
    Lanes::store(result, batch(Lanes::load(x.data() + i)));
    for (std::size_t k = 0; k < Lanes::kWidth; ++k) {
      different += same(result[k], scalar(x[i + k])) ? 0 : 1;
    }
  }
  CHECK(different == 0);
}

TEST_CASE("elementary functions: the scalar bits in every lane") {
  const std::vector<float> x = arguments();
  check_function(
      x, [](float a) { return -a; }, [](Value a) { return -a; });
  for (const float other : {0.0f, -0.0f, 1.0f, NAN}) {
    check_function(
        x, [other](float a) { return math::larger(a, other); },
        [other](Value a) { return math::larger(a, Value(other)); });
    check_function(
        x, [other](float a) { return math::larger(other, a); },
        [other](Value a) { return math::larger(Value(other), a); });
  }
  check_function(
      x, [](float a) { return math::exp(a); }, [](Value a) { return math::exp(a); });
  check_function(
      x, [](float a) { return math::log(a); }, [](Value a) { return math::log(a); });
  check_function(
      x, [](float a) { return math::wrap(a); }, [](Value a) { return math::wrap(a); });
  for (const bool cosine : {false, true}) {
    check_function(
        x,
        [cosine](float a) {
          float s, c;
          math::sincos(a, s, c);
          return cosine ? c : s;
        },
        [cosine](Value a) {
          Value s, c;
          math::sincos(a, s, c);
          return cosine ? c : s;
        });
  }
  for (const float y : {0.0f, -0.0f, 1.0f, -2.5f, 1e-38f, -1e38f, INFINITY}) {
    check_function(
        x, [y](float a) { return math::atan2(y, a); },
        [y](Value a) { return math::atan2(Value(y), a); });
    check_function(
        x, [y](float a) { return math::atan2(a, y); },
        [y](Value a) { return math::atan2(a, Value(y)); });
  }
  // Mostly ordinary lanes, so that the common path is met: pairs of neighbours.
  std::vector<float> near;
  for (std::size_t i = 15; i < x.size(); i += 2) near.push_back(x[i]);
  while (near.size() % 64 != 0) near.push_back(1.0f);
  check_function(
      near, [](float a) { return math::wrap(a); }, [](Value a) { return math::wrap(a); });
  check_function(
      near, [](float a) { return math::exp(a); }, [](Value a) { return math::exp(a); });
  check_function(
      near, [](float a) { return math::atan2(a, 2.0f - a); },
      [](Value a) { return math::atan2(a, Value(Value(2.0f) - a)); });
  check_function(
      near, [](float a) { return math::log(a * a); },
      [](Value a) { return math::log(Value(a * a)); });
}

/// An update of three states of which two are seen: x, P, innovation and noise in, the belief, the
/// NIS and whether it is valid out. Where it is not the belief stays.
template <class V>
void update(V (&n)[14]) {
  using math::select;
  auvest::Belief<V, 3> belief;
  auvest::Matrix<V, 2, 2> root, a, noise;
  auvest::Matrix<V, 1, 2> slope;
  auvest::Posterior<V, 2> posterior;
  int at = 0;
  for (int i = 0; i < 3; ++i) {
    belief.x(i) = n[at++];
    for (int j = 0; j <= i; ++j) belief.P(i, j) = n[at++];
  }
  auvest::Vector<V, 2> innovation;
  for (int i = 0; i < 2; ++i) {
    innovation(i) = n[at++];
    for (int j = 0; j <= i; ++j) noise(i, j) = n[at++];
  }
  const auvest::Belief<V, 3> before = belief;
  math::Mask<V> valid = math::factor_leading(belief.P, root, slope);
  a = root;
  const math::Mask<V> definite = math::ldlt(noise);
  const math::Mask<V> finite = auvest::potter(a, noise, innovation, posterior);
  valid = valid && definite && finite;
  valid = valid && auvest::move_belief(belief, root, slope, posterior);
  math::copy_where(!valid, before, belief);
  at = 0;
  for (int i = 0; i < 3; ++i) {
    n[at++] = belief.x(i);
    for (int j = 0; j <= i; ++j) n[at++] = belief.P(i, j);
  }
  n[at++] = select(valid, posterior.nis, V(0.0f));
  n[at++] = select(valid, V(1.0f), V(0.0f));
}

TEST_CASE("the measurement update: each lane is updated, or refused, as the scalar code does") {
  constexpr int kWidth = Lanes::kWidth;
  Random random(4);
  int refused = 0;
  int different = 0;
  for (int group = 0; group < 2000; ++group) {
    float alone[kWidth][14];
    Value together[14];
    float column[14][kWidth];
    for (int k = 0; k < kWidth; ++k) {
      float(&n)[14] = alone[k];
      for (float& number : n) number = random.normal<float>();
      for (const int variance : {1, 4, 8, 10, 13}) n[variance] += 4.0f;
      const uint32_t kind = random.next_u32() % 40u;
      if (kind == 0) n[4] = 0.0f;    // a variance of zero
      if (kind == 1) n[12] = 1e3f;   // indefinite noise
      if (kind == 2) n[10] = NAN;    // noise that is no number
      if (kind == 3) n[11] = 1e25f;  // the NIS overflows
      if (kind == 4) {               // the state does
        n[0] = 3e38f;
        n[1] = n[9] = 1e38f;
      }
      for (int i = 0; i < 14; ++i) column[i][k] = n[i];
    }
    for (int i = 0; i < 14; ++i) together[i] = Lanes::load(column[i]);
    update(together);
    for (int i = 0; i < 14; ++i) Lanes::store(column[i], together[i]);
    for (int k = 0; k < kWidth; ++k) {
      update(alone[k]);
      refused += alone[k][10] > 0.0f ? 0 : 1;
      for (int i = 0; i < 11; ++i) different += same(alone[k][i], column[i][k]) ? 0 : 1;
    }
  }
  CHECK(different == 0);
  CHECK(refused > 50 * kWidth);
  CHECK(refused < 1000 * kWidth);
}

TEST_CASE("random numbers: each lane draws what its particle draws alone") {
  Random random(2);
  const math::CounterKey key(random);
  for (int first = 0; first < 64; first += Lanes::kWidth) {
    Value a, b;
    math::counter_normal_pair(key, Lanes::index(first), 3u, a, b);
    float found[2][Lanes::kWidth];
    Lanes::store(found[0], a);
    Lanes::store(found[1], b);
    for (int k = 0; k < Lanes::kWidth; ++k) {
      float c, d;
      math::counter_normal_pair(key, static_cast<uint32_t>(first + k), 3u, c, d);
      CHECK(same(found[0][k], c));
      CHECK(same(found[1][k], d));
    }
  }
}

/// Runs of a hull from different states, with different commands and currents, one per lane; `size`
/// is that of each command.
template <class Hull, class Method>
void check_hull(const Hull& hull, const std::vector<float>& size) {
  constexpr std::size_t n = Hull::kStates;
  constexpr std::size_t m = Hull::kActuators;
  constexpr std::size_t width = Lanes::kWidth;
  Random random(3);
  const auto lanes = [&](Value* batch, std::size_t count, float* single, float scale) {
    for (std::size_t i = 0; i < count; ++i) {
      float numbers[width];
      for (std::size_t lane = 0; lane < width; ++lane) {
        numbers[lane] = scale * (2.0f * random.uniform<float>() - 1.0f);
        single[lane * count + i] = numbers[lane];
      }
      batch[i] = Lanes::load(numbers);
    }
  };
  auvest::Vector<Value, Hull::kStates> x;
  auvest::Vector<Value, Hull::kActuators> command;
  auvest::Vector<Value, 3> current;
  float states[width * n], commands[width * m], currents[width * 3];
  lanes(x.data(), n, states, 0.3f);
  lanes(command.data(), m, commands, 1.0f);
  lanes(current.data(), 3, currents, 0.5f);
  for (std::size_t i = 0; i < m; ++i) {
    const int row = static_cast<int>(i);
    command(row) = command(row) * Value(size[i]);
    for (std::size_t lane = 0; lane < width; ++lane) commands[lane * m + i] *= size[i];
  }
  for (int k = 0; k < 200; ++k) Method::step(hull, x, command, current, 0.05f);
  std::size_t different = 0;
  for (std::size_t lane = 0; lane < width; ++lane) {
    typename Hull::State alone;
    typename Hull::Command c;
    typename Hull::Current v;
    std::memcpy(alone.data(), states + lane * n, sizeof alone);
    std::memcpy(c.data(), commands + lane * m, sizeof c);
    std::memcpy(v.data(), currents + lane * 3, sizeof v);
    for (int k = 0; k < 200; ++k) Method::step(hull, alone, c, v, 0.05f);
    for (std::size_t i = 0; i < n; ++i) {
      float numbers[width];
      Lanes::store(numbers, x(static_cast<int>(i)));
      different += same(numbers[lane], alone(static_cast<int>(i))) ? 0 : 1;
    }
  }
  CHECK(different == 0);
}

TEST_CASE("hulls: every bit of 200 steps") {
  using auvest::Hull;
  using Keel = auvest::Keel<float>;
  using Yacht = auvest::Torpedo<float, Keel>;
  auto p = auvest::remus100<float, Keel>();
  p.keel.foil.area_m2 = 0.02f;
  p.rudder.servo.dead_band = 0.05f;
  p.rudder.servo.rate_limit = 0.3f;
  const std::vector<float> fins = {0.3f, 0.1f, 25.0f};
  check_hull<Hull<Yacht>, auvest::Rk4>(Hull<Yacht>(p), fins);
  check_hull<Hull<Yacht>, auvest::SemiImplicit>(Hull<Yacht>(p), fins);
  check_hull<Hull<Yacht, auvest::FourDof>, auvest::Rk4>(Hull<Yacht, auvest::FourDof>(p), fins);
  check_hull<Hull<Yacht, auvest::ThreeDof>, auvest::Rk4>(Hull<Yacht, auvest::ThreeDof>(p), fins);
  using Rov = auvest::Rov<float, 8>;
  const std::vector<float> inputs(8, 0.3f);
  check_hull<Hull<Rov>, auvest::Rk4>(Hull<Rov>(auvest::bluerov2_heavy<float>()), inputs);
}

template <class Motion, class Proposal, class L>
struct Run {
  using Filter = auvest::Slatf<Motion, auvest::PiecewiseAcceleration<float>, Proposal, 2,
                               auvest::SystematicResampling, L>;
  std::vector<float> numbers;  ///< everything that is readable, after every step

  Run(int particles, auvest::Bearing bearing) {
    std::vector<float> storage(Filter::Set::storage_size(particles));
    auvest::SlatfParams<float> params;
    params.gate = 16;
    Filter filter(Motion(), auvest::PiecewiseAcceleration<float>(), params, storage.data(),
                  particles);
    Random random(3);
    Random noise(4);
    typename Filter::SlaveBelief start;
    math::set_zero(start.x);
    math::set_zero(start.P);
    for (int i = 0; i < Filter::kPose; ++i) start.P(i, i) = 0.01f;
    REQUIRE(filter.reset(start, random) == auvest::Status::kOk);
    for (int n = 0; n < 2; ++n) {
      typename Filter::MasterBelief master;
      math::set_zero(master.x);
      math::set_zero(master.P);
      master.x(0) = 50.0f * static_cast<float>(n);
      master.x(1) = 100;
      master.x(2) = 2;
      for (int i = 0; i < 6; ++i) master.P(i, i) = i < 2 ? 4.0f : 0.01f;
      REQUIRE(filter.add_master(master) == auvest::Status::kOk);
    }
    typename auvest::Sonar<float>::Params sonar;
    sonar.bearing = bearing;
    const auvest::Vector<float, 2> changes[2] = {auvest::Vector<float, 2>(0.1f, -0.1f),
                                                 auvest::Vector<float, 2>(0, 0.2f)};
    for (int k = 0; k < 60; ++k) {
      const auvest::Vector<float, 2> u(2.0f,
                                       Filter::kPose > 2 ? 0.05f : 0.05f * static_cast<float>(k));
      REQUIRE(filter.predict(1, u, random, k % 2 == 0 ? changes : nullptr) == auvest::Status::kOk);
      auvest::Echo<float> seen[2];
      for (int n = 0; n < 2; ++n) {
        seen[n].master = n;
        const auto master = filter.master(n).x;
        const auto slave = filter.slave().x;
        const float dx = master(0) - slave(0);
        const float dy = master(1) - slave(1);
        float a, b;
        noise.normal_pair(a, b);
        // Now and then an outlier.
        const float scale = k % 17 == 16 ? 100.0f : 1.0f;
        seen[n].z(0) = math::absolute(math::sqrt(dx * dx + dy * dy) + scale * a);
        seen[n].z(1) = math::atan2(dy, dx) + scale * 0.06f * b;
        if (bearing == auvest::Bearing::kFromHeading) seen[n].z(1) -= slave(Filter::kPose - 1);
      }
      REQUIRE(filter.update(seen, k % 3, auvest::Sonar<float>(sonar), random) ==
              auvest::Status::kOk);
      const auto positions = filter.positions();
      for (int d = 0; d < 2; ++d) {
        numbers.push_back(positions.slave(d));
        for (const auto& master : positions.masters) numbers.push_back(master(d));
      }
      note(filter.slave());
      note(filter.master(0));
      numbers.push_back(filter.effective_size());
      numbers.push_back(filter.log_likelihood());
      numbers.push_back(static_cast<float>(filter.resamplings()));
    }
    for (int i = 0; i < particles; ++i) {
      numbers.push_back(filter.set().log_weights()[i]);
      for (int f = 0; f < Filter::Set::kFields; ++f) numbers.push_back(*filter.set().at(i, f));
    }
    if (particles > 1) CHECK(filter.resamplings() > 2);
  }

  template <int N>
  void note(const auvest::Belief<float, N>& belief) {
    for (int i = 0; i < N; ++i) {
      numbers.push_back(belief.x(i));
      for (int j = 0; j < N; ++j) numbers.push_back(belief.P(i, j));
    }
  }
};

template <class Motion, class Proposal>
void check_filter(auvest::Bearing bearing) {
  for (const int particles : {1, 16, 37, 100}) {
    CAPTURE(particles);
    const Run<Motion, Proposal, Lanes> batch(particles, bearing);
    const Run<Motion, Proposal, auvest::OneLane<float>> scalar(particles, bearing);
    REQUIRE(batch.numbers.size() == scalar.numbers.size());
    CHECK(std::memcmp(batch.numbers.data(), scalar.numbers.data(),
                      batch.numbers.size() * sizeof(float)) == 0);
  }
}

TEST_CASE("SLATF 1.0 and 2.0: every bit of 60 steps") {
  using Compass = auvest::CompassMotion<float>;
  using Unicycle = auvest::UnicycleMotion<float>;
  check_filter<Compass, auvest::MotionProposal>(auvest::Bearing::kSlaveToMaster);
  check_filter<Compass, auvest::MeasurementProposal>(auvest::Bearing::kSlaveToMaster);
  check_filter<Unicycle, auvest::MotionProposal>(auvest::Bearing::kFromHeading);
  check_filter<Unicycle, auvest::MeasurementProposal>(auvest::Bearing::kFromHeading);
}

}  // namespace

int main(int argc, char** argv) {
  if (xsimd::available_architectures().AUVEST_SIMD_ARCH == 0) {
    std::puts("this processor has no " AUVEST_SIMD_NAME);
    return 77;  // CTest: skipped
  }
  return doctest::Context(argc, argv).run();
}
