#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>

#include "base/index.h"
#include "base/json_fields.h"

namespace mouthpiece {

struct FaceMesh;

/// A vector's or matrix' numbers as they lie in memory.
struct RawNumbers {
  RawNumbers(const auto& values)  // NOLINT(google-explicit-constructor)
      : bytes(reinterpret_cast<const std::uint8_t*>(values.data()),
              unsignedIndex(values.size()) * sizeof(*values.data())) {}
  std::span<const std::uint8_t> bytes;
};
/// CBOR bytes, as JsonField::blob() reads them.
nlohmann::json blobOf(const RawNumbers& numbers);

/// What of a mesh moves: its vertices, triangles, the kinds of its parts, its unit; with `looks` all of it.
nlohmann::json meshToJson(const FaceMesh& mesh, bool looks);
/// Throws InputError for triangles and parts that do not fit together.
std::shared_ptr<const FaceMesh> meshFrom(const JsonField& field);

}  // namespace mouthpiece
