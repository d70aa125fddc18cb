// Rows in, answers out: what every bench has, whatever filter is in it. What includes this has
// named kDigest and kMostWords, those of the longest row, and defines below it
//
//     uint8_t words(row)     how many the row should have that has come
//     Status begin()         takes row 0, the start
//     Status step()          takes another row
//     void   show(FrameOut&) adds what the filter is now to an answer
//
// and has the other end of the line:
//
//     void     port::put(char)         sends a character
//     void     port::begin(), end()    around a step, for whoever counts
//     uint32_t port::microseconds()    a clock, or always 0
//
// Words of a row:     number, what begin() or step() takes
//       of an answer: A, number, status (with what else was said, from bit 8 on), microseconds,
//       what
//                     show() adds
//
// Row kAnew is no row: it asks who answers, and the record begins anew. The answer is B: which
// bench, next row; and so is what it says at its start. A damaged line and a row that is not
// the next are answered by N: next row. The last row again is answered again: its first answer was
// lost.
#pragma once

#include "auvest/math/bits.hpp"
#include "auvest/status.hpp"
#include "frames.hpp"

namespace bench {

using auvest::Status;

constexpr uint32_t kAnew = 0xffffffff;

FrameIn<kMostWords> frame;

float number(uint8_t i) { return auvest::math::from_bits(frame.word(i)); }

uint32_t next = 0;  // row that has not come yet
// Of the last row.
uint32_t took = 0;
uint32_t said = 0;

uint8_t words(uint32_t row);
Status begin();
Status step();
void show(FrameOut& out);

void put(FrameOut& out, float value) { out.word(auvest::math::to_bits(value)); }

/// Mean and lower triangle.
template <class State, class Covariance>
void put(FrameOut& out, const State& x, const Covariance& P) {
  for (uint8_t i = 0; i < State::RowsAtCompileTime; ++i) put(out, x(i));
  for (uint8_t i = 0; i < State::RowsAtCompileTime; ++i) {
    for (uint8_t j = 0; j <= i; ++j) put(out, P(i, j));
  }
}

/// The same of a row, from word `from` on.
template <class State, class Covariance>
void get(uint8_t from, State& x, Covariance& P) {
  auvest::math::set_zero(P);
  for (uint8_t i = 0; i < State::RowsAtCompileTime; ++i) x(i) = number(from++);
  for (uint8_t i = 0; i < State::RowsAtCompileTime; ++i) {
    for (uint8_t j = 0; j <= i; ++j) P(i, j) = number(from++);
  }
}

void say(char kind) {
  FrameOut out(kind);
  if (kind == 'B') out.word(kDigest);
  out.word(next);
  out.end();
}

void answer() {
  FrameOut out('A');
  out.word(next - 1);
  out.word(said);
  out.word(took);
  show(out);
  out.end();
}

// Not inlined: the frames of this and of what sends would lie below one another on the stack.
__attribute__((noinline)) void take_row() {
  said = 0;
  const uint32_t before = port::microseconds();
  port::begin();
  const Status status = next == 0 ? begin() : step();
  port::end();
  took = port::microseconds() - before;
  said |= static_cast<uint32_t>(status);
  ++next;
}

/// Takes a character of the line, and answers where it ends a frame.
void take(char character) {
  using Result = decltype(frame.take(character));
  const Result result = frame.take(character);
  if (result == Result::kMore) return;
  if (result == Result::kCorrupt) return say('N');
  const uint32_t row = frame.word(0);
  if (row == kAnew) {
    next = 0;
    return say('B');
  }
  if (row == next && frame.count() == words(row)) {
    take_row();
    return answer();
  }
  if (row + 1 == next) return answer();
  say('N');
}

}  // namespace bench
