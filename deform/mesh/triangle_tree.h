#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Closest points on some triangles (CGAL's tree of boxes).
class SkinTree {
 public:
  /// `triangles`: rows of `vertices`.
  SkinTree(const VertexPositions& vertices, const std::vector<Triangle>& triangles);
  SkinTree(SkinTree&&) noexcept;
  ~SkinTree();

  [[nodiscard]] bool empty() const;
  /// nullopt when there are no triangles.
  [[nodiscard]] std::optional<Eigen::Vector3d> closest(const Eigen::Vector3d& point) const;
  struct Foot {
    Eigen::Vector3d point;
    std::size_t triangle;  ///< of those given
  };
  [[nodiscard]] std::optional<Foot> closestFoot(const Eigen::Vector3d& point) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace mouthpiece
