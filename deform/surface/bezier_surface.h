#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <vector>

#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// Where b300, b210, b201, b120, b111, b102, b030, b021, b012, b003 stand in a net.
enum CubicNet : std::size_t { k300, k210, k201, k120, k111, k102, k030, k021, k012, k003 };

/// A point of a surface and its tangents towards growing u and v (w = 1 - u - v gives way).
struct SurfacePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Vector3d du = Eigen::Vector3d::Zero();
  Eigen::Vector3d dv = Eigen::Vector3d::Zero();

  /// Unit normal; the tangent plane's right-hand side for u towards v.
  [[nodiscard]] Eigen::Vector3d normal() const { return du.cross(dv).normalized(); }
};

/// A cubic Bezier triangle: sum of 3!/(i!j!k!) u^i v^j w^k b_ijk.
template <typename Point>
struct CubicPatch {
  std::array<Point, 10> net;

  /// The three quadratics whose blend u a + v b + w c is the patch (first step of de Casteljau).
  struct Halves {
    Point a, b, c;
  };
  [[nodiscard]] Halves halves(double u, double v) const {
    const double w = 1 - u - v;
    const double uu = u * u, vv = v * v, ww = w * w, uv = 2 * u * v, uw = 2 * u * w, vw = 2 * v * w;
    const auto& b = net;
    return {uu * b[k300] + uv * b[k210] + uw * b[k201] + vv * b[k120] + vw * b[k111] + ww * b[k102],
            uu * b[k210] + uv * b[k120] + uw * b[k111] + vv * b[k030] + vw * b[k021] + ww * b[k012],
            uu * b[k201] + uv * b[k111] + uw * b[k102] + vv * b[k021] + vw * b[k012] + ww * b[k003]};
  }
};

inline SurfacePoint evaluate(const CubicPatch<Eigen::Vector3d>& patch, double u, double v) {
  const auto [a, b, c] = patch.halves(u, v);
  return {u * a + v * b + (1 - u - v) * c, 3 * (a - c), 3 * (b - c)};
}

/// Clough and Tocher's split of a triangle of the plane: three cubics that meet at its centroid, given value and
/// gradient at the corners. Neighbours share value and gradient all along their edge, so the surface over the plane has
/// one tangent plane everywhere, in every pose. docs/theory/deform/bezier_deformation.md derives it.
template <typename Scalar>
struct CloughTocher {
  using Plane = Eigen::Matrix<Scalar, 2, 1>;

  std::array<Plane, 3> edge;     ///< a third of the way from corner i to corner i + 1
  std::array<Plane, 3> inward;   ///< a third of the way from corner i to the centroid
  std::array<Scalar, 3> foot{};  ///< where the centroid's perpendicular meets the edge from i to i + 1, [0, 1] along it

  CloughTocher() = default;
  explicit CloughTocher(const std::array<Eigen::Vector2d, 3>& corners) {
    const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2]) / 3;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2d along = corners[(i + 1) % 3] - corners[i];
      edge[i] = (along / 3).cast<Scalar>();
      inward[i] = ((middle - corners[i]) / 3).cast<Scalar>();
      foot[i] = Scalar((middle - corners[i]).dot(along) / along.squaredNorm());
    }
  }

  /// nets[k] is the patch over corners k, k + 1 and the centroid. Linear in everything given.
  template <typename Point>
  void nets(const std::array<Point, 3>& value, const std::array<Point, 3>& gx, const std::array<Point, 3>& gy,
            std::array<CubicPatch<Point>, 3>& out) const {
    std::array<Point, 3> forth, back, in, mid;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      forth[i] = value[i] + edge[i].x() * gx[i] + edge[i].y() * gy[i];
      back[i] = value[j] - edge[i].x() * gx[j] - edge[i].y() * gy[j];
      in[i] = value[i] + inward[i].x() * gx[i] + inward[i].y() * gy[i];
    }
    for (std::size_t i = 0; i < 3; ++i) {
      // The derivative across the edge runs linearly from one corner to the other.
      const std::size_t j = (i + 1) % 3;
      const Scalar near = 1 - foot[i];
      const Point first = in[i] - near * value[i] - foot[i] * forth[i];
      const Point last = in[j] - near * back[i] - foot[i] * value[j];
      mid[i] = near * forth[i] + foot[i] * back[i] + Scalar(0.5) * (first + last);
    }
    const Scalar third = Scalar(1) / Scalar(3);
    std::array<Point, 3> deep;
    for (std::size_t i = 0; i < 3; ++i) deep[i] = third * (in[i] + mid[i] + mid[(i + 2) % 3]);
    const Point centre = third * (deep[0] + deep[1] + deep[2]);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      out[i].net = {value[i], forth[i], in[i], back[i], mid[i], deep[i], value[j], in[j], deep[j], centre};
    }
  }
};

/// A linear form in a triangle's nine numbers: values at the corners, then the slopes along x and y at each corner.
using TriangleForm = Eigen::Matrix<double, 9, 1>;

/// The three patches as forms: their points for any values and slopes.
inline std::array<CubicPatch<TriangleForm>, 3> patchForms(const CloughTocher<double>& split) {
  std::array<TriangleForm, 3> value, gx, gy;
  for (std::size_t i = 0; i < 3; ++i) {
    value[i] = TriangleForm::Unit(signedIndex(i));
    gx[i] = TriangleForm::Unit(signedIndex(3 + 2 * i));
    gy[i] = TriangleForm::Unit(signedIndex(4 + 2 * i));
  }
  std::array<CubicPatch<TriangleForm>, 3> patches;
  split.nets(value, gx, gy, patches);
  return patches;
}

/// A place on the surface of a control mesh: triangle, and weights of its first and second corner.
struct SurfacePlace {
  int triangle = -1;
  double u = 0;
  double v = 0;
};

/// The Bezier surface through all points of a control mesh: three cubic Bezier triangles over each triangle, one
/// tangent plane along every edge in every pose. The slopes at the points are those that bend the surface least, a
/// fixed linear map of the points: one sparse system, factored once.
class BezierSurface {
 public:
  using Patch = CubicPatch<Eigen::Vector3d>;
  /// One pose: patch 3 t + k lies over triangle t between its corners k, k + 1 and its centroid.
  using Pose = std::vector<Patch>;

  explicit BezierSurface(const ControlMesh& mesh);

  [[nodiscard]] Pose pose(const MarkerPositions& control_points) const;
  [[nodiscard]] const Pose& restPose() const { return rest_pose_; }

  /// The slopes' answer to displaced points (points x columns), linear in them, 2 points x columns: rows 2 i and
  /// 2 i + 1 are the derivatives of the displacement along the plane's axes at point i. Zero for fixed points.
  [[nodiscard]] Eigen::MatrixXd slopesFrom(const Eigen::MatrixXd& displacements) const;
  [[nodiscard]] const std::vector<CloughTocher<double>>& splits() const { return splits_; }

  /// Largest angle between the unit normals on both sides of inner edges (of triangles and of their splits), degrees;
  /// `samples` points an edge, its ends included: along an edge normals are of degree four.
  [[nodiscard]] double maxNormalAngleAcrossEdges(const Pose& pose, int samples = 9) const;

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
MarkerPositions slopesNear(const ControlMesh& mesh, const std::vector<SurfaceSample>& samples);

inline SurfacePoint evaluate(const BezierSurface::Pose& pose, const SurfacePlace& place) {
  const PatchPlace at = patchPlace(place);
  return evaluate(pose[at.patch], at.u, at.v);
}

}  // namespace mouthpiece
