#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "deform/mesh/triangles.h"

namespace mouthpiece {

/// Where triangles are: closest points, those in a box, those over a place (CGAL's tree of boxes). Triangles without
/// area are not in it.
class TriangleTree {
 public:
  enum class Use { kAll, kWithoutStarts };
  /// `triangles`: rows of `vertices`. Keeps copies of both. kWithoutStarts: made in half the time, for boxes and ways,
  /// or for closest points that are told where to begin; others take several times as long.
  TriangleTree(const VertexPositions& vertices, std::span<const Triangle> triangles, Use use = Use::kAll);
  TriangleTree(TriangleTree&&) noexcept;
  ~TriangleTree();

  [[nodiscard]] bool empty() const;

  struct Foot {
    Eigen::Vector3d point;
    std::size_t triangle;     ///< of those given
    Eigen::Vector3d weights;  ///< of its corners
  };
  /// The closest point; nullopt where no triangle is nearer than `within`. `begin_at`: a place on one of them that is
  /// near.
  [[nodiscard]] std::optional<Foot> closest(const Eigen::Vector3d& point, const Foot* begin_at = nullptr,
                                            double within = std::numeric_limits<double>::infinity()) const;

  /// Numbers of the triangles whose boxes touch `box`, rising.
  [[nodiscard]] std::vector<std::size_t> touching(const Eigen::AlignedBox3d& box) const;

  /// Whether a triangle lies across the straight way between two places.
  [[nodiscard]] bool isBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

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
