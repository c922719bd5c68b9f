#include "base/errors.h"

#include <fmt/format.h>

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
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0 || byte < 0x20 || byte == 0x7F) {
      out += fmt::format("\\x{:02X}", byte);
      ++i;
    } else {
      out += text.substr(i, length);
      i += length;
    }
  }
  return out;
}

}  // namespace mouthpiece
