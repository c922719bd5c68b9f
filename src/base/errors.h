#pragma once

#include <string>
#include <string_view>

#include "mouthpiece/errors.h"

namespace mouthpiece {

[[noreturn]] void failExpectation(const char* condition, const char* file, int line);

/// `text` made safe for one line of a terminal: control characters and broken UTF-8 are shown as
/// \xNN, and it is cut after `max_bytes` with an ellipsis.
std::string printable(std::string_view text, std::size_t max_bytes = 80);

}  // namespace mouthpiece

/// Checks our own invariants, in every build type. Throws InternalError.
#define MOUTHPIECE_EXPECT(condition) \
  ((condition) ? static_cast<void>(0) : ::mouthpiece::failExpectation(#condition, __FILE__, __LINE__))
