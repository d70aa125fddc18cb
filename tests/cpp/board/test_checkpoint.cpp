// CheckpointRing, Checkpoints and predict_within: cut after every byte of a write, with arbitrary
// values of the byte under way, filters go on with the same bits, and an unknown time is covered.

#include <doctest/doctest.h>

#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "auvest/board/array_store.hpp"
#include "auvest/board/checkpoint.hpp"
#include "auvest/board/file_store.hpp"
#include "auvest/filters/aukf.hpp"
#include "auvest/filters/predict_within.hpp"
#include "auvest/filters/robust_ekf.hpp"
#include "auvest/models/constant_acceleration.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/range_bearing.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/models/white_acceleration.hpp"
#include "auvest/slat/ekf_slat.hpp"
#include "close.hpp"

using auvest::ArrayStore;
using auvest::CheckpointOf;
using auvest::CheckpointRing;
using auvest::Checkpoints;
using auvest::CheckpointTime;
using auvest::Resumed;
using auvest::Status;

namespace {

constexpr std::size_t kPayload = 12;
constexpr std::uint16_t kKind = 7;
using Ring = CheckpointRing<ArrayStore, kPayload>;
constexpr std::size_t kSlot = Ring::kSlotBytes;
using Memory = std::vector<std::uint8_t>;

void fill(Ring& ring, std::uint8_t seed) {
  for (std::size_t i = 0; i < kPayload; ++i) {
    ring.payload()[i] = static_cast<std::uint8_t>(seed * 31 + i * seed);
  }
}

bool holds(const Ring& ring, std::uint8_t seed) {
  bool same = true;
  for (std::size_t i = 0; i < kPayload; ++i) {
    same = same && ring.payload()[i] == static_cast<std::uint8_t>(seed * 31 + i * seed);
  }
  return same;
}

/// Writes checkpoints from..to, of payloads that tell which one it is.
void write(Memory& memory, std::uint8_t from, std::uint8_t to) {
  ArrayStore store(memory.data(), memory.size());
  Ring ring(store, kKind);
  for (std::uint8_t n = from; n <= to; ++n) {
    fill(ring, n);
    REQUIRE(ring.begin({n, 0, 9, false}) == n);
    while (ring.poll()) {
    }
  }
}

/// What a start finds.
std::uint32_t found(Memory& memory) {
  ArrayStore store(memory.data(), memory.size());
  Ring ring(store, kKind);
  const std::uint32_t sequence = ring.find();
  if (sequence != 0) {
    CHECK(holds(ring, static_cast<std::uint8_t>(sequence)));
    CHECK(ring.time().seconds == sequence);
  }
  return sequence;
}

/// Is busy for so many polls after each byte.
struct SlowStore : ArrayStore {
  using ArrayStore::ArrayStore;
  mutable int left = 0;
  int written = 0, woken = 0;
  bool busy() const { return left > 0 && left-- > 0; }
  void write(std::size_t place, std::uint8_t byte) {
    ArrayStore::write(place, byte);
    left = 2;
    ++written;
  }
  void wake() { ++woken; }
};

}  // namespace

TEST_CASE("CheckpointRing: a cut at any byte, whatever it reads back as, leaves the one before") {
  // Three slots, and bytes that are no slot; before each write the slot holds an older checkpoint.
  for (const int n : {0, 1, 2, 3, 4, 7}) {
    const std::uint8_t before = static_cast<std::uint8_t>(n);
    Memory whole(3 * kSlot + 5, 0xff);
    write(whole, 1, before);
    REQUIRE(found(whole) == before);
    const std::uint8_t next = static_cast<std::uint8_t>(before + 1);
    Memory after = whole;
    write(after, next, next);
    REQUIRE(found(after) == next);
    const std::size_t place = next % 3 * kSlot;
    int complete = 0;
    for (std::size_t cut = 0; cut < kSlot; ++cut) {
      Memory memory = whole;
      std::copy_n(after.begin() + static_cast<std::ptrdiff_t>(place), cut,
                  memory.begin() + static_cast<std::ptrdiff_t>(place));
      for (int value = 0; value < 256; ++value) {
        memory[place + cut] = static_cast<std::uint8_t>(value);
        const bool all = memory == after;  // the last byte, and as it should be
        complete += all;
        CHECK(found(memory) == (all ? next : before));
      }
    }
    CHECK(complete == 1);
  }
}

