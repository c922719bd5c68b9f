#include "base/page_data.h"

#include <array>
#include <cstdint>

namespace mouthpiece {
namespace {

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The two letters of every twelve bits.
constexpr auto kPairs = [] {
  std::array<std::array<char, 2>, 4096> pairs{};
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {kAlphabet[i >> 6U], kAlphabet[i & 63U]};
  return pairs;
}();

}  // namespace

void appendBase64(std::string& text, std::string_view bytes) {
  const std::size_t before = text.size();
  text.resize(before + (bytes.size() + 2) / 3 * 4);
  char* out = text.data() + before;
  const auto* in = reinterpret_cast<const unsigned char*>(bytes.data());
  const std::size_t whole = bytes.size() / 3 * 3;
  for (std::size_t i = 0; i < whole; i += 3, out += 4) {
    const std::uint32_t bits = std::uint32_t{in[i]} << 16U | std::uint32_t{in[i + 1]} << 8U | in[i + 2];
    const auto& high = kPairs[bits >> 12U];
    const auto& low = kPairs[bits & 4095U];
    out[0] = high[0];
    out[1] = high[1];
    out[2] = low[0];
    out[3] = low[1];
  }
  const std::size_t left = bytes.size() - whole;
  if (left == 0) return;
  const std::uint32_t bits = std::uint32_t{in[whole]} << 16U | (left == 2 ? std::uint32_t{in[whole + 1]} << 8U : 0U);
  out[0] = kAlphabet[bits >> 18U];
  out[1] = kAlphabet[bits >> 12U & 63U];
  out[2] = left == 2 ? kAlphabet[bits >> 6U & 63U] : '=';
  out[3] = '=';
}

std::string scriptSafe(std::string_view json) {
  std::string safe;
  safe.reserve(json.size());
  for (const char letter : json) {
    switch (letter) {
      case '<':
        safe += "\\u003c";
        break;
      case '>':
        safe += "\\u003e";
        break;
      case '&':
        safe += "\\u0026";
        break;
      default:
        safe += letter;
    }
  }
  return safe;
}

}  // namespace mouthpiece
