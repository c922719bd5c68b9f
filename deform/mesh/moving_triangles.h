#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "deform/mesh/triangle_tree.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// Closest points on triangles that move: which ones a box of the tree holds is found once, at rest, and in each pose
/// the boxes are fitted to them anew, which takes a fraction of what making a TriangleTree does. Slower the more the
/// triangles part from their neighbours.
class MovingTriangles {
 public:
  MovingTriangles() = default;
  /// `triangles`: rows of `rest`.
  MovingTriangles(const VertexPositions& rest, const std::vector<Triangle>& triangles);

  /// They where `vertices` are. Triangles without area are not in it.
  class Posed {
   public:
    Posed(const MovingTriangles& tree, const VertexPositions& vertices);
    /// As TriangleTree::closest.
    [[nodiscard]] std::optional<TriangleTree::Foot> closest(const Eigen::Vector3d& point,
                                                            const TriangleTree::Foot* begin_at, double within) const;

   private:
    struct Facet {
      Eigen::Vector3d a, ab, ac;
      bool has_area;
    };
    const MovingTriangles& tree_;
    std::vector<Facet> facets_;               ///< as tree_.order_
    std::vector<Eigen::AlignedBox3d> boxes_;  ///< of each node
  };

 private:
  struct Node {
    std::uint32_t first, count;  ///< of order_
    std::uint32_t right;         ///< number of the second child, the first one follows its parent; 0: a leaf
  };
  std::uint32_t grow(const std::vector<Eigen::Vector3d>& middles, std::uint32_t first, std::uint32_t count);

  std::vector<Triangle> triangles_;
  std::vector<std::uint32_t> order_;  ///< of triangles_, so that those of a node follow each other
  std::vector<Node> nodes_;           ///< parents before their children
};

}  // namespace mouthpiece
