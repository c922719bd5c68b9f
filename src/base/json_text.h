#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "base/index.h"

namespace mouthpiece {

// What each source would else make anew out of the library's templates; bytes from outside are read by json_fields.h.

/// JSON of `value`, `indent` spaces a level or (-1) on one line. What is no UTF-8 in its strings becomes U+FFFD.
std::string jsonText(const nlohmann::json& value, int indent = -1);
std::string jsonText(const nlohmann::ordered_json& value, int indent = -1);

/// How a byte string begins whose length follows in eight bytes (RFC 8949, 3.1).
inline constexpr char kCborBlobsType = '\x5B';
/// CBOR of `value`. Byte strings of 1 kB or more come first, all in one (a CBOR sequence, RFC 8742), and
/// `{at: FIRST, bytes: COUNT}` stands in their place: so parseCbor() copies none; the library reads them byte by byte.
std::string cborBytes(nlohmann::json value);

/// A vector's or matrix' numbers as they lie in memory.
struct RawNumbers {
  RawNumbers(const auto& values)  // NOLINT(google-explicit-constructor)
      : bytes(reinterpret_cast<const std::uint8_t*>(values.data()),
              unsignedIndex(values.size()) * sizeof(*values.data())) {}
  std::span<const std::uint8_t> bytes;
};
/// CBOR bytes, as JsonField::blob() reads them.
nlohmann::json blobOf(const RawNumbers& numbers);

/// The value that `text` holds; is_discarded() where that is no JSON.
nlohmann::json looseJson(std::string_view text);
/// The same, keys in the text's order.
nlohmann::ordered_json looseOrderedJson(std::string_view text);

}  // namespace mouthpiece
