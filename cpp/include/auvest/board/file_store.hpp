// A memory that is a file, for computers that have files. Not part of auvest/auvest.hpp: an AVR has
// none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "auvest/config.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// A Store (checkpoint_ring.hpp) over a file that exists and is as long as it shall be; bytes reach
/// the operating system one by one, in their order.
class FileStore {
 public:
  explicit FileStore(const char* path) : file_(std::fopen(path, "r+b")) {
    if (file_ == nullptr) return;
    std::setvbuf(file_, nullptr, _IONBF, 0);
    if (std::fseek(file_, 0, SEEK_END) == 0) {
      const long end = std::ftell(file_);
      if (end > 0) size_ = static_cast<std::size_t>(end);
    }
  }
  ~FileStore() {
    if (file_ != nullptr) std::fclose(file_);
  }
  FileStore(const FileStore&) = delete;
  FileStore& operator=(const FileStore&) = delete;

  /// 0 where the file could not be opened: no checkpoint fits then.
  std::size_t size() const { return size_; }

  /// What cannot be read looks like erased memory.
  std::uint8_t read(std::size_t place) const {
    const int byte = seek(place) ? std::fgetc(file_) : EOF;
    return byte == EOF ? std::uint8_t(0xff) : static_cast<std::uint8_t>(byte);
  }

  bool busy() const { return false; }

  /// A write that fails shows in the checkpoint's sum.
  void write(std::size_t place, std::uint8_t byte) {
    if (seek(place)) std::fputc(byte, file_);
  }

  void wake() {}

 private:
  bool seek(std::size_t place) const {
    return file_ != nullptr && std::fseek(file_, static_cast<long>(place), SEEK_SET) == 0;
  }

  std::FILE* file_;
  std::size_t size_ = 0;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
