#include "base/json_text.h"

#include <nlohmann/json.hpp>

namespace mouthpiece {

std::string jsonText(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}
std::string jsonText(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

/// Moves the long byte strings in `node` to the end of `blobs`, and leaves their place there behind.
void takeOutBlobs(nlohmann::json& node, std::string& blobs) {
  constexpr std::size_t kLong = 1024;
  if (node.is_binary() && node.get_binary().size() >= kLong) {
    const auto& bytes = node.get_binary();
    nlohmann::json place{{"at", blobs.size()}, {"bytes", bytes.size()}};
    blobs.append(bytes.begin(), bytes.end());
    node = std::move(place);
  } else if (node.is_structured()) {
    for (nlohmann::json& entry : node) takeOutBlobs(entry, blobs);
  }
}

}  // namespace

std::string cborBytes(nlohmann::json value) {
  std::string blobs;
  takeOutBlobs(value, blobs);
  std::string bytes;
  if (!blobs.empty()) {
    bytes += kCborBlobsType;
    for (int shift = 56; shift >= 0; shift -= 8) bytes += static_cast<char>(std::uint64_t{blobs.size()} >> shift);
    bytes += blobs;
  }
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
