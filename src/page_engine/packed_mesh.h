#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/json_fields.h"
#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

struct FaceMesh;

/// CBOR bytes of numbers, little-endian, as JsonField::blob() reads them.
template <typename Scalar>
nlohmann::json blobOf(const std::vector<Scalar>& values) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  return nlohmann::json::binary({bytes, bytes + values.size() * sizeof(Scalar)});
}

/// A matrix' numbers row by row, as floats: what corpus files hold.
nlohmann::json floatsOf(const auto& matrix) {
  const RowMajorMatrixF floats = matrix.template cast<float>();
  return blobOf(std::vector<float>(floats.data(), floats.data() + floats.size()));
}
/// Rows of `columns` numbers of which none is farther from 0 than kLargestPacked, or NaN where that is allowed. Throws
/// InputError.
RowMajorMatrixF floatsFrom(const JsonField& field, Eigen::Index columns, bool nan_allowed = false);
inline constexpr double kLargestPacked = 1e9;

/// What of a mesh moves: its vertices, triangles, the kinds of its parts, its unit.
nlohmann::json meshToJson(const FaceMesh& mesh);
/// Throws InputError for triangles and parts that do not fit together.
std::shared_ptr<const FaceMesh> meshFrom(const JsonField& field);
std::size_t vertexCountOf(const FaceMesh& mesh);

}  // namespace mouthpiece
