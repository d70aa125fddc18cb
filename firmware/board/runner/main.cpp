/// auvest-board: runs a program for an AVR on a simulated chip and plays the world around it.
///
/// Exit codes: 0 the program finished, or ran for the time asked for; 1 it failed, or the chip did
/// something wrong (one line on stderr says what); 2 wrong arguments or files.

#include <getopt.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>

#include "chip.hpp"
#include "program.hpp"
#include "report.hpp"
#include "world.hpp"

namespace auvest_board {

namespace {

constexpr char kUsage[] = R"(usage: auvest-board [options] program.elf

Runs an AVR program on a simulated chip until it calls board::finish().

  --mcu NAME        chip (atmega2560)
  --frequency HZ    its clock (16000000)
  --limit SECONDS   simulated time after which a run that has not finished is a failure (60)
  --for SECONDS     run for exactly this long; that is success
  --input FILE      bytes for board::read()
  --output FILE     bytes from board::write()
  --serial FILE     what the chip sent on USART0; - is stdout
  --answers FILE    CSV, columns delay_ms,text: answers to the chip's requests on USART0
  --request PREFIX  how a request begins (?)
  --interactive     the world is played through stdin and stdout (protocol: runner/world.hpp)
  --raw             with --interactive: the bytes of board::read() and board::write() pass there, too
  --eeprom FILE     what the EEPROM holds, kept there at the end; a file that is not there is erased
                    memory
  --reset-cause WHY what MCUSR says: power-on (the default), external, brown-out or watchdog
  --cut CYCLE       the power goes off then; that is success
  --seed N          decides what a byte of EEPROM that is being written then reads back as (1)
  --watch PIN       record the changes of a pin like PORTB7, or of all; may be repeated
  --report FILE     JSON: outcome, cycles, sections, stack, heap, pins
)";

struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Options {
  ChipOptions chip;
  double limit_s = 60;
  std::string input, output, serial, answers, report, eeprom, program;
  std::string request = "?";
  bool interactive = false;
  bool help = false;
};

double positive(const std::string& option, const char* text) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (*text == '\0' || *end != '\0' || !(value > 0) || !std::isfinite(value)) {
    throw UsageError("--" + option + " must be a positive number; got " + text);
  }
  return value;
}

uint64_t whole(const std::string& option, const char* text) {
  char* end = nullptr;
  const uint64_t value = std::strtoull(text, &end, 10);
  if (*text < '0' || *text > '9' || *end != '\0') {
    throw UsageError("--" + option + " must be a whole number; got " + text);
  }
  return value;
}

ResetCause reset_cause(const std::string& name) {
  if (name == "power-on") return ResetCause::kPowerOn;
  if (name == "external") return ResetCause::kExternal;
  if (name == "brown-out") return ResetCause::kBrownOut;
  if (name == "watchdog") return ResetCause::kWatchdog;
  throw UsageError("--reset-cause must be power-on, external, brown-out or watchdog; got " + name);
}

