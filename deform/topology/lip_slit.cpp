// The line between the lips, seen in what opens them.
#include "deform/topology/lip_slit.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace mouthpiece {
namespace {

// Shares of the box round what the shape moves, and of its largest move.
constexpr float kReach = 0.03F;       ///< lips at rest are no farther apart
constexpr float kLeastJump = 0.05F;   ///< what the shape moves them apart
constexpr float kLeastSlope = 20.0F;  ///< that jump by their distance; skin that stretches stays under 6

struct Jump {
  SlitPair pair;
  float x, z;
};

using Cell = std::array<std::int64_t, 3>;

}  // namespace

std::vector<std::uint32_t> skinVertices(const FaceMesh& mesh, bool with_hair) {
  std::vector<bool> is_skin(mesh.vertexCount(), false);
  for (const MeshPart& part : mesh.parts) {
    if (!isSkin(part.kind) || (part.stands_off && !with_hair)) continue;
    for (const Triangle& triangle : trianglesOf(mesh, part)) {
      for (const std::uint32_t v : triangle) is_skin[v] = true;
    }
  }
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t v = 0; v < is_skin.size(); ++v) {
    if (is_skin[v]) vertices.push_back(v);
  }
  return vertices;
}

std::vector<SlitPair> lipSlit(const FaceMesh& mesh, const VertexPositions& jaw_moves) {
  std::vector<std::uint32_t> skin = skinVertices(mesh, false);
  float most = 0;
  for (const std::uint32_t v : skin) most = std::max(most, jaw_moves.row(v).norm());
  if (!(most > 0)) return {};
  Eigen::AlignedBox3f box;
  for (const std::uint32_t v : skin) {
    if (jaw_moves.row(v).norm() > kLeastJump * most) box.extend(mesh.vertices.row(v).transpose());
  }
  const float size = box.diagonal().norm(), reach = kReach * size;
  if (!(reach > 0)) return {};
  std::map<Cell, std::vector<std::uint32_t>> cells;
  const auto cellOf = [&](std::uint32_t v) {
    Cell cell{};
    for (int axis = 0; axis < 3; ++axis)
      cell[static_cast<std::size_t>(axis)] = std::llround(std::floor(mesh.vertices(v, axis) / reach));
    return cell;
  };
  for (const std::uint32_t v : skin) cells[cellOf(v)].push_back(v);
  /// The nearest vertex that the shape takes far away; the one that goes down is the lower lip's.
  const auto partnerOf = [&](std::uint32_t v) -> std::optional<std::uint32_t> {
    std::optional<std::uint32_t> best;
    float nearest = reach;
    const Cell middle = cellOf(v);
    for (std::int64_t code = 0; code < 27; ++code) {
      const auto found = cells.find({middle[0] + code % 3 - 1, middle[1] + code / 3 % 3 - 1, middle[2] + code / 9 - 1});
      if (found == cells.end()) continue;
      for (const std::uint32_t other : found->second) {
        const float away = (mesh.vertices.row(v) - mesh.vertices.row(other)).norm();
        const float jump = (jaw_moves.row(v) - jaw_moves.row(other)).norm() / most;
        if (away < nearest && jump > kLeastJump && jump * size > kLeastSlope * away &&
            jaw_moves(v, 1) < jaw_moves(other, 1)) {
          nearest = away;
          best = other;
        }
      }
    }
    return best;
  };
  std::vector<Jump> jumps;
  for (const std::uint32_t v : skin) {
    if (jaw_moves.row(v).norm() < kLeastJump * most) continue;
    if (const auto upper = partnerOf(v)) jumps.push_back({{*upper, v, 0}, mesh.vertices(v, 0), mesh.vertices(v, 2)});
  }
  if (jumps.size() < 4) return {};
  const auto [left, right] =
      std::minmax_element(jumps.begin(), jumps.end(), [](const Jump& a, const Jump& b) { return a.x < b.x; });
  const float first = left->x, width = std::max(right->x - left->x, 1e-9F);
  std::stable_sort(jumps.begin(), jumps.end(), [](const Jump& a, const Jump& b) { return a.z > b.z; });
  std::vector<SlitPair> slit;
  for (Jump& jump : jumps) {
    jump.pair.step = std::min(kSlitSteps - 1, static_cast<std::size_t>((jump.x - first) / width * asFloat(kSlitSteps)));
    slit.push_back(jump.pair);
  }
  std::stable_sort(slit.begin(), slit.end(), [](const SlitPair& a, const SlitPair& b) { return a.step < b.step; });
  return slit;
}

}  // namespace mouthpiece
