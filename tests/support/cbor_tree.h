#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>

#include "base/json_text.h"

namespace mouthpiece::test {

/// What cborBytes() wrote, with its long blobs where they belong.
inline nlohmann::json cborTree(std::string_view bytes) {
  std::string_view blobs;
  if (bytes.starts_with(kCborBlobsType)) {
    std::size_t length = 0;
    for (const char byte : bytes.substr(1, 8)) length = length << 8 | static_cast<std::uint8_t>(byte);
    blobs = bytes.substr(9, length);
    bytes.remove_prefix(9 + length);
  }
  nlohmann::json tree = nlohmann::json::from_cbor(bytes);
  const auto putBack = [&](const auto& self, nlohmann::json& node) -> void {
    if (node.is_object() && node.size() == 2 && node.contains("at") && node.contains("bytes")) {
      const std::string_view blob = blobs.substr(node["at"], node["bytes"]);
      node = nlohmann::json::binary({blob.begin(), blob.end()});
    } else if (node.is_structured()) {
      for (nlohmann::json& entry : node) self(self, entry);
    }
  };
  putBack(putBack, tree);
  return tree;
}

}  // namespace mouthpiece::test