TEST_CASE("CheckpointRing: after a cut the torn slot is written again") {
  Memory memory(3 * kSlot, 0xff);
  write(memory, 1, 4);
  memory[5 % 3 * kSlot] ^= 1;  // the write of number 5 has begun
  REQUIRE(found(memory) == 4);
  write(memory, 5, 5);
  CHECK(found(memory) == 5);
  memory[5 % 3 * kSlot + 24] ^= 0x10;
  CHECK(found(memory) == 4);
  memory[4 % 3 * kSlot + 24] ^= 0x10;
  CHECK(found(memory) == 3);
}

TEST_CASE("CheckpointRing: all slots wear alike, and nothing else is written") {
  std::vector<int> writes(4 * kSlot + 9);
  struct Counting : ArrayStore {
    std::vector<int>* writes;
    void write(std::size_t place, std::uint8_t byte) {
      ArrayStore::write(place, byte);
      ++(*writes)[place];
    }
    Counting(std::uint8_t* bytes, std::size_t size, std::vector<int>* w)
        : ArrayStore(bytes, size), writes(w) {}
  };
  Memory memory(writes.size());
  Counting store(memory.data(), memory.size(), &writes);
  CheckpointRing<Counting, kPayload> ring(store, kKind);
  CHECK(ring.slots() == 4);
  for (int n = 0; n < 40; ++n) {
    CHECK(ring.begin({0, 0, 0, false}) != 0);
    while (ring.poll()) {
    }
  }
  for (std::size_t i = 0; i < writes.size(); ++i) CHECK(writes[i] == (i < 4 * kSlot ? 10 : 0));
}

TEST_CASE("CheckpointRing: in the background, from a copy, one at a time") {
  Memory memory(2 * kSlot, 0xff);
  SlowStore store(memory.data(), memory.size());
  CheckpointRing<SlowStore, kPayload> ring(store, kKind);
  CHECK_FALSE(ring.poll());
  // Of four bytes each, none of which memory holds by chance where one is not written.
  CHECK(ring.begin({0x51525354, 0x61626364, 0x71727374, true}) == 1);
  CHECK(store.woken == 1);
  CHECK(store.written == 0);
  int polls = 0;
  while (ring.writing()) {
    CHECK(ring.begin({9, 9, 9, false}) ==
          0);  // and says so to the store, which may have been put to sleep
    ring.poll();
    ++polls;
  }
  CHECK(store.woken == 1 + polls);
  CHECK(polls == 3 * static_cast<int>(kSlot) + 1);  // each byte, two waits, and the end
  CHECK(store.written == static_cast<int>(kSlot));
  CheckpointRing<SlowStore, kPayload> again(store, kKind);
  CHECK(again.find() == 1);
  CHECK(again.sum() == ring.sum());
  CHECK(again.time().seconds == 0x51525354);
  CHECK(again.time().microseconds == 0x61626364);
  CHECK(again.time().start == 0x71727374);
  CHECK(again.time().absolute);
}

TEST_CASE("CheckpointRing: what is not this program's is refused") {
  Memory memory(4 * kSlot, 0xff);
  write(memory, 1, 3);
  ArrayStore store(memory.data(), memory.size());
  CheckpointRing<ArrayStore, kPayload> other_kind(store, kKind + 1);
  CHECK(other_kind.find() == 0);
  CheckpointRing<ArrayStore, kPayload + 1> other_size(store, kKind);
  CHECK(other_size.find() == 0);
  // A checkpoint in another place than its sequence has: of a memory of another size.
  write(memory, 4, 5);
  ArrayStore shorter(memory.data(), 3 * kSlot);
  CHECK(Ring(shorter, kKind).find() == 2);  // 4 and 5, in slots 0 and 1 of four, lie elsewhere

  Memory zeros(4 * kSlot, 0x00);
  CHECK(found(zeros) == 0);
  Memory one(kSlot * 2 - 1, 0xff);  // no room for two
  ArrayStore small(one.data(), one.size());
  Ring ring(small, kKind);
  CHECK(ring.begin({0, 0, 0, false}) == 0);
  CHECK_FALSE(ring.poll());
}

// ---- Filters
// -------------------------------------------------------------------------------------

