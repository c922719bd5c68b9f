#include "retarget/placing/whole_head.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"

namespace mouthpiece {
namespace {

/// The length of the edges of one triangle alone that lie at `x`.
double borderAt(const FaceMesh& mesh, const std::vector<Triangle>& skin, double x, double slack) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  const auto isThere = [&](std::uint32_t v) { return std::abs(double{mesh.vertices(v, 0)} - x) < slack; };
  for (const Triangle& t : skin) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [from, to] = std::minmax(t[k], t[(k + 1) % 3]);
      if (isThere(from) && isThere(to)) ++uses[{from, to}];
    }
  }
  double length = 0;
  for (const auto& [edge, count] : uses) {
    if (count == 1) length += double{(mesh.vertices.row(edge.first) - mesh.vertices.row(edge.second)).norm()};
  }
  return length;
}

std::string whyHalf(const FaceMesh& mesh) {
  // Of the skin's height, which its profile is longer than. A bust that ends in planes at both shoulders is whole.
  constexpr double kFlat = 1e-3, kLong = 0.5, kShort = 0.1;
  constexpr std::size_t kFewest = 100;  // triangles of a head
  const std::vector<Triangle> skin = trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips});
  Eigen::AlignedBox3d box;
  for (const Triangle& t : skin) {
    for (const std::uint32_t v : t) box.extend(pointAt(mesh.vertices, v));
  }
  if (skin.size() < kFewest) return "";
  const double height = box.sizes().tail<2>().maxCoeff();
  const double low = box.min().x(), high = box.max().x();
  for (const auto& [x, opposite] : {std::pair(low, high), std::pair(high, low)}) {
    if (borderAt(mesh, skin, x, kFlat * height) < kLong * height) continue;
    if (borderAt(mesh, skin, opposite, kFlat * height) > kShort * height) continue;
    return fmt::format(
        "is half a head: its skin ends in the plane x = {:.3g}; apply the modifier that mirrors it, or join it with "
        "its mirror image",
        x);
  }
  return "";
}

/// The share of a part's vertices, some hundreds of them, that lie within `near` of a surface.
double shareNear(const FaceMesh& mesh, const MeshPart& part, const TriangleTree& surface, double near) {
  constexpr std::size_t kLookedAt = 300;
  const std::span<const Triangle> own = trianglesOf(mesh, part);
  const std::size_t every = own.size() / kLookedAt + 1;
  double count = 0, close = 0;
  for (std::size_t t = 0; t < own.size(); t += every) {
    const Eigen::Vector3d place = pointAt(mesh.vertices, own[t][0]);
    const auto foot = surface.closest(place);
    ++count;
    if (foot && (foot->point - place).norm() < near) ++close;
  }
  return count > 0 ? close / count : 0;
}

std::string whyLayered(const FaceMesh& mesh) {
  constexpr double kNear = 0.01, kMostly = 0.8;  // of the part's size; of each part
  std::vector<Eigen::AlignedBox3d> boxes(mesh.parts.size());
  for (std::size_t a = 0; a < mesh.parts.size(); ++a) {
    for (const Triangle& t : trianglesOf(mesh, mesh.parts[a])) boxes[a].extend(pointAt(mesh.vertices, t[0]));
  }
  for (std::size_t a = 0; a < mesh.parts.size(); ++a) {
    for (std::size_t b = a + 1; b < mesh.parts.size(); ++b) {
      const MeshPart &one = mesh.parts[a], &other = mesh.parts[b];
      if (!isSkin(one.kind) || !isSkin(other.kind) || one.stands_off || other.stands_off) continue;
      const Eigen::AlignedBox3d &here = boxes[a], &there = boxes[b];
      // Most parts of a head lie elsewhere than the others.
      const double size = here.diagonal().norm();
      if (here.isEmpty() || there.isEmpty() || (here.center() - there.center()).norm() > 0.1 * size) continue;
      if (std::abs(there.diagonal().norm() - size) > 0.1 * size) continue;
      const auto treeOf = [&](const MeshPart& part) {
        const std::span<const Triangle> own = trianglesOf(mesh, part);
        return TriangleTree(mesh.vertices, {own.begin(), own.end()});
      };
      if (shareNear(mesh, one, treeOf(other), kNear * size) < kMostly) continue;
      if (shareNear(mesh, other, treeOf(one), kNear * size) < kMostly) continue;
      return fmt::format("has two layers of skin in one place, '{}' and '{}'; expected one level of detail", one.name,
                         other.name);
    }
  }
  return "";
}

}  // namespace

std::string whyNoWholeHead(const FaceMesh& mesh) {
  const std::string half = whyHalf(mesh);
  return half.empty() ? whyLayered(mesh) : half;
}

}  // namespace mouthpiece
