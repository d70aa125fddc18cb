#include "world.hpp"

#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace auvest_board {

namespace {

bool starts_with(const std::string& text, const std::string& prefix) {
  return text.compare(0, prefix.size(), prefix) == 0;
}

std::string to_hex(const std::string& bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const char byte : bytes) {
    text.push_back(kDigits[static_cast<uint8_t>(byte) >> 4]);
    text.push_back(kDigits[byte & 0x0f]);
  }
  return text;
}

/// Appends the bytes to `out`; false where the text is not pairs of hexadecimal digits.
bool from_hex(const std::string& text, std::string& out) {
  if (text.size() % 2 != 0) return false;
  for (size_t i = 0; i < text.size(); ++i) {
    const std::string digits = "0123456789abcdef";
    const size_t digit = digits.find(text[i]);
    if (digit == std::string::npos) return false;
    if (i % 2 == 0) {
      out.push_back(static_cast<char>(digit << 4));
    } else {
      out.back() = static_cast<char>(static_cast<uint8_t>(out.back()) | digit);
    }
  }
  return true;
}

}  // namespace

AnswersWorld::AnswersWorld(const std::string& path, std::string request, uint32_t frequency)
    : request_(std::move(request)) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::string row;
  for (int number = 1; std::getline(file, row); ++number) {
    if (!row.empty() && row.back() == '\r') row.pop_back();
    if (row == "delay_ms,text" || row.empty()) continue;
    std::istringstream fields(row);
    double delay_ms = 0;
    char comma = 0;
    if (!(fields >> delay_ms >> comma) || comma != ',' || !(delay_ms >= 0)) {
      throw std::runtime_error(path + ":" + std::to_string(number) + ": expected delay_ms,text");
    }
    answers_.push_back(
        {Cycle(std::llround(delay_ms * 1e-3 * frequency)), row.substr(row.find(',') + 1)});
  }
}

Reaction AnswersWorld::react(const Event& event) {
  Reaction reaction;
  if (event.kind == Event::Kind::kLine && starts_with(event.text, request_) &&
      next_ < answers_.size()) {
    const Message& answer = answers_[next_++];
    if (!answer.text.empty()) reaction.messages.push_back(answer);
  }
  return reaction;
}

Reaction InteractiveWorld::react(const Event& event) {
  switch (event.kind) {
    case Event::Kind::kStart:
      std::cout << "start " << event.cycle;
      break;
    case Event::Kind::kLine:
      std::cout << "line " << event.cycle << ' ' << event.text;
      break;
    case Event::Kind::kPin:
      std::cout << "pin " << event.cycle << ' ' << event.text << ' ' << event.level;
      break;
    case Event::Kind::kInput:
      std::cout << "input " << event.cycle << ' ' << to_hex(event.text);
      break;
  }
  std::cout << std::endl;

  Reaction reaction;
  std::string command;
  while (std::getline(std::cin, command)) {
    if (command == "go") return reaction;
    if (command == "stop") break;
    if (starts_with(command, "feed ") && from_hex(command.substr(5), reaction.input)) continue;
    std::istringstream words(command);
    std::string verb;
    Message message{};
    words >> verb >> message.delay;
    if (words && verb == "cut") {
      reaction.cut = true;
      reaction.cut_delay = message.delay;
      continue;
    }
    if (!words || verb != "send" || words.get() != ' ') {
      throw std::runtime_error("--interactive: unknown command: " + command);
    }
    std::getline(words, message.text);
    reaction.messages.push_back(std::move(message));
  }
  reaction.stop = true;
  return reaction;
}

}  // namespace auvest_board