namespace {

template <class Filter>
bool same_belief(const Filter& a, const Filter& b) {
  bool same = true;
  for (int i = 0; i < Filter::kStates; ++i) {
    same = same && a.x()(i) == b.x()(i);
    for (int j = 0; j <= i; ++j) same = same && a.belief().P(i, j) == b.belief().P(i, j);
  }
  return same;
}

/// Saves `from`, and lets a filter that knows nothing resume.
template <class Filter>
Filter resumed(const Filter& from, Filter to) {
  Memory memory(4096, 0xff);
  ArrayStore store(memory.data(), memory.size());
  Checkpoints<Filter, ArrayStore> first(store, 1);
  CHECK(first.begin(from, {12, 500000, 3, false}) == 1);
  auvest::CheckpointWriter writer(first.payload());
  CheckpointOf<Filter>::save(from, writer);
  CHECK(writer.end() == first.payload() + CheckpointOf<Filter>::kBytes);
  while (first.poll()) {
  }
  Checkpoints<Filter, ArrayStore> second(store, 1);
  const Resumed result = second.resume(to);
  CHECK(result.status == Status::kOk);
  CHECK(result.sequence == 1);
  CHECK(result.time.seconds == 12);
  CHECK(result.time.microseconds == 500000);
  CHECK_FALSE(result.time.absolute);
  return to;
}

}  // namespace

TEST_CASE("Checkpoints: a robust filter goes on with its bits, in the middle of a streak") {
  using Filter = auvest::RobustEkf<auvest::WhiteAcceleration<float, 2>>;
  auvest::LeaderRange<float, 4> leader;
  Filter filter{
      auvest::Ekf<auvest::WhiteAcceleration<float, 2>>(auvest::WhiteAcceleration<float, 2>())};
  Filter::State x;
  x << 30, 40, 0.5f, -0.25f;
  REQUIRE(filter.reset(x, Filter::Covariance::Identity()) == Status::kOk);
  auvest::Vector<float, 1> z;
  for (const float range : {50.2f, 49.9f, 80.0f, 81.0f}) {  // the last two are rejected
    REQUIRE(filter.predict(0.5f) == Status::kOk);
    z(0) = range;
    REQUIRE(filter.update(z, leader).status == Status::kOk);
  }
  REQUIRE(filter.rule().recovery.count > 0);
  Filter fresh{
      auvest::Ekf<auvest::WhiteAcceleration<float, 2>>(auvest::WhiteAcceleration<float, 2>())};
  Filter twin = resumed(filter, fresh);
  CHECK(same_belief(filter, twin));
  CHECK(twin.rule().recovery.count == filter.rule().recovery.count);
  for (int k = 0; k < 5; ++k) {  // until the recovery widens: at the same measurement
    z(0) = 82;
    filter.update(z, leader);
    twin.update(z, leader);
    CHECK(same_belief(filter, twin));
    CHECK(twin.rule().recovery.widened == filter.rule().recovery.widened);
  }
  CHECK(filter.rule().recovery.widened > 0);
  const std::size_t bytes = CheckpointOf<Filter>::kBytes;
  CHECK(bytes == 4 * (4 + 10) + 30);
}

