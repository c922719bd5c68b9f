// Gums that come in one piece with the tongue.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "deform/mesh/mesh_reader.h"
#include "deform/mesh/triangle_tree.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

Eigen::Vector3f corner(const FaceMesh& mesh, const Triangle& triangle, std::size_t k) {
  return mesh.vertices.row(triangle[k]).transpose();
}

/// Triangles that share an edge; vertices in one place count as one. kNone at borders and where more than two meet.
std::vector<std::array<std::size_t, 3>> neighboursOf(const FaceMesh& mesh, std::span<const Triangle> triangles) {
  std::map<std::array<float, 3>, std::uint32_t> first_at;
  const auto place = [&](std::uint32_t vertex) {
    const auto point = mesh.vertices.row(vertex);
    return first_at.try_emplace({point[0], point[1], point[2]}, vertex).first->second;
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::pair<std::size_t, std::size_t>>> users;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      users[std::minmax(place(triangles[i][k]), place(triangles[i][(k + 1) % 3]))].emplace_back(i, k);
  }
  std::vector<std::array<std::size_t, 3>> neighbours(triangles.size(), {kNone, kNone, kNone});
  for (const auto& [edge, both] : users) {
    if (both.size() != 2) continue;
    neighbours[both[0].first][both[0].second] = both[1].first;
    neighbours[both[1].first][both[1].second] = both[0].first;
  }
  return neighbours;
}

/// The tongue's triangles: its top has the palate above it, its underside that and the top, and what lies below both is
/// the floor of the mouth.
std::vector<bool> tongueOf(const FaceMesh& mesh, std::span<const Triangle> gums, const Eigen::Vector3f& mouth) {
  constexpr float kSteep = 0.3F;  // cosine to the vertical: a rim, which may count to either side
  const TriangleTree tree(mesh.vertices, gums);
  std::vector<std::ptrdiff_t> above;  // how many other triangles lie straight above the middle of each
  std::vector<float> upward;          // cosine of the normal to the vertical
  float palate = 0;  // area that faces up where nothing lies above: below zero, for a palate faces down
  for (std::size_t i = 0; i < gums.size(); ++i) {
    const Eigen::Vector3f a = corner(mesh, gums[i], 0);
    const Eigen::Vector3f normal = (corner(mesh, gums[i], 1) - a).cross(corner(mesh, gums[i], 2) - a);
    const Eigen::Vector3d middle = centroid(mesh, gums[i]).cast<double>();
    const auto crossings = tree.crossings(middle.x(), middle.z());
    above.push_back(std::count_if(crossings.begin(), crossings.end(), [&](const TriangleTree::Crossing& crossing) {
      return crossing.triangle != i && crossing.height > middle.y();
    }));
    upward.push_back(normal.y() / std::max(normal.norm(), 1e-30F));
    if (above.back() == 0) palate += normal.y();
  }
  const float outward = palate > 0 ? -1.0F : 1.0F;  // a mesh may be wound inside out
  const auto is_tongue = [&](std::size_t i) {
    const float up = outward * upward[i];
    return (above[i] == 1 && up > -kSteep) || (above[i] == 2 && up < kSteep);
  };
  std::size_t seed = kNone;
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < gums.size(); ++i) {
    const Eigen::Vector3f away = centroid(mesh, gums[i]) - mouth;
    const float distance = std::hypot(away.x(), away.z());
    if (above[i] == 1 && outward * upward[i] > 0.8F && distance < nearest) {
      seed = i;
      nearest = distance;
    }
  }
  std::vector<bool> tongue(gums.size(), false);
  if (seed == kNone) return tongue;
  const auto neighbours = neighboursOf(mesh, gums);
  std::vector<std::size_t> open{seed};
  tongue[seed] = true;
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    for (const std::size_t next : neighbours[at]) {
      if (next == kNone || tongue[next] || !is_tongue(next)) continue;
      tongue[next] = true;
      open.push_back(next);
    }
  }
  return tongue;
}

/// A piece of gums most of which is nearer to one row of teeth belongs to that row as a whole: beside the tongue the
/// lower gum comes near the upper teeth.
void agree(const FaceMesh& mesh, std::span<const Triangle> gums, const std::vector<bool>& tongue,
           std::vector<bool>& is_upper) {
  constexpr double kMost = 0.75;
  const auto neighbours = neighboursOf(mesh, gums);
  std::vector<bool> seen(gums.size(), false);
  for (std::size_t first = 0; first < gums.size(); ++first) {
    if (seen[first]) continue;
    std::vector<std::size_t> piece{first};
    seen[first] = true;
    for (std::size_t at = 0; at < piece.size(); ++at) {
      for (const std::size_t next : neighbours[piece[at]]) {
        if (next == kNone || seen[next]) continue;
        seen[next] = true;
        piece.push_back(next);
      }
    }
    double all = 0, upper = 0;
    for (const std::size_t i : piece) {
      if (tongue[i]) continue;
      const Eigen::Vector3f a = corner(mesh, gums[i], 0);
      const auto area = double{(corner(mesh, gums[i], 1) - a).cross(corner(mesh, gums[i], 2) - a).norm()};
      all += area;
      upper += is_upper[i] ? area : 0;
    }
    if (std::max(upper, all - upper) < kMost * all) continue;
    for (const std::size_t i : piece) is_upper[i] = 2 * upper > all;
  }
}

/// How far `point` is from a row of teeth; infinity without any.
double distanceTo(const TriangleTree& row, const Eigen::Vector3d& point) {
  const auto foot = row.closest(point);
  return foot ? (foot->point - point).norm() : std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<GumPiece> splitGums(const FaceMesh& mesh, std::span<const Triangle> gums,
                                std::span<const Triangle> upper_teeth, std::span<const Triangle> lower_teeth) {
  Eigen::AlignedBox3f teeth;
  for (const std::span<const Triangle> row : {upper_teeth, lower_teeth}) {
    for (const Triangle& triangle : row) teeth.extend(centroid(mesh, triangle));
  }
  // Whole rows, not samples of them: in the throat both are nearly as far, and a symmetric mouth is to be split evenly.
  const TriangleTree upper(mesh.vertices, upper_teeth), lower(mesh.vertices, lower_teeth);
  const std::vector<bool> tongue = tongueOf(mesh, gums, teeth.center());
  std::vector<bool> is_upper;
  for (const Triangle& triangle : gums) {
    const Eigen::Vector3d point = centroid(mesh, triangle).cast<double>();
    is_upper.push_back(distanceTo(upper, point) < distanceTo(lower, point));
  }
  agree(mesh, gums, tongue, is_upper);
  std::vector<GumPiece> pieces;
  for (std::size_t i = 0; i < gums.size(); ++i)
    pieces.push_back(tongue[i] ? GumPiece::kTongue : is_upper[i] ? GumPiece::kUpperGum : GumPiece::kLowerGum);
  return pieces;
}

}  // namespace mouthpiece
