#include "deform/lip_guard.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "deform/lip_sides.h"
#include "deform/vertex_kinds.h"
#include "deform/virtual_points.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

// Lengths as shares of the mouth's width.
constexpr double kReach = 0.12;     ///< a vertex watches what is nearer than this at rest
constexpr double kEase = 0.002;     ///< what is pushed less than this is pushed softly
constexpr double kFarApart = 0.08;  ///< lips further apart everywhere need no guard, which fades in over half of this
constexpr float kLeastLength = 1e-30F;
constexpr float kOpposed = -0.3F;  ///< cosine between surfaces that can meet

Vector3f vertexOf(const VertexPositions& vertices, std::uint32_t v) { return vertices.row(v).transpose(); }

/// Weights of the place of a triangle that is nearest to `p`, sought on a net of 15 places: lips are finer than what
/// that misses.
Vector3f nearestWeights(const Vector3f& p, const std::array<Vector3f, 3>& corners, float& squared) {
  constexpr int kCuts = 4;
  Vector3f best = Vector3f::Zero();
  squared = std::numeric_limits<float>::infinity();
  for (int i = 0; i <= kCuts; ++i) {
    for (int j = 0; i + j <= kCuts; ++j) {
      const Vector3f weights =
          Vector3f(static_cast<float>(i), static_cast<float>(j), static_cast<float>(kCuts - i - j)) /
          static_cast<float>(kCuts);
      const float here =
          (weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2] - p).squaredNorm();
      if (here >= squared) continue;
      squared = here;
      best = weights;
    }
  }
  return best;
}

struct Nearest {
  const Triangle* triangle;
  Vector3f weights;
};

/// Nearest places on triangles that face a vertex; the triangles are sorted by x so that few are looked at.
class NearTriangles {
 public:
  NearTriangles(const VertexPositions& vertices, const std::vector<Triangle>& triangles, float reach)
      : vertices_(vertices), reach_(reach) {
    for (const Triangle& triangle : triangles) {
      const Vector3f a = vertexOf(vertices, triangle[0]), b = vertexOf(vertices, triangle[1]),
                     c = vertexOf(vertices, triangle[2]);
      const Vector3f centre = (a + b + c) / 3;
      const float radius = std::max({(a - centre).norm(), (b - centre).norm(), (c - centre).norm()});
      largest_ = std::max(largest_, radius);
      entries_.push_back({centre, (b - a).cross(c - a).normalized(), radius, &triangle});
    }
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.centre.x() < b.centre.x(); });
  }

  [[nodiscard]] std::optional<Nearest> facing(const Vector3f& p, const Vector3f& normal) const {
    std::optional<Nearest> nearest;
    float least = reach_ * reach_;
    auto entry = std::lower_bound(entries_.begin(), entries_.end(), p.x() - reach_ - largest_,
                                  [](const Entry& e, float x) { return e.centre.x() < x; });
    for (; entry != entries_.end() && entry->centre.x() < p.x() + reach_ + largest_; ++entry) {
      const float gap = (entry->centre - p).norm() - entry->radius;
      if ((gap > 0 && gap * gap >= least) || entry->normal.dot(normal) > kOpposed) continue;
      const Triangle& t = *entry->triangle;
      float squared = 0;
      const Vector3f weights =
          nearestWeights(p, {vertexOf(vertices_, t[0]), vertexOf(vertices_, t[1]), vertexOf(vertices_, t[2])}, squared);
      if (squared >= least) continue;
      least = squared;
      nearest = {&t, weights};
    }
    return nearest;
  }

 private:
  struct Entry {
    Vector3f centre, normal;
    float radius;
    const Triangle* triangle;
  };
  const VertexPositions& vertices_;
  float reach_, largest_ = 0;
  std::vector<Entry> entries_;
};

/// 0 above 0; how far to go back from behind a surface, at first softly.
float pushBack(float distance, float ease) {
  if (distance >= 0) return 0;
  const float behind = -distance;
  return behind < ease ? behind * behind / (2 * ease) : behind - ease / 2;
}

double smooth(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Where a watching vertex is to the plane of the triangle that it watches.
struct Sight {
  float distance;   ///< signed, times the length of `across`
  Vector3f across;  ///< the plane's normal, of any length
};
template <typename Watch>
Sight look(const Watch& watch, const float* out) {
  const auto at = [out](std::uint32_t v) { return Eigen::Map<const Vector3f>(out + 3 * std::size_t{v}); };
  const Vector3f a = at(watch.corners[0]), ab = at(watch.corners[1]) - a, ac = at(watch.corners[2]) - a;
  const Vector3f across = ab.cross(ac);
  return {(at(watch.vertex) - a - watch.weights[0] * ab - watch.weights[1] * ac).dot(across), across};
}

}  // namespace