TEST_CASE("Checkpoints: an AUKF goes on with its interval and what the law remembers") {
  using Process = auvest::ExactAcceleration<float>;
  using Filter = auvest::Aukf<Process>;
  const auvest::RangeBearing<float, 6> sonar;
  Filter filter{auvest::Ukf<Process>(Process())};
  Filter::State x;
  x << 3, 4, 0.1f, 0.2f, 0, 0;
  REQUIRE(filter.reset(x, 0.01f * Filter::Covariance::Identity()) == Status::kOk);
  const auto step = [&sonar](Filter& f, int k) {
    CHECK(f.predict(f.interval()) == Status::kOk);
    const auvest::Vector<float, 2> z(3.5f + 0.05f * static_cast<float>(k), 0.65f);
    CHECK(f.update(z, sonar).status == Status::kOk);
    CHECK(f.feedback(Filter::Position(3, 4)) == Status::kOk);
  };
  for (int k = 0; k < 5; ++k) step(filter, k);
  Filter twin = resumed(filter, Filter{auvest::Ukf<Process>(Process())});
  CHECK(twin.interval() == filter.interval());
  const auto& kept = filter.policy().memory;
  const auto& again_kept = twin.policy().memory;
  CHECK(kept.tau != filter.policy().params.tau0);  // no value that a fresh policy has
  CHECK(again_kept.tau == kept.tau);
  CHECK(again_kept.interval == kept.interval);
  CHECK(again_kept.ratio == kept.ratio);
  CHECK(again_kept.mahalanobis_squared == kept.mahalanobis_squared);
  CHECK(again_kept.last_estimate == kept.last_estimate);
  CHECK(again_kept.last_reference == kept.last_reference);
  for (int k = 5; k < 9; ++k) {
    step(filter, k);
    step(twin, k);
    CHECK(same_belief(filter, twin));
    CHECK(twin.interval() == filter.interval());
  }

  // A robust filter inside a policy keeps both.
  using Both =
      auvest::AdaptiveInterval<auvest::RobustEkf<Process>, auvest::CovarianceBudget<float>>;
  Both both{auvest::RobustEkf<Process>(auvest::Ekf<Process>(Process()))};
  REQUIRE(both.reset(x, 0.01f * Both::Covariance::Identity()) == Status::kOk);
  const auvest::Vector<float, 2> wrong(20, 0.65f);
  REQUIRE(both.update(wrong, sonar).status == Status::kOk);
  REQUIRE(both.feedback(Both::Position(3, 4)) == Status::kOk);
  REQUIRE(both.rule().recovery.count > 0);
  const Both again =
      resumed(both, Both{auvest::RobustEkf<Process>(auvest::Ekf<Process>(Process()))});
  CHECK(same_belief(both, again));
  CHECK(again.interval() == both.interval());
  CHECK(again.rule().recovery.count == both.rule().recovery.count);
}

TEST_CASE("Checkpoints: what the filter refuses leaves it as it was") {
  using Filter = auvest::Aukf<auvest::ExactAcceleration<float>>;
  Filter filter{auvest::Ukf<auvest::ExactAcceleration<float>>(auvest::ExactAcceleration<float>())};
  std::uint8_t bytes[2048] = {};
  ArrayStore store(bytes, sizeof bytes);
  Checkpoints<Filter, ArrayStore> checkpoints(store, 1);
  Resumed result = checkpoints.resume(filter);
  CHECK(result.status == Status::kNotInitialised);
  CHECK(result.sequence == 0);
  // Whole, but of numbers that no filter has: P is 0.
  std::memset(checkpoints.payload(), 0, CheckpointOf<Filter>::kBytes);
  REQUIRE(
      static_cast<Checkpoints<Filter, ArrayStore>::Ring&>(checkpoints).begin({0, 0, 0, false}) ==
      1);
  while (checkpoints.poll()) {
  }
  result = checkpoints.resume(filter);
  CHECK(result.status == Status::kBadParameter);
  CHECK(result.sequence == 0);
  CHECK_FALSE(filter.initialised());
}

TEST_CASE("Checkpoints: slave and masters are resumed from their summary") {
  using Filter =
      auvest::EkfSlat<auvest::CompassMotion<double>, auvest::PiecewiseAcceleration<double>, 2>;
  using Summary = auvest::SlatSummary<Filter>;
  Filter filter{auvest::CompassMotion<double>(), auvest::PiecewiseAcceleration<double>()};
  auvest::math::Random random(1);
  Filter::SlaveBelief slave;
  slave.x << 1, 2;
  slave.P << 4, 0, 1, 9;
  Filter::MasterBelief master;
  master.x << 10, 20, 1, 2, 0, 0;
  master.P.setIdentity();
  REQUIRE(filter.reset(slave, random) == Status::kOk);
  REQUIRE(filter.add_master(master) == Status::kOk);
  Summary summary;
  std::memset(static_cast<void*>(&summary), 0, sizeof summary);
  summary.take(filter);
  const Summary kept = resumed(summary, Summary());
  CHECK(kept.masters == 1);
  REQUIRE(kept.start(filter, random) == Status::kOk);
  CHECK(filter.masters() == 1);
  CHECK(filter.slave().x == slave.x);
  CHECK(filter.slave().P(1, 0) == slave.P(1, 0));
  CHECK(filter.master(0).x == master.x);
}

