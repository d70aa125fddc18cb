#include "report.hpp"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <vector>

namespace auvest_board {

namespace {

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (byte < 0x20 || byte > 0x7e) {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\u%04x", byte);
      result += escape;
    } else {
      result += c;
    }
  }
  return result + '"';
}

void write_sections(std::ostream& json, const Sections& sections) {
  const char* separator = "";
  for (int id = 1; id <= kMaxSection; ++id) {
    const Section& section = sections[id];
    if (section.cycles.empty()) continue;
    std::vector<Cycle> sorted = section.cycles;
    std::sort(sorted.begin(), sorted.end());
    json << separator << '"' << id << "\":{\"count\":" << sorted.size()
         << ",\"first\":" << section.cycles.front() << ",\"minimum\":" << sorted.front()
         << ",\"median\":" << sorted[sorted.size() / 2] << ",\"maximum\":" << sorted.back()
         << ",\"stack_bytes\":" << section.stack << '}';
    separator = ",";
  }
}

}  // namespace

std::string report(const Chip& chip, const Outcome& outcome, uint32_t frequency) {
  std::ostringstream json;
  json << "{\"reason\":" << quoted(name(outcome.reason))
       << ",\"message\":" << quoted(outcome.message) << ",\"frequency_hz\":" << frequency
       << ",\"cycles\":" << chip.cycles() << ",\"cycles_asleep\":" << chip.cycles_asleep()
       << ",\"ram_end\":" << chip.ram_end() << ",\"static_end\":" << chip.static_end()
       << ",\"heap_bytes\":" << chip.heap_bytes()
       << ",\"lowest_stack_pointer\":" << chip.lowest_stack_pointer()
       << ",\"serial_overruns\":" << chip.serial_overruns() << ",\"sections\":{";
  write_sections(json, chip.sections());
  json << "},\"pins\":[";
  const char* separator = "";
  for (const PinChange& change : chip.pin_changes()) {
    json << separator << "{\"cycle\":" << change.cycle << ",\"pin\":" << quoted(change.pin)
         << ",\"level\":" << (change.level ? "true" : "false") << '}';
    separator = ",";
  }
  json << "]}";
  return json.str();
}

}  // namespace auvest_board
