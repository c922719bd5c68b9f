#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// Where triangles are: closest points, those in a box, those over a place (CGAL's tree of boxes). Triangles without
/// area are not in it.
class TriangleTree {
 public:
  /// `triangles`: rows of `vertices`. Keeps copies of both.
  TriangleTree(const VertexPositions& vertices, std::span<const Triangle> triangles);
  TriangleTree(TriangleTree&&) noexcept;
  ~TriangleTree();

  [[nodiscard]] bool empty() const;

  struct Foot {
    Eigen::Vector3d point;
    std::size_t triangle;     ///< of those given
    Eigen::Vector3d weights;  ///< of its corners
  };
  /// The closest point; nullopt when there are no triangles.
  [[nodiscard]] std::optional<Foot> closest(const Eigen::Vector3d& point) const;

  /// Numbers of the triangles whose boxes touch `box`, rising.
  [[nodiscard]] std::vector<std::size_t> touching(const Eigen::AlignedBox3d& box) const;

  struct Crossing {
    std::size_t triangle;
    double height;
  };
  /// The triangles straight over and under the place (x, z) and how high they are there along y. Of two triangles that
  /// share an edge one counts.
  [[nodiscard]] std::vector<Crossing> crossings(double x, double z) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace mouthpiece
