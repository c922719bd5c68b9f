#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>

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

}  // namespace mouthpiece
