#include "deform/mesh/near_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

namespace mouthpiece {
namespace {

using Eigen::Vector3f;

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

}  // namespace

NearTriangles::NearTriangles(const VertexPositions& vertices, const std::vector<Triangle>& triangles, float reach)
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

std::optional<NearTriangles::Nearest> NearTriangles::facing(const Vector3f& p, const Vector3f& normal) const {
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

float NearTriangles::distance(const Vector3f& p, const Vector3f& normal) const {
  const auto nearest = facing(p, normal);
  if (!nearest) return 0;
  const auto& [a, b, c] = *nearest->triangle;
  const Vector3f at = vertexOf(vertices_, a);
  const Vector3f across = (vertexOf(vertices_, b) - at).cross(vertexOf(vertices_, c) - at);
  return (p - at).dot(across) / std::max(across.norm(), kLeastLength);
}

}  // namespace mouthpiece
