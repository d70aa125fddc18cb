/// What is around the chip: it sees what the chip does, and sends serial lines and bytes to it.
#pragma once

#include <string>
#include <vector>

#include "simavr.hpp"

namespace auvest_board {

/// Something the chip did, or the start of the run.
struct Event {
  enum class Kind { kStart, kLine, kPin, kInput };
  Kind kind;
  Cycle cycle;  ///< kLine: when the stop bit of its newline had passed
  /// kLine: without the line's end; kPin: the pin's name; kInput: what board::write() has written
  /// since the last of these events.
  std::string text;
  bool level;  ///< kPin: the new level
};

/// A line for the chip; its first start bit comes this long after the event.
struct Message {
  Cycle delay;
  std::string text;
};

struct Reaction {
  std::vector<Message> messages;
  std::string input;    ///< for board::read(), at once
  bool stop = false;    ///< end the run here
  bool cut = false;     ///< the power goes off ...
  Cycle cut_delay = 0;  ///< ... this long after the event
};

class World {
 public:
  World() = default;
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  virtual ~World() = default;

  /// By default nobody answers.
  virtual Reaction react(const Event&) { return {}; }
};

/// Answers the chip's requests, one after the other, from a CSV file with the columns
/// delay_ms,text. An empty text, or no row left, is no answer. The text may hold commas.
class AnswersWorld : public World {
 public:
  /// A line that starts with `request` is a request. Throws std::runtime_error on a bad file.
  AnswersWorld(const std::string& path, std::string request, uint32_t frequency);

  Reaction react(const Event& event) override;

 private:
  std::vector<Message> answers_;
  size_t next_ = 0;
  std::string request_;
};

/// The world is another process, in lock-step on stdin and stdout, one message per line:
///
///     start 0                 the chip is about to start
///     line CYCLE TEXT         it has sent a line
///     pin CYCLE NAME LEVEL    a watched pin has changed
///     input CYCLE BYTES       with --raw: board::read() waits for bytes; BYTES is what
///                             board::write() has written since the last of these, two hexadecimal
///                             digits each
///
/// After each the chip stands still until `go`; before it may come any number of
///
///     send DELAY TEXT         send TEXT and a newline, beginning DELAY cycles after the event
///     cut DELAY               the power goes off DELAY cycles after the event
///     feed BYTES              bytes for board::read(), which are there at once
///
/// `stop` instead of `go`, or the end of stdin, ends the run. The last line on stdout is the
/// report, one line of JSON: report {...}
class InteractiveWorld : public World {
 public:
  /// Throws std::runtime_error on a command it does not know.
  Reaction react(const Event& event) override;
};

}  // namespace auvest_board
