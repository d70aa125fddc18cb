// A memory that is an array: FRAM or battery-backed RAM that the processor addresses, a copy of a
// page of flash, which the program writes when a checkpoint is complete, or a test's.
#pragma once

#include <cstddef>
#include <cstdint>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// A Store (checkpoint_ring.hpp) that is never busy.
class ArrayStore {
 public:
  ArrayStore(std::uint8_t* bytes, std::size_t size) : bytes_(bytes), size_(size) {}

  std::size_t size() const { return size_; }
  std::uint8_t read(std::size_t place) const { return bytes_[place]; }
  bool busy() const { return false; }
  void write(std::size_t place, std::uint8_t byte) { bytes_[place] = byte; }
  void wake() {}

 private:
  std::uint8_t* bytes_;
  std::size_t size_;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
