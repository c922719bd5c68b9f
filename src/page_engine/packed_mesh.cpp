#include "page_engine/packed_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "base/index.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

RowMajorMatrixF floatsFrom(const JsonField& field, Eigen::Index columns, bool nan_allowed) {
  const std::vector<float> values = field.blob<float>();
  const auto size = signedIndex(values.size());
  if (columns == 0 || size % columns != 0)
    field.fail(fmt::format("found {} numbers; expected rows of {}", size, columns));
  for (const float value : values) {
    if (!(std::abs(value) <= kLargestPacked) && !(nan_allowed && std::isnan(value)))
      field.fail("found a number that is not usable");
  }
  return Eigen::Map<const RowMajorMatrixF>(values.data(), size / columns, columns);
}

std::size_t vertexCountOf(const FaceMesh& mesh) { return mesh.vertexCount(); }

}  // namespace mouthpiece
