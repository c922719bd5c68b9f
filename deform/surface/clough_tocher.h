#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

#include "deform/surface/bezier_patch.h"

namespace mouthpiece {

/// Clough and Tocher's split of a triangle of the plane: three cubics that meet at its centroid, given value and
/// gradient at the corners. Neighbours share value and gradient all along their edge, so the surface over the plane has
/// one tangent plane everywhere, in every pose. docs/theory/bezier_deformation.md derives it.
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
      foot[i] = static_cast<Scalar>((middle - corners[i]).dot(along) / along.squaredNorm());
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
  for (int i = 0; i < 3; ++i) {
    value[static_cast<std::size_t>(i)] = TriangleForm::Unit(i);
    gx[static_cast<std::size_t>(i)] = TriangleForm::Unit(3 + 2 * i);
    gy[static_cast<std::size_t>(i)] = TriangleForm::Unit(4 + 2 * i);
  }
  std::array<CubicPatch<TriangleForm>, 3> patches;
  split.nets(value, gx, gy, patches);
  return patches;
}

}  // namespace mouthpiece
