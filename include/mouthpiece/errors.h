#pragma once

#include <stdexcept>
#include <string_view>

#include "mouthpiece/version.h"

namespace mouthpiece {

/// Bad data from outside: a file, an argument, a child process. The message is one line that names the file, the place
/// in it, what was found and what was expected.
class MOUTHPIECE_API InputError : public std::runtime_error {
 public:
  /// `place` may be empty (the whole file), a line ("41"), a byte offset ("byte 512") or a key.
  InputError(std::string_view file, std::string_view place, std::string_view what);
  explicit InputError(std::string_view what);
};

/// A broken promise inside Mouthpiece; user input can never cause one.
class MOUTHPIECE_API InternalError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

}  // namespace mouthpiece
