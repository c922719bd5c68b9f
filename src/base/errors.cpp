#include "base/errors.h"

#include <fmt/format.h>

#include <algorithm>

namespace mouthpiece {
namespace {

std::string joinPlace(std::string_view file, std::string_view place, std::string_view what) {
  if (place.empty()) return fmt::format("{}: {}", printable(file, 400), what);
  return fmt::format("{}:{}: {}", printable(file, 400), place, what);
}

/// Length of the well-formed UTF-8 sequence that starts `text`, 0 when it is broken.
std::size_t utf8SequenceLength(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  const std::size_t length = lead < 0x80                   ? 1
                             : lead >= 0xC2 && lead < 0xE0 ? 2
                             : (lead >> 4) == 0xE          ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U) return 0;
  }
  return length;
}

/// What a terminal obeys, or what hides text on it: control characters, line and paragraph separators, and what turns
/// the direction of what follows.
bool isControl(std::string_view sequence) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(sequence[i]); };
  if (sequence.size() == 1) return byte(0) < 0x20 || byte(0) == 0x7F;
  if (sequence.size() == 2) return byte(0) == 0xC2 && byte(1) < 0xA0;  // U+0080 to 009F
  if (sequence.size() != 3 || byte(0) != 0xE2) return false;
  return (byte(1) == 0x80 && byte(2) >= 0xA8 && byte(2) <= 0xAE) ||  // U+2028 to 202E
         (byte(1) == 0x81 && byte(2) >= 0xA6 && byte(2) <= 0xA9);    // U+2066 to 2069
}

}  // namespace

InputError::InputError(std::string_view file, std::string_view place, std::string_view what)
    : std::runtime_error(joinPlace(file, place, what)) {}

InputError::InputError(std::string_view what) : std::runtime_error(std::string(what)) {}

void failExpectation(const char* condition, const char* file, int line) {
  throw InternalError(fmt::format("{}:{}: expected {}", file, line, condition));
}

std::string printable(std::string_view text, std::size_t max_bytes) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (out.size() >= max_bytes) return out + "...";
    const std::size_t length = utf8SequenceLength(text.substr(i));
    const std::string_view sequence = text.substr(i, std::max<std::size_t>(1, length));
    if (length > 0 && !isControl(sequence)) {
      out += sequence;
    } else {
      for (const char byte : sequence) out += fmt::format("\\x{:02X}", static_cast<unsigned char>(byte));
    }
    i += sequence.size();
  }
  return out;
}

}  // namespace mouthpiece