TEST_CASE("FileStore: a checkpoint outlives the program") {
  const std::string path = "test_checkpoint.bin";
  std::FILE* file = std::fopen(path.c_str(), "wb");
  REQUIRE(file != nullptr);
  for (std::size_t i = 0; i < 2 * kSlot; ++i) std::fputc(0xff, file);
  std::fclose(file);
  {
    auvest::FileStore store(path.c_str());
    CheckpointRing<auvest::FileStore, kPayload> ring(store, kKind);
    CHECK(ring.slots() == 2);
    std::memset(ring.payload(), 5, kPayload);
    CHECK(ring.begin({1, 2, 3, false}) == 1);
    while (ring.poll()) {
    }
  }
  {
    auvest::FileStore store(path.c_str());
    CheckpointRing<auvest::FileStore, kPayload> ring(store, kKind);
    CHECK(ring.find() == 1);
    CHECK(ring.payload()[kPayload - 1] == 5);
  }
  std::remove(path.c_str());
  auvest::FileStore none(path.c_str());
  CHECK(none.size() == 0);
  CHECK(none.read(0) == 0xff);
}

// ---- The time that nobody knows
// --------------------------------------------------------------------

TEST_CASE("predict_within: mean in the middle, and the variance of two equal ends") {
  using Process = auvest::WhiteAcceleration<double, 2>;
  using Filter = auvest::RobustEkf<Process>;
  Filter filter{auvest::Ekf<Process>(Process())};
  Filter::State x;
  x << 10, 20, 1, -2;
  const Filter::Covariance P = 0.25 * Filter::Covariance::Identity();
  REQUIRE(filter.reset(x, P) == Status::kOk);
  Filter exact = filter;
  REQUIRE(exact.predict(70) == Status::kOk);
  CHECK(auvest::predict_within(filter, 10.0, 70.0) == Status::kOk);
  CHECK(filter.x()(0) == close_to(10 + 40 * 1, 1e-14));
  CHECK(filter.x()(1) == close_to(20 - 40 * 2, 1e-14));
  CHECK(filter.x()(2) == 1);
  // Half of the time at each end: (60 s v / 2)^2, above what the process has added after 70 s.
  CHECK(filter.belief().P(0, 0) == close_to(exact.belief().P(0, 0) + 30 * 30, 1e-12));
  CHECK(filter.belief().P(1, 0) == close_to(exact.belief().P(1, 0) - 30 * 60, 1e-12));
  CHECK(filter.belief().P(1, 1) == close_to(exact.belief().P(1, 1) + 60 * 60, 1e-12));

  // A time that is known is a prediction, to the bit.
  Filter known = exact;
  REQUIRE(known.predict(5) == Status::kOk);
  CHECK(auvest::predict_within(exact, 5.0, 5.0) == Status::kOk);
  CHECK(same_belief(known, exact));
}

TEST_CASE("predict_within: long times go in steps, and what is refused changes nothing") {
  using Process = auvest::WhiteAcceleration<double, 2>;
  using Filter = auvest::AdaptiveInterval<auvest::Ekf<Process>, auvest::FixedInterval<double>>;
  Filter filter{auvest::Ekf<Process>(Process())};
  CHECK(auvest::predict_within(filter, 0.0, 1.0) == Status::kNotInitialised);
  Filter::State x;
  x << 10, 20, 1, -2;
  REQUIRE(filter.reset(x, Filter::Covariance::Identity()) == Status::kOk);
  const Filter before = filter;
  CHECK(auvest::predict_within(filter, -1.0, 1.0) == Status::kBadParameter);
  CHECK(auvest::predict_within(filter, 2.0, 1.0) == Status::kBadParameter);
  const double infinity = std::numeric_limits<double>::infinity();
  CHECK(auvest::predict_within(filter, 0.0, infinity) == Status::kNotFinite);
  REQUIRE(filter.limit_steps(1e-300) == Status::kOk);
  CHECK(auvest::predict_within(filter, 1.0, 1.0) == Status::kStepTooLong);
  CHECK(same_belief(before, filter));
  REQUIRE(filter.limit_steps(3600) == Status::kOk);
  CHECK(auvest::predict_within(filter, 10000.0, 10000.0) == Status::kOk);
  CHECK(filter.x()(0) == close_to(10010, 1e-12));
}
