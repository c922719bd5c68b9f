#include "retarget/rig/lip_surfaces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

constexpr double kOpposed = -0.3;  ///< cosine between two surfaces that meet
/// Winding number of a lip's open surface about what is in its flesh: 0.2 to 0.9; in the mouth beyond a fold it is
/// -0.1.
constexpr double kInFlesh = 0.1;
/// Of a sheet that passes another by a little beside its end, the other one is no deeper in it than so many times what
/// has passed.
constexpr double kPassed = 2;
constexpr double kOnBorder = 1e-9;  ///< a weight below this: the closest point lies on the opposite edge

Eigen::Vector3d normalOf(const Triangle& t, const VertexPositions& vertices) {
  const Eigen::Vector3d a = pointAt(vertices, t[0]);
  return (pointAt(vertices, t[1]) - a).cross(pointAt(vertices, t[2]) - a).normalized();
}

}  // namespace

Eigen::Vector3d placeOf(const LipPoint& point, const VertexPositions& vertices) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    p += point.weights[signedIndex(k)] * pointAt(vertices, point.triangle[k]);
  }
  return p;
}

void LipSurface::settle(const VertexPositions& rest) {
  tree = MovingTriangles(rest, triangles);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<std::size_t, std::size_t>> first;
  over.assign(triangles.size(), {kNone, kNone, kNone});
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      around[triangles[t][k]].push_back(t);
      const auto [at, is_new] =
          first.try_emplace(std::minmax(triangles[t][(k + 1) % 3], triangles[t][(k + 2) % 3]), t, k);
      if (is_new) continue;
      const auto [other, its_edge] = at->second;
      over[t][k] = static_cast<std::int32_t>(other);
      over[other][its_edge] = static_cast<std::int32_t>(t);
    }
  }
}

LipFacing::LipFacing(const LipSurface& surface, const VertexPositions& vertices)
    : at_corners_(VertexPositions::Zero(vertices.rows(), 3)) {
  for (const Triangle& t : surface.triangles) {
    const std::array<Eigen::Vector3d, 3> p{pointAt(vertices, t[0]), pointAt(vertices, t[1]), pointAt(vertices, t[2])};
    const Eigen::Vector3d normal = normalOf(t, vertices);
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d to = (p[(k + 1) % 3] - p[k]).normalized(), from = (p[(k + 2) % 3] - p[k]).normalized();
      const double angle = std::acos(std::clamp(to.dot(from), -1.0, 1.0));
      at_corners_.row(t[k]) += (angle * normal).cast<float>().transpose();
    }
  }
}

std::optional<double> PosedLipSurface::signedDistance(const Eigen::Vector3d& p, const Triangle& own,
                                                      const Eigen::Vector3d& facing, double within,
                                                      double least_cosine) {
  const auto foot = tree_.closest(p, last_ ? &*last_ : nullptr, within);
  if (!foot) return std::nullopt;
  last_ = foot;
  const std::size_t triangle = foot->triangle;
  double in_common = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::find(own.begin(), own.end(), surface_.triangles[triangle][k]) != own.end())
      in_common += foot->weights[signedIndex(k)];
  }
  if (in_common > 1 - kOnBorder) return std::numeric_limits<double>::quiet_NaN();
  const double distance = (p - foot->point).norm();
  std::size_t edges = 0, edge = 0, corner = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (foot->weights[signedIndex(k)] >= kOnBorder) {
      corner = k;
      continue;
    }
    if (surface_.over[triangle][k] == LipSurface::kNone) return distance;
    ++edges;
    edge = k;
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  const auto isBehind = [&](std::size_t t) {
    const Eigen::Vector3d normal = normalOf(surface_.triangles[t], vertices_);
    sum += normal;
    return (p - foot->point).dot(normal) < -least_cosine * distance;
  };
  bool is_inside = isBehind(triangle);
  if (edges == 1) is_inside = is_inside && isBehind(unsignedIndex(surface_.over[triangle][edge]));
  if (edges == 2 && is_inside) {
    const auto& fan = surface_.around.at(surface_.triangles[triangle][corner]);
    is_inside = std::all_of(fan.begin(), fan.end(), isBehind);
  }
  return is_inside && sum.normalized().dot(facing) < kOpposed ? -distance : distance;
}

bool PosedLipSurface::surrounds(const Eigen::Vector3d& p) const {
  double half_angles = 0;
  for (const Triangle& t : surface_.triangles) {
    const Eigen::Vector3d a = pointAt(vertices_, t[0]) - p, b = pointAt(vertices_, t[1]) - p,
                          c = pointAt(vertices_, t[2]) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    half_angles += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return half_angles > kInFlesh * 2 * std::numbers::pi;
}

double PosedLipSurface::depthOfLast(double depth) const {
  for (const auto& [a, b] : surface_.ends)
    depth = std::min(depth, kPassed * distanceToLine(last_->point, {pointAt(vertices_, a), pointAt(vertices_, b)}));
  return depth;
}

}  // namespace mouthpiece