Options parse(int argc, char** argv) {
  const option known[] = {{"mcu", required_argument, nullptr, 'm'},
                          {"frequency", required_argument, nullptr, 'f'},
                          {"limit", required_argument, nullptr, 'l'},
                          {"for", required_argument, nullptr, 't'},
                          {"input", required_argument, nullptr, 'i'},
                          {"output", required_argument, nullptr, 'o'},
                          {"serial", required_argument, nullptr, 's'},
                          {"answers", required_argument, nullptr, 'a'},
                          {"request", required_argument, nullptr, 'q'},
                          {"interactive", no_argument, nullptr, 'x'},
                          {"raw", no_argument, nullptr, 'b'},
                          {"watch", required_argument, nullptr, 'w'},
                          {"report", required_argument, nullptr, 'r'},
                          {"eeprom", required_argument, nullptr, 'e'},
                          {"cut", required_argument, nullptr, 'c'},
                          {"seed", required_argument, nullptr, 'd'},
                          {"reset-cause", required_argument, nullptr, 'p'},
                          {"help", no_argument, nullptr, 'h'},
                          {nullptr, 0, nullptr, 0}};
  Options options;
  for (int c; (c = getopt_long(argc, argv, "h", known, nullptr)) != -1;) {
    switch (c) {
      case 'm':
        options.chip.mcu = optarg;
        break;
      case 'f':
        options.chip.frequency = static_cast<uint32_t>(positive("frequency", optarg));
        break;
      case 'l':
        options.limit_s = positive("limit", optarg);
        break;
      case 't':
        options.limit_s = positive("for", optarg);
        options.chip.at_limit = Reason::kElapsed;
        break;
      case 'i':
        options.input = optarg;
        break;
      case 'o':
        options.output = optarg;
        break;
      case 's':
        options.serial = optarg;
        break;
      case 'a':
        options.answers = optarg;
        break;
      case 'q':
        options.request = optarg;
        break;
      case 'x':
        options.interactive = true;
        break;
      case 'b':
        options.chip.raw = true;
        break;
      case 'w':
        options.chip.watched_pins.push_back(optarg);
        break;
      case 'r':
        options.report = optarg;
        break;
      case 'e':
        options.eeprom = optarg;
        break;
      case 'c':
        options.chip.cut = whole("cut", optarg);
        break;
      case 'd':
        options.chip.seed = static_cast<uint32_t>(whole("seed", optarg));
        break;
      case 'p':
        options.chip.cause = reset_cause(optarg);
        break;
      case 'h':
        options.help = true;
        return options;
      default:
        throw UsageError("see auvest-board --help");
    }
  }
  if (optind + 1 != argc) throw UsageError("expected one program; see auvest-board --help");
  options.program = argv[optind];
  if (options.interactive && !options.answers.empty()) {
    throw UsageError("--interactive and --answers are two worlds: choose one");
  }
  if (options.chip.raw && !options.interactive) throw UsageError("--raw needs --interactive");
  if (options.interactive && options.serial == "-") {
    throw UsageError("--serial - and --interactive both want stdout");
  }
  options.chip.limit = static_cast<Cycle>(std::llround(options.limit_s * options.chip.frequency));
  return options;
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_file(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << content) || !file.flush()) throw std::runtime_error("cannot write " + path);
}

std::unique_ptr<World> make_world(const Options& options) {
  if (options.interactive) return std::make_unique<InteractiveWorld>();
  if (!options.answers.empty()) {
    return std::make_unique<AnswersWorld>(options.answers, options.request, options.chip.frequency);
  }
  return std::make_unique<World>();
}

int run(int argc, char** argv) {
  Options options = parse(argc, argv);
  if (options.help) {
    std::cout << kUsage;
    return 0;
  }
  Program program(options.program);
  if (!options.input.empty()) options.chip.input = read_file(options.input);
  if (!options.eeprom.empty() && std::ifstream(options.eeprom)) {
    options.chip.eeprom = read_file(options.eeprom);
  }
  const std::unique_ptr<World> world = make_world(options);
  Chip chip(program, *world, options.chip);
  const Outcome outcome = chip.run();

  if (!options.eeprom.empty()) write_file(options.eeprom, chip.eeprom());

  const std::string json = report(chip, outcome, options.chip.frequency);
  if (options.interactive) std::cout << "report " << json << std::endl;
  if (options.serial == "-") {
    std::cout << chip.serial();
  } else if (!options.serial.empty()) {
    write_file(options.serial, chip.serial());
  }
  if (!options.output.empty()) write_file(options.output, chip.output());
  if (!options.report.empty()) write_file(options.report, json + '\n');
  if (!is_failure(outcome.reason)) return 0;
  std::cerr << "auvest-board: " << options.program << ": " << name(outcome.reason) << ": "
            << outcome.message << '\n';
  return 1;
}

}  // namespace

}  // namespace auvest_board

int main(int argc, char** argv) {
  try {
    return auvest_board::run(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "auvest-board: " << error.what() << '\n';
    return 2;
  }
}
