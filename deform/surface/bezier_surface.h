#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "deform/surface/bezier_patch.h"
#include "deform/surface/clough_tocher.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// A place on the surface of a control mesh: triangle, and weights of its first and second corner.
struct SurfacePlace {
  int triangle = -1;
  double u = 0;
  double v = 0;
};

struct SurfaceOptions {
  /// How much the surface keeps to the flat triangles of its control mesh (0: bends least; larger: overshoots less).
  double tension = 1;
};

/// The Bezier surface through all points of a control mesh: three cubic Bezier triangles over each triangle, one
/// tangent plane along every edge in every pose. The slopes at the points are those that bend the surface least, a
/// fixed linear map of the points: one sparse system, factored once.
class BezierSurface {
 public:
  using Patch = CubicPatch<Eigen::Vector3d>;
  /// One pose: patch 3 t + k lies over triangle t between its corners k, k + 1 and its centroid.
  using Pose = std::vector<Patch>;

  explicit BezierSurface(const ControlMesh& mesh, const SurfaceOptions& options = {});

  [[nodiscard]] Pose pose(const MarkerPositions& control_points) const;
  [[nodiscard]] const Pose& restPose() const { return rest_pose_; }

  /// The slopes' answer to displaced points (points x columns), linear in them, 2 points x columns: rows 2 i and
  /// 2 i + 1 are the derivatives of the displacement along the plane's axes at point i. Zero for fixed points.
  [[nodiscard]] Eigen::MatrixXd slopesFrom(const Eigen::MatrixXd& displacements) const;
  [[nodiscard]] const std::vector<CloughTocher<double>>& splits() const { return splits_; }

  /// Largest angle between the unit normals on both sides of inner edges (of triangles and of their splits), degrees;
  /// `samples` points an edge, its ends included.
  [[nodiscard]] double maxNormalAngleAcrossEdges(const Pose& pose, int samples = 33) const;

 private:
  [[nodiscard]] Pose netsOf(const MarkerPositions& values, const MarkerPositions& slopes) const;

  struct Slopes;

  std::vector<std::array<int, 3>> triangles_;
  std::vector<CloughTocher<double>> splits_;
  MarkerPositions rest_;
  std::shared_ptr<const Slopes> slopes_;
  Pose rest_pose_;
};

/// The patch of `place` and the weights within it.
struct PatchPlace {
  std::size_t patch = 0;
  double u = 0;
  double v = 0;
};
PatchPlace patchPlace(const SurfacePlace& place);

/// The value at `place` as a form in its triangle's values and slopes.
TriangleForm formAt(const BezierSurface& surface, const SurfacePlace& place);

/// A point that the surface should pass at a place.
struct SurfaceSample {
  SurfacePlace place;
  Eigen::Vector3d position;
  double weight = 1;
};

/// Slopes at rest (ControlMesh::rest_slopes) that bring the surface through the control points near to the samples and
/// otherwise bend it least.
MarkerPositions slopesNear(const ControlMesh& mesh, const std::vector<SurfaceSample>& samples,
                           const SurfaceOptions& options = {});

inline SurfacePoint evaluate(const BezierSurface::Pose& pose, const SurfacePlace& place) {
  const PatchPlace at = patchPlace(place);
  return evaluate(pose[at.patch], at.u, at.v);
}

}  // namespace mouthpiece
