// Checkpoints in a memory that outlives the power: EEPROM, FRAM, a page of flash, a file.
//
// The memory is a ring of slots, which are written one after the other, so that all bytes wear
// alike. A slot is written byte by byte while the program goes on, from a copy made when the
// checkpoint began: what is kept is the state at one moment, however long the writing takes. It
// ends in the CRC-32 of all before it. A slot whose writing was cut has another sum, and the one
// before it, which was not touched, is the newest:
//
//     header     kind and size: a slot of another program, or of another filter, is refused
//     sequence   counts checkpoints from 1; sequence modulo the number of slots is the place
//     time       see CheckpointTime
//     payload
//     CRC-32
//
// A cut within the first or the last byte, or one that leaves at most four bytes in a row changed,
// is always noticed; of all else one in 2^32 is not.
//
// The memory is a Store, which offers
//
//     std::size_t  size() const                bytes
//     std::uint8_t read(std::size_t) const     the byte at a place; nothing is being written
//     bool         busy() const                whether a byte is being written
//     void         write(std::size_t, std::uint8_t)    begins to write a byte
//     void         wake()                      poll() has work: for a store whose interrupt calls
//     it
//
// poll() belongs to one caller: the interrupt of the store, or the program's loop.
#pragma once

#include <cstddef>
#include <cstdint>

#include "auvest/board/crc32.hpp"
#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// When a checkpoint was made. Whole seconds and the rest: a float has no microseconds after a
/// minute.
struct CheckpointTime {
  std::uint32_t seconds;
  std::uint32_t microseconds;
  std::uint32_t start;  ///< how many starts of the program there were until then, if it counts them
  bool absolute;        ///< the time is that of a clock which goes on without power
};

/// `Payload`: bytes of what is kept.
template <class Store, std::size_t Payload>
class CheckpointRing {
 public:
  static constexpr std::size_t kBefore = 21;  ///< bytes before the payload
  static constexpr std::size_t kSlotBytes = kBefore + Payload + 4;
  static_assert(Payload > 0 && kSlotBytes < 0x10000, "a slot is smaller than 64 KiB");

  /// `kind` is the program's choice: another wherever a byte of the payload has another meaning.
  CheckpointRing(Store& store, std::uint16_t kind) : store_(store), kind_(kind) {}
  CheckpointRing(const CheckpointRing&) = delete;
  CheckpointRing& operator=(const CheckpointRing&) = delete;

  /// So many checkpoints fit. With fewer than two none is written: one alone would be destroyed by
  /// the next.
  std::size_t slots() const { return store_.size() / kSlotBytes; }

  /// Looks for the newest whole checkpoint, while nothing is being written, and gives its sequence;
  /// 0: there is none. payload() and time() are then its.
  std::uint32_t find() {
    search();
    if (newest_ != 0) {
      const std::size_t place = newest_ % slots() * kSlotBytes;
      for (std::size_t i = 0; i < kSlotBytes; ++i) image_[i] = store_.read(place + i);
    }
    return newest_;
  }

  /// Where the next checkpoint's payload is put together: before begin(), not while writing().
  std::uint8_t* payload() { return image_ + kBefore; }
  const std::uint8_t* payload() const { return image_ + kBefore; }
  CheckpointTime time() const { return {word(8), word(12), word(16), image_[20] != 0}; }

  /// The CRC-32 of the checkpoint that is found or was begun.
  std::uint32_t sum() const { return word(kBefore + Payload); }

  /// Begins to write what is in payload(), and gives its sequence; 0: not while one is being
  /// written, and not where two do not fit.
  std::uint32_t begin(const CheckpointTime& time) {
    if (writing_) {
      store_.wake();  // whoever else wrote may have put it to sleep
      return 0;
    }
    if (slots() < 2) return 0;
    if (!searched_) search();  // the count goes on, and the payload stays
    ++newest_;
    place_ = newest_ % slots() * kSlotBytes;
    put_word(0, header());
    put_word(4, newest_);
    put_word(8, time.seconds);
    put_word(12, time.microseconds);
    put_word(16, time.start);
    image_[20] = time.absolute;
    Crc32 sum;
    for (std::size_t i = 0; i < kBefore + Payload; ++i) sum.add(image_[i]);
    put_word(kBefore + Payload, sum.value());
    done_ = 0;
    writing_ = true;
    store_.wake();
    return newest_;
  }

  /// Goes on writing where the store is ready; false: nothing is left to do.
  bool poll() {
    if (!writing_) return false;
    if (store_.busy()) return true;
    if (done_ == kSlotBytes) {
      writing_ = false;
      return false;
    }
    store_.write(place_ + done_, image_[done_]);
    ++done_;
    return true;
  }

  /// Until the last byte is in.
  bool writing() const { return writing_; }
  std::uint32_t newest() const { return newest_; }  ///< the sequence found, or begun since

 private:
  std::uint32_t header() const {
    return static_cast<std::uint32_t>(kind_) << 16 | static_cast<std::uint32_t>(kSlotBytes);
  }

  void search() {
    newest_ = 0;
    const std::size_t count = slots();
    for (std::size_t i = 0; i < count && count > 1; ++i) {
      const std::size_t place = i * kSlotBytes;
      const std::uint32_t sequence = stored_word(place + 4);
      const bool ours = stored_word(place) == header() && sequence % count == i;
      if (ours && sequence > newest_ && is_whole(place)) newest_ = sequence;
    }
    searched_ = true;
  }

  bool is_whole(std::size_t place) const {
    Crc32 sum;
    for (std::size_t i = 0; i < kBefore + Payload; ++i) sum.add(store_.read(place + i));
    return sum.value() == stored_word(place + kBefore + Payload);
  }

  std::uint32_t stored_word(std::size_t place) const {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | store_.read(place + i);
    return value;
  }

  std::uint32_t word(std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | image_[at + i];
    return value;
  }

  void put_word(std::size_t at, std::uint32_t value) {
    for (std::size_t i = 0; i < 4; ++i) image_[at + i] = static_cast<std::uint8_t>(value >> 8 * i);
  }

  Store& store_;
  std::uint16_t kind_;
  bool searched_ = false;
  volatile bool writing_ = false;  // an interrupt may poll()
  std::uint32_t newest_ = 0;
  std::size_t place_ = 0;
  std::size_t done_ = 0;  // bytes of image_ whose writing has begun
  std::uint8_t image_[kSlotBytes];
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
