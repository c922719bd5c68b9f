#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/json_fields.h"
#include "base/json_text.h"
#include "exports/shapes/principal_shapes.h"

namespace mouthpiece {

struct FaceMesh;

/// A matrix' numbers row by row, as floats: what corpus files hold.
nlohmann::json floatsOf(const auto& matrix) {
  const RowMajorMatrixF floats = matrix.template cast<float>();
  return blobOf(std::vector<float>(floats.data(), floats.data() + floats.size()));
}
/// Rows of `columns` numbers of which none is farther from 0 than kLargestPacked, or NaN where that is allowed. Throws
/// InputError.
RowMajorMatrixF floatsFrom(const JsonField& field, Eigen::Index columns, bool nan_allowed = false);
inline constexpr double kLargestPacked = 1e9;

std::size_t vertexCountOf(const FaceMesh& mesh);

}  // namespace mouthpiece
