#include "base/page_data.h"

#include <openssl/evp.h>

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// The two letters of every twelve bits.
constexpr auto kPairs = [] {
  std::array<std::array<char, 2>, 4096> pairs{};
  for (std::size_t i = 0; i < pairs.size(); ++i) pairs[i] = {kAlphabet[i >> 6U], kAlphabet[i & 63U]};
  return pairs;
}();

constexpr std::string_view kCharset = "<meta charset=\"utf-8\">", kScript = "<script>", kScriptEnd = "</script>";

std::string hashSource(std::string_view script) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  MOUTHPIECE_EXPECT(EVP_Digest(script.data(), script.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1);
  std::string source = " 'sha256-";
  appendBase64(source, {reinterpret_cast<const char*>(digest.data()), size});
  return source + "'";
}

}  // namespace

std::string closedPage(std::string_view page) {
  std::string scripts;
  for (std::size_t at = page.find(kScript); at != std::string_view::npos; at = page.find(kScript, at)) {
    at += kScript.size();
    const std::size_t end = page.find(kScriptEnd, at);
    MOUTHPIECE_EXPECT(end != std::string_view::npos);
    scripts += hashSource(page.substr(at, end - at));
  }
  const std::size_t at = page.find(kCharset);
  MOUTHPIECE_EXPECT(at != std::string_view::npos);
  std::string closed(page.substr(0, at + kCharset.size()));
  closed += "\n<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src" + scripts +
            "; style-src 'unsafe-inline'; img-src data: blob:; media-src data: blob:; connect-src data: blob:; "
            "base-uri 'none'; form-action 'none'\">";
  return closed.append(page.substr(at + kCharset.size()));
}

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

std::string scriptJson(const nlohmann::json& value) {
  return scriptSafe(value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}
std::string scriptJson(const nlohmann::ordered_json& value) {
  return scriptSafe(value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace));
}

}  // namespace mouthpiece
