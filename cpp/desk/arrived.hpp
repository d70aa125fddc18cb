// What comes from code that is compiled for another instruction set, where a type may have another
// name: as bytes, or member by member. Without functions of the standard library: those would have
// the same name in both.
#pragma once

#include <cstring>
#include <type_traits>

#include "auvest/config.hpp"
#include "desk/lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// An object of auvest's by its bytes. `object`: any one, where there is none by default.
template <class Type>
AUVEST_INLINE Type arrived(const void* bytes, Type object = Type()) {
  static_assert(std::is_trivially_copyable<Type>::value, "its bytes are all that there is of it");
  std::memcpy(static_cast<void*>(&object), bytes, sizeof object);
  return object;
}

/// What a RejectionStreak carries, to the row of its run.
template <class Streak, class Scalar>
AUVEST_INLINE void put_away(const Streak& streak, desk::LaneRecovery<Scalar>& carried) {
  carried.count = streak.count;
  carried.widened = streak.widened;
  carried.variance = streak.variance;
  for (int i = 0; i < 6; ++i) carried.recent[i] = streak.recent.data()[i];
}

/// And back.
template <class Scalar, class Streak>
AUVEST_INLINE void take_up(const desk::LaneRecovery<Scalar>& carried, Streak& streak) {
  streak.count = carried.count;
  streak.widened = carried.widened;
  streak.variance = carried.variance;
  for (int i = 0; i < 6; ++i) streak.recent.data()[i] = carried.recent[i];
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