LipGuard::LipGuard(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding)
    : mouth_width_(control.mouth_width) {
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    const ControlPoint& point = control.points[i];
    if (point.rule == PointRule::kInnerLip && point.side == LipSide::kUpper && point.opposite >= 0)
      rims_.emplace_back(static_cast<int>(i), point.opposite);
  }
  const std::vector<std::uint32_t> sides = triangleSides(control);
  const auto sideOf = [&](std::uint32_t v) {
    return binding.patch[v] < 0 || !(binding.skin_weight[v] > 0) ? 0U
                                                                 : sides[static_cast<std::size_t>(binding.patch[v])];
  };
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  std::vector<Triangle> upper, lower, upper_teeth, lower_teeth;
  std::vector<bool> is_upper(binding.patch.size(), false), is_lower = is_upper;
  for (const MeshPart& part : mesh.parts) {
    const bool is_lip =
        part.kind == PartKind::kSkin || part.kind == PartKind::kLips || part.kind == PartKind::kMouthInside;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      const Triangle& triangle = mesh.triangles[t];
      if (part.kind == PartKind::kUpperTeeth) upper_teeth.push_back(triangle);
      if (part.kind == PartKind::kLowerTeeth) lower_teeth.push_back(triangle);
      if (!is_lip) continue;
      const std::uint32_t side = sideOf(triangle[0]) & sideOf(triangle[1]) & sideOf(triangle[2]);
      if ((side & kUpperLip) != 0) upper.push_back(triangle);
      if ((side & kLowerLip) != 0) lower.push_back(triangle);
      for (const std::uint32_t v : triangle) {
        if ((side & kUpperLip) != 0) is_upper[v] = true;
        if ((side & kLowerLip) != 0) is_lower[v] = true;
      }
    }
  }
  std::vector<std::uint32_t> upper_vertices, lower_vertices;
  for (std::uint32_t v = 0; v < is_upper.size(); ++v) {
    if (is_upper[v] == is_lower[v]) continue;
    (is_upper[v] ? upper_vertices : lower_vertices).push_back(v);
  }
  watchLips(mesh, upper_vertices, lower, normals);
  watchLips(mesh, lower_vertices, upper, normals);
  watchTeeth(mesh, upper_vertices, upper_teeth, normals, false);
  watchTeeth(mesh, lower_vertices, lower_teeth, normals, true);
}

void LipGuard::watchLips(const FaceMesh& mesh, const std::vector<std::uint32_t>& own,
                         const std::vector<Triangle>& other, const VertexPositions& normals) {
  const NearTriangles near(mesh.vertices, other, static_cast<float>(kReach * mouth_width_));
  for (const std::uint32_t v : own) {
    const auto place = near.facing(vertexOf(mesh.vertices, v), vertexOf(normals, v));
    if (!place) continue;
    const Triangle& t = *place->triangle;
    LipWatch watch{v, {t[0], t[1], t[2]}, {place->weights[1], place->weights[2]}, 0};
    const Sight at_rest = look(watch, mesh.vertices.data());
    watch.allowed = std::min(0.0F, at_rest.distance / std::max(at_rest.across.norm(), kLeastLength));
    lips_.push_back(watch);
  }
}

void LipGuard::watchTeeth(const FaceMesh& mesh, const std::vector<std::uint32_t>& own,
                          const std::vector<Triangle>& teeth, const VertexPositions& normals, bool with_jaw) {
  const NearTriangles near(mesh.vertices, teeth, static_cast<float>(kReach * mouth_width_));
  for (const std::uint32_t v : own) {
    const Vector3f p = vertexOf(mesh.vertices, v);
    const auto nearest = near.facing(p, vertexOf(normals, v));
    if (!nearest) continue;
    Vector3f place = Vector3f::Zero(), normal = Vector3f::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const float weight = nearest->weights[static_cast<Eigen::Index>(k)];
      place += weight * vertexOf(mesh.vertices, (*nearest->triangle)[k]);
      normal += weight * vertexOf(normals, (*nearest->triangle)[k]);
    }
    if (!(normal.norm() > 0)) continue;
    normal.normalize();
    teeth_.push_back({v, with_jaw, std::min(0.0F, (p - place).dot(normal)), place, normal});
  }
}

double LipGuard::narrowestGap(const MarkerPositions& points) const {
  double narrowest = std::numeric_limits<double>::infinity();
  for (const auto& [upper, lower] : rims_)
    narrowest = std::min(narrowest, (points.row(upper) - points.row(lower)).norm());
  return narrowest;
}

void LipGuard::separate(const MarkerPositions& points, const AddedMotion& jaw, float* out) const {
  const auto ease = static_cast<float>(kEase * mouth_width_);
  const double apart = narrowestGap(points) / (kFarApart * mouth_width_);
  if (apart < 1 && !lips_.empty()) {
    const auto share = static_cast<float>(0.5 * (1 - smooth(2 * apart - 1)));
    thread_local std::vector<Vector3f> pushes;
    pushes.resize(lips_.size());
    for (std::size_t i = 0; i < lips_.size(); ++i) {
      pushes[i].setZero();
      const Sight sight = look(lips_[i], out);
      if (sight.distance >= 0) continue;
      const float length = std::max(sight.across.norm(), kLeastLength);
      pushes[i] = share * pushBack(sight.distance / length - lips_[i].allowed, ease) / length * sight.across;
    }
    for (std::size_t i = 0; i < lips_.size(); ++i)
      Eigen::Map<Vector3f>(out + 3 * std::size_t{lips_[i].vertex}) += pushes[i];
  }
  const Eigen::Matrix3f turn = jaw.turn.cast<float>();
  const Vector3f shift = jaw.shift.cast<float>();
  for (const ToothWatch& watch : teeth_) {
    Vector3f place = watch.place, normal = watch.normal;
    if (watch.with_jaw) {
      place += turn * place + shift;
      normal += turn * normal;
    }
    Eigen::Map<Vector3f> p(out + 3 * std::size_t{watch.vertex});
    p += pushBack((p - place).dot(normal) - watch.allowed, ease) * normal;
  }
}

}  // namespace mouthpiece
