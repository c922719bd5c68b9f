#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace mouthpiece {

/// Bad data from outside: a file, an argument, a child process. The message is one line that names
/// the file, the place in it, what was found and what was expected. Caught once, in `main` (exit 1).
class InputError : public std::runtime_error {
 public:
  /// `place` may be empty (the whole file), a line ("41"), a byte offset ("byte 512") or a key.
  InputError(std::string_view file, std::string_view place, std::string_view what);
  explicit InputError(std::string_view what);
};

/// A broken promise inside Mouthpiece; user input can never cause one.
class InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void failExpectation(const char* condition, const char* file, int line);

/// `text` made safe for one line of a terminal: control characters and broken UTF-8 are shown as
/// \xNN, and it is cut after `max_bytes` with an ellipsis.
std::string printable(std::string_view text, std::size_t max_bytes = 80);

}  // namespace mouthpiece

/// Checks our own invariants, in every build type. Throws InternalError.
#define MOUTHPIECE_EXPECT(condition) \
  ((condition) ? static_cast<void>(0) : ::mouthpiece::failExpectation(#condition, __FILE__, __LINE__))
