#include "base/json_text.h"

#include <nlohmann/json.hpp>

namespace mouthpiece {

std::string jsonText(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}
std::string jsonText(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string cborBytes(const nlohmann::json& value) {
  std::string bytes;
  nlohmann::json::to_cbor(value, bytes);
  return bytes;
}

nlohmann::json blobOf(const RawNumbers& numbers) {
  return nlohmann::json::binary({numbers.bytes.begin(), numbers.bytes.end()});
}

nlohmann::json looseJson(std::string_view text) { return nlohmann::json::parse(text, nullptr, false); }
nlohmann::ordered_json looseOrderedJson(std::string_view text) {
  return nlohmann::ordered_json::parse(text, nullptr, false);
}

}  // namespace mouthpiece
