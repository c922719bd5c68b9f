#include "deform/mesh/moving_triangles.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "base/index.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kLeaf = 4;

/// Weights of b and c in the place of the triangle a, a + ab, a + ac that is nearest to `p` (C. Ericson, Real-Time
/// Collision Detection, 5.1.5).
std::pair<double, double> nearestWeights(const Vector3d& p, const Vector3d& a, const Vector3d& ab, const Vector3d& ac) {
  const Vector3d ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return {0, 0};
  const Vector3d bp = ap - ab;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return {1, 0};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {d1 / (d1 - d3), 0};
  const Vector3d cp = ap - ac;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return {0, 1};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {0, d2 / (d2 - d6)};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6) {
    const double c = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {1 - c, c};
  }
  const double all = va + vb + vc;
  return {vb / all, vc / all};
}

}  // namespace

MovingTriangles::MovingTriangles(const VertexPositions& rest, const std::vector<Triangle>& triangles)
    : triangles_(triangles), order_(triangles.size()) {
  if (triangles.empty()) return;
  std::vector<Vector3d> middles;
  for (const Triangle& t : triangles)
    middles.push_back((pointAt(rest, t[0]) + pointAt(rest, t[1]) + pointAt(rest, t[2])) / 3);
  std::iota(order_.begin(), order_.end(), 0U);
  grow(middles, 0, static_cast<std::uint32_t>(triangles.size()));
}

/// The number of the new node.
std::uint32_t MovingTriangles::grow(const std::vector<Vector3d>& middles, std::uint32_t first, std::uint32_t count) {
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({first, count, 0});
  if (count <= kLeaf) return node;
  const auto begin = order_.begin() + first;
  Eigen::AlignedBox3d box;
  std::for_each(begin, begin + count, [&](std::uint32_t i) { box.extend(middles[i]); });
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t one, std::uint32_t other) {
    return std::pair(middles[one][axis], one) < std::pair(middles[other][axis], other);
  });
  grow(middles, first, half);
  const std::uint32_t right = grow(middles, first + half, count - half);
  nodes_[node].right = right;
  return node;
}

MovingTriangles::Posed::Posed(const MovingTriangles& tree, const VertexPositions& vertices)
    : tree_(tree), boxes_(tree.nodes_.size()) {
  facets_.reserve(tree.order_.size());
  for (const std::uint32_t i : tree.order_) {
    const Triangle& t = tree.triangles_[i];
    const Vector3d a = pointAt(vertices, t[0]), ab = pointAt(vertices, t[1]) - a, ac = pointAt(vertices, t[2]) - a;
    facets_.push_back({a, ab, ac, !ab.cross(ac).isZero(0)});
  }
  for (std::size_t n = boxes_.size(); n-- > 0;) {
    const Node& node = tree.nodes_[n];
    if (node.right != 0) {
      boxes_[n] = boxes_[n + 1].merged(boxes_[node.right]);
      continue;
    }
    for (std::size_t f = node.first; f < node.first + node.count; ++f) {
      if (!facets_[f].has_area) continue;
      const auto& [a, ab, ac, _] = facets_[f];
      boxes_[n].extend(a).extend(a + ab).extend(a + ac);
    }
  }
}

std::optional<TriangleTree::Foot> MovingTriangles::Posed::closest(const Vector3d& point,
                                                                  const TriangleTree::Foot* begin_at,
                                                                  double within) const {
  std::optional<TriangleTree::Foot> foot;
  if (boxes_.empty()) return foot;
  double least = within * within;
  if (begin_at != nullptr && (begin_at->point - point).squaredNorm() < least) {
    foot = *begin_at;
    least = (begin_at->point - point).squaredNorm();
  }
  std::array<std::pair<double, std::uint32_t>, 64> waiting;  // halving, no tree is as deep
  std::size_t count = 0;
  waiting[count++] = {boxes_[0].squaredExteriorDistance(point), 0U};
  while (count > 0) {
    const auto [away, number] = waiting[--count];
    if (away >= least) continue;
    const Node& node = tree_.nodes_[number];
    if (node.right != 0) {
      const std::pair one(boxes_[number + 1].squaredExteriorDistance(point), number + 1),
          other(boxes_[node.right].squaredExteriorDistance(point), node.right);
      waiting[count++] = std::max(one, other);
      waiting[count++] = std::min(one, other);
      continue;
    }
    for (std::size_t f = node.first; f < node.first + node.count; ++f) {
      const auto& [a, ab, ac, has_area] = facets_[f];
      if (!has_area) continue;
      const auto [of_b, of_c] = nearestWeights(point, a, ab, ac);
      const Vector3d place = a + of_b * ab + of_c * ac;
      const double squared = (place - point).squaredNorm();
      if (squared >= least) continue;
      least = squared;
      foot = TriangleTree::Foot{place, tree_.order_[f], {1 - of_b - of_c, of_b, of_c}};
    }
  }
  return foot;
}

}  // namespace mouthpiece
