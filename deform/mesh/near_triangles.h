#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Nearest places on triangles that face a vertex; the triangles are sorted by x so that few are looked at. Refers to
/// the vertices and triangles it was made of.
class NearTriangles {
 public:
  struct Nearest {
    const Triangle* triangle;
    Eigen::Vector3f weights;  ///< of its corners
  };

  /// Sees no further than `reach`.
  NearTriangles(const VertexPositions& vertices, const std::vector<Triangle>& triangles, float reach);

  [[nodiscard]] std::optional<Nearest> facing(const Eigen::Vector3f& p, const Eigen::Vector3f& normal) const;

  /// From the plane of the nearest triangle that faces `p`; 0 where there is none.
  [[nodiscard]] float distance(const Eigen::Vector3f& p, const Eigen::Vector3f& normal) const;

 private:
  struct Entry {
    Eigen::Vector3f centre, normal;
    float radius;
    const Triangle* triangle;
  };
  const VertexPositions& vertices_;
  float reach_, largest_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace mouthpiece
