#include "program.hpp"

#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>

namespace auvest_board {

namespace {

// The linker's addresses: flash from 0, RAM from 0x800000, EEPROM from 0x810000.
constexpr uint32_t kDataBegin = 0x800000;
constexpr uint32_t kDataEnd = 0x810000;

/// simavr does not look: it would load any ELF file.
bool is_avr_elf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::array<char, 20> header{};
  file.read(header.data(), header.size());
  constexpr char kMachineAvr = 83;
  return file &&
         std::memcmp(header.data(),
                     "\x7f"
                     "ELF",
                     4) == 0 &&
         header[18] == kMachineAvr && header[19] == 0;
}

}  // namespace

Program::Program(const std::string& path) {
  avr_global_logger_set([](avr_t*, int, const char*, va_list) {});  // it would print what it loads
  if (!is_avr_elf(path)) throw std::runtime_error(path + " is not an ELF file for an AVR");
  if (elf_read_firmware(path.c_str(), &firmware_) != 0 || firmware_.flashsize == 0) {
    throw std::runtime_error(path + " has no program in it");
  }
  static_end_ = data_symbol("__heap_start");
  if (static_end_ == 0) static_end_ = data_symbol("_end");
  if (static_end_ == 0) throw std::runtime_error(path + " has no symbol _end: was it stripped?");
  heap_end_variable_ = data_symbol("__brkval");
}

uint16_t Program::data_symbol(const char* name) const {
  for (uint32_t i = 0; i < firmware_.symbolcount; ++i) {
    const avr_symbol_t& symbol = *firmware_.symbol[i];
    if (symbol.addr >= kDataBegin && symbol.addr < kDataEnd &&
        std::strcmp(symbol.symbol, name) == 0) {
      return static_cast<uint16_t>(symbol.addr - kDataBegin);
    }
  }
  return 0;
}

std::string Program::place(avr_flashaddr_t pc) const {
  char address[16];
  std::snprintf(address, sizeof address, "0x%04x", pc);
  if (pc >= avr_flashaddr_t(firmware_.flashsize)) return address;
  const avr_symbol_t* nearest = nullptr;
  for (uint32_t i = 0; i < firmware_.symbolcount && firmware_.symbol[i]->addr <= pc; ++i) {
    nearest = firmware_.symbol[i];  // they are sorted by address
  }
  return nearest ? std::string(address) + " in " + nearest->symbol : address;
}

}  // namespace auvest_board
