#pragma once

#include <Eigen/Core>
#include <array>
#include <concepts>
#include <cstdint>
#include <vector>

#include "base/index.h"

namespace mouthpiece {

/// A small count in single precision; exact up to 2^24.
constexpr float asFloat(std::integral auto n) { return static_cast<float>(n); }
/// The whole part of a real number, for Eigen; towards zero.
constexpr Eigen::Index wholePart(std::floating_point auto x) { return static_cast<Eigen::Index>(x); }

/// vertices x 3, in the mesh's own unit.
using VertexPositions = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Triangle = std::array<std::uint32_t, 3>;

/// A vertex in double precision.
inline Eigen::Vector3d pointAt(const VertexPositions& vertices, std::integral auto vertex) {
  const Eigen::Index row = signedIndex(vertex);
  return vertices.row(row).transpose().cast<double>();
}

/// Adds to each corner twice its triangles' areas times their normals. `sums`: vertices x 3.
void addNormals(const VertexPositions& vertices, const std::vector<Triangle>& triangles, VertexPositions& sums);

/// Area-weighted unit normals, vertices x 3 (zero where a vertex has no triangle).
VertexPositions vertexNormals(const VertexPositions& vertices, const std::vector<Triangle>& triangles);

}  // namespace mouthpiece
