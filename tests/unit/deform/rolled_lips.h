#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mouth/lip_guard.h"
#include "deform/surface/binding.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece::samples {

/// The sample face with lips that are rolled in: behind each rim some millimetres that face the other lip.
struct RolledLips {
  FaceMesh mesh = sampleFace().mesh;
  std::vector<int> side;  ///< of each vertex: 1 of the upper lip's side, -1 of the lower one's, 0: no skin
  std::vector<std::pair<Eigen::Index, Eigen::Index>> rims;  ///< lower, upper: in one place at rest

  RolledLips() {
    const std::size_t skin = sampleFace().skin_vertices;
    side.assign(mesh.vertexCount(), 0);
    for (std::size_t v = 0; v < skin; ++v) side[v] = sampleFace().is_above_slit[v] ? 1 : -1;
    for (Eigen::Index v = 0; v + 1 < signedIndex(skin); ++v) {
      if (mesh.vertices.row(v) == mesh.vertices.row(v + 1)) rims.emplace_back(v, v + 1);
    }
    mesh.parts.push_back({.name = "lips", .kind = PartKind::kLips, .first_triangle = mesh.triangles.size()});
    addBehind(false);
    addBehind(true);
    mesh.parts.back().triangle_count = mesh.triangles.size() - mesh.parts.back().first_triangle;
  }

 private:
  void addBehind(bool upper) {
    constexpr std::array<std::array<float, 2>, 3> kRows{{{0, -1.2F}, {0, -2.4F}, {2, -4}}};  // up from the rim, forward
    std::vector<std::uint32_t> before;
    for (const auto& [low, high] : rims) before.push_back(static_cast<std::uint32_t>(upper ? high : low));
    const std::vector<std::uint32_t> rim = before;
    for (const auto& [up, forward] : kRows) {
      std::vector<std::uint32_t> row;
      for (const std::uint32_t v : rim) {
        row.push_back(static_cast<std::uint32_t>(mesh.vertices.rows()));
        mesh.vertices.conservativeResize(mesh.vertices.rows() + 1, 3);
        mesh.vertices.bottomRows<1>() = mesh.vertices.row(v) + Eigen::RowVector3f(0, upper ? up : -up, forward);
        side.push_back(upper ? 1 : -1);
      }
      for (std::size_t k = 0; k + 1 < row.size(); ++k) {
        const std::uint32_t a = before[upper ? k + 1 : k], b = before[upper ? k : k + 1], c = row[upper ? k : k + 1],
                            d = row[upper ? k + 1 : k];
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
      before = row;
    }
  }
};

inline const RolledLips& lips() {
  static const RolledLips made;
  return made;
}

/// Guards of those lips.
class Guards : public ::testing::Test {
 protected:
  static const LipGuard& guard() {
    static const LipGuard made(lips().mesh, lips().mesh.vertices, sampleControl(),
                               bindFace(lips().mesh, sampleControl()));
    return made;
  }
  static const VertexPositions& rest() { return lips().mesh.vertices; }
  static float heightOverSlit(Eigen::Index v) { return rest()(v, 1) - slit(); }
  static float slit() { return asFloat(sampleControl().rest(lipPairs(sampleControl()).front().upper_rim, 1)); }

  /// One lip, `thick` from its rim on, goes `mm` up.
  static VertexPositions lifted(bool upper, float mm, float thick = 12) {
    VertexPositions moved = rest();
    for (Eigen::Index v = 0; v < rest().rows(); ++v) {
      if (lips().side[unsignedIndex(v)] == (upper ? 1 : -1) && std::abs(heightOverSlit(v)) < thick) moved(v, 1) += mm;
    }
    return moved;
  }
  /// The lips' points, `mm` apart.
  static MarkerPositions pointsApart(double mm) {
    MarkerPositions points = sampleControl().rest;
    for (const LipPair& pair : lipPairs(sampleControl())) points(pair.lower_rim, 1) -= mm;
    return points;
  }
  static VertexPositions guarded(VertexPositions moved, double points_apart = 0, const std::vector<LipGap>& gaps = {}) {
    guard().separate(pointsApart(points_apart), gaps, {}, moved.data());
    return moved;
  }
  static std::vector<LipGap> allPairs(const LipGap& gap) {
    return std::vector<LipGap>(lipPairs(sampleControl()).size(), gap);
  }
  /// Rims in the middle half of the mouth.
  static std::vector<std::pair<Eigen::Index, Eigen::Index>> rims() {
    auto found = lips().rims;
    std::erase_if(found, [](const auto& rim) { return std::abs(rest()(rim.first, 0)) > 12; });
    return found;
  }
  static float widestGap(const VertexPositions& moved) {
    float widest = -1e9F;
    for (const auto& [lower, upper] : rims()) widest = std::max(widest, moved(upper, 1) - moved(lower, 1));
    return widest;
  }
  static float narrowestGap(const VertexPositions& moved) {
    float narrowest = 1e9F;
    for (const auto& [lower, upper] : rims()) narrowest = std::min(narrowest, moved(upper, 1) - moved(lower, 1));
    return narrowest;
  }
  static float width() { return asFloat(sampleControl().mouth_width); }
};

/// A block of teeth behind the lips; `low` and `high` from the slit on.
inline FaceMesh withTeeth(PartKind kind, float low, float high, float front) {
  FaceMesh mesh = lips().mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  const Eigen::RowVector3f rim = mesh.vertices.row(lips().rims[lips().rims.size() / 2].first);
  mesh.parts.push_back({.name = "row", .kind = kind, .first_triangle = mesh.triangles.size()});
  constexpr std::uint32_t kCells = 40;
  mesh.vertices.conservativeResize(mesh.vertices.rows() + 2 * (kCells + 1), 3);
  for (std::uint32_t i = 0; i <= kCells; ++i) {
    const float x = -20 + 40 * asFloat(asReal(i)) / kCells;
    for (std::uint32_t k = 0; k < 2; ++k)
      mesh.vertices.row(first + 2 * i + k) << x, rim.y() + (k == 0 ? low : high), rim.z() + front - 0.02F * x * x;
    if (i == kCells) break;
    const std::uint32_t a = first + 2 * i;
    mesh.triangles.push_back({a, a + 2, a + 3});
    mesh.triangles.push_back({a, a + 3, a + 1});
  }
  mesh.parts.back().triangle_count = mesh.triangles.size() - mesh.parts.back().first_triangle;
  return mesh;
}

}  // namespace mouthpiece::samples
