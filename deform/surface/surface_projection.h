#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deform/surface/bezier_surface.h"

namespace mouthpiece {

/// Of the mouth's width: skin no further behind the surface than this has no other skin before it.
inline constexpr double kSkinLayer = 0.03;

/// The nearest place on a surface, and how far off.
struct SurfaceFoot {
  SurfacePlace place;
  double distance = 0;
  bool at_border = false;  ///< on an edge that only one triangle has
};

/// Finds closest points on the rest pose of a surface, on the Bezier patches themselves.
class SurfaceProjector {
 public:
  /// `triangle_marks`: bits a triangle; a query can leave out triangles by bit.
  SurfaceProjector(const BezierSurface& surface, const ControlMesh& mesh, std::vector<std::uint32_t> triangle_marks);

  /// Nearest place whose triangle has none of the `forbidden` bits and whose normal has at least `least_cosine` with
  /// `normal`. A zero normal fits everywhere.
  [[nodiscard]] std::optional<SurfaceFoot> closest(const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                                                   double least_cosine, std::uint32_t forbidden) const;

 private:
  static constexpr int kLattice = 4;  ///< samples along a patch's edge, less one
  static constexpr int kSamples = (kLattice + 1) * (kLattice + 2) / 2;
  /// Places of a patch, the last one twice, and the normals there: a row each.
  struct Samples {
    Eigen::Array<float, kSamples + 1, 3> position, normal;
  };
  const BezierSurface::Pose& patches_;
  std::vector<std::uint32_t> marks_;
  std::vector<std::array<bool, 3>> border_;  ///< a triangle's edge from corner k to k + 1 has no neighbour
  std::vector<Samples> samples_;             ///< a patch each
  /// A ball a patch that all its samples lie in: x, y, z of its centre, and its radius.
  Eigen::ArrayX4f balls_;
};

/// Which of `points` (x y) lie within what the markers span, seen from the front: their convex hull.
std::vector<bool> withinOutline(const MarkerPositions& markers, const Eigen::MatrixX2d& points);

}  // namespace mouthpiece
