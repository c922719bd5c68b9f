#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/moving_triangles.h"

namespace mouthpiece {

/// A place on a triangle of the mesh.
struct LipPoint {
  Triangle triangle;
  Eigen::Vector3d weights;
  std::size_t column;
  std::size_t across = 0;  ///< of LipContact::overlaps
  double way = 0.5;        ///< from the right corner to the left one
};

Eigen::Vector3d placeOf(const LipPoint& point, const VertexPositions& vertices);

/// One surface of the mouth: triangles, which lies over each of their edges, and which are around each vertex.
struct LipSurface {
  static constexpr std::int32_t kNone = -1;
  std::vector<Triangle> triangles;
  std::vector<std::array<std::int32_t, 3>> over;  ///< edge opposite of corner k; kNone: the surface ends there
  std::unordered_map<std::uint32_t, std::vector<std::size_t>> around;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;  ///< edges where the head's own skin ends
  MovingTriangles tree;

  /// Finds the rest of it for `triangles`.
  void settle(const VertexPositions& rest);
};

struct MeasuredLip {
  LipSurface surface;
  std::vector<Triangle> near;  ///< of these those that reach no further than lips do
  std::vector<LipPoint> points;
};

/// Where a surface faces, between its triangles, too.
class LipFacing {
 public:
  LipFacing(const LipSurface& surface, const VertexPositions& vertices);
  [[nodiscard]] Eigen::Vector3d at(const LipPoint& point) const { return placeOf(point, at_corners_).normalized(); }

 private:
  VertexPositions at_corners_;
};

/// A surface in a pose: distances from it, below zero inside. Inside is what lies behind all triangles around the
/// closest place: right beside sharp rims of coarse lips, too, and where a sliver has folded over.
class PosedLipSurface {
 public:
  PosedLipSurface(const LipSurface& surface, const VertexPositions& vertices)
      : surface_(surface), vertices_(vertices), tree_(surface.tree, vertices) {}

  /// nullopt where no triangle is within `within`; NaN where the nearest place is one of `own`, the triangle that `p`
  /// lies on. `facing`: the normal there; inside is only what faces the other way, as the folds of one lip do not.
  /// `least_cosine`: between the way there and its normal, for what is thin.
  [[nodiscard]] std::optional<double> signedDistance(const Eigen::Vector3d& p, const Triangle& own,
                                                     const Eigen::Vector3d& facing, double within, double least_cosine);

  /// Whether the surface lies around `p`, by the winding number of surfaces that are open (Jacobson et al. 2013) and
  /// the solid angles of its triangles (Van Oosterom and Strackee 1983): behind the nearest place there may be a fold.
  [[nodiscard]] bool surrounds(const Eigen::Vector3d& p) const;

  /// How deep the place that signedDistance() looked at last is in what the surface bounds, told to be `depth` behind
  /// it: beside an end of the surface no deeper than that has passed.
  [[nodiscard]] double depthOfLast(double depth) const;

 private:
  const LipSurface& surface_;
  const VertexPositions& vertices_;
  MovingTriangles::Posed tree_;
  std::optional<TriangleTree::Foot> last_;  ///< one place's foot is near the last one's
};

}  // namespace mouthpiece
