// Skin that is relaxed around what was torn: which vertices are, and that they are the means of their neighbours; told
// anew from the mesh by the slowest way.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/binding.h"
#include "deform/topology/head_topology.h"

namespace mouthpiece {
namespace {

/// A sheet of skin with a seam from top to bottom, a strip of tongue along its upper end, and a piece of skin by
/// itself.
class RelaxedSheets : public ::testing::TestWithParam<unsigned> {
 protected:
  RelaxedSheets() {
    std::vector<Eigen::RowVector3f> places;
    std::vector<std::array<std::uint32_t, 2>> at;  // of each place of the net: for the cells left and right of it
    const auto add = [&](const Eigen::RowVector3f& place) {
      places.push_back(place);
      return static_cast<std::uint32_t>(places.size() - 1);
    };
    for (std::uint32_t r = 0; r < kRows; ++r) {
      for (std::uint32_t c = 0; c < kColumns; ++c) {
        const Eigen::RowVector3f place(asFloat(1.0 * c) + number(-0.3F, 0.3F), asFloat(1.0 * r) + number(-0.3F, 0.3F),
                                       number(-0.3F, 0.3F));
        const std::uint32_t left = add(place);
        at.push_back({left, c == kSeam ? add(place) : left});
      }
    }
    const auto addCells = [&](std::uint32_t first_row, std::uint32_t last_row) {
      for (std::uint32_t r = first_row; r < last_row; ++r) {
        for (std::uint32_t c = 0; c + 1 < kColumns; ++c) {
          const std::uint32_t a = at[r * kColumns + c][1], b = at[r * kColumns + c + 1][0],
                              d = at[(r + 1) * kColumns + c][1], e = at[(r + 1) * kColumns + c + 1][0];
          mesh_.triangles.push_back({a, b, e});
          mesh_.triangles.push_back({a, e, d});
        }
      }
    };
    addCells(0, kSkinRows);
    island_ = add({-30, 0, 0});
    add({-29, 0, 0});
    add({-30, 1, 0});
    mesh_.triangles.push_back({island_, island_ + 1, island_ + 2});
    const std::size_t skin = mesh_.triangles.size();
    addCells(kSkinRows, kRows - 1);
    mesh_.parts = {{.name = "skin", .kind = PartKind::kSkin, .triangle_count = skin},
                   {.name = "tongue",
                    .kind = PartKind::kTongue,
                    .first_triangle = skin,
                    .triangle_count = mesh_.triangles.size() - skin}};
    mesh_.vertices.resize(signedIndex(places.size()), 3);
    for (std::size_t v = 0; v < places.size(); ++v) mesh_.vertices.row(signedIndex(v)) = places[v];
    torn_ = {at[kSkinRows / 2 * kColumns + kSeam - 1][0], at[(kSkinRows - 2) * kColumns + 2][0], island_};
    held_.assign(mesh_.vertexCount(), false);
    for (std::uint32_t v = 0; v < held_.size(); ++v) held_[v] = random_() % 9 == 0;
    findWays();
  }
  static constexpr std::uint32_t kColumns = 12, kRows = 14, kSkinRows = 10, kSeam = 6;

  float number(float least, float most) { return std::uniform_real_distribution<float>(least, most)(random_); }
  [[nodiscard]] double length(std::uint32_t a, std::uint32_t b) const {
    return double{(mesh_.vertices.row(a) - mesh_.vertices.row(b)).norm()};
  }
  /// The first vertex in the same place.
  [[nodiscard]] std::uint32_t knot(std::uint32_t v) const {
    for (std::uint32_t other = 0; other < v; ++other) {
      if (mesh_.vertices.row(other) == mesh_.vertices.row(v)) return other;
    }
    return v;
  }

  /// Neighbours by the triangles, and which vertices are to be relaxed.
  void findWays() {
    const std::vector<PartKind> kinds = vertexKinds(mesh_);
    std::vector<double> way(mesh_.vertexCount(), std::numeric_limits<double>::infinity());
    for (const Triangle& t : mesh_.triangles) {
      for (const auto& [i, k] : {std::pair(0, 1), {1, 2}, {2, 0}, {1, 0}, {2, 1}, {0, 2}}) {
        const std::uint32_t a = t[static_cast<std::size_t>(i)], b = t[static_cast<std::size_t>(k)];
        if (kinds[a] != PartKind::kTongue && kinds[b] != PartKind::kTongue) beside_[knot(a)].insert(knot(b));
      }
    }
    for (const std::uint32_t v : torn_) way[knot(v)] = 0;
    for (std::size_t round = 0; round < mesh_.vertexCount(); ++round) {
      for (const auto& [v, others] : beside_) {
        for (const std::uint32_t other : others) way[v] = std::min(way[v], way[other] + length(v, other));
      }
    }
    std::vector<bool> holds(held_.size(), false);
    for (std::uint32_t v = 0; v < held_.size(); ++v) {
      if (held_[v]) holds[knot(v)] = true;
    }
    for (const std::uint32_t v : torn_) holds[knot(v)] = false;
    for (std::uint32_t v = 0; v < way.size(); ++v) {
      const std::uint32_t k = knot(v);
      if (way[k] <= kReach && !holds[k] && length(k, island_) > 3) relaxed_.insert(v);
    }
  }
  static constexpr double kReach = 2.7;

  std::mt19937 random_{GetParam()};
  FaceMesh mesh_;
  std::uint32_t island_ = 0;
  std::vector<std::uint32_t> torn_;
  std::vector<bool> held_;
  std::map<std::uint32_t, std::set<std::uint32_t>> beside_;
  std::set<std::uint32_t> relaxed_;
};
INSTANTIATE_TEST_SUITE_P(Seeds, RelaxedSheets, ::testing::Range(1U, 9U));

TEST_P(RelaxedSheets, AreTheMeansOfTheirNeighboursAndTheRestStays) {
  const HeadTopology topology(mesh_, {});
  const VertexPositions before = VertexPositions::NullaryExpr(mesh_.vertices.rows(), 3, [&] { return number(-5, 5); });
  VertexPositions moves = before;
  SkinRelaxing(mesh_, topology, torn_, held_, kReach).relax(moves);
  ASSERT_GT(relaxed_.size(), 20U);
  for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
    if (!relaxed_.contains(v)) {
      EXPECT_EQ(moves.row(v), before.row(v)) << v;
      continue;
    }
    EXPECT_EQ(moves.row(v), moves.row(knot(v))) << "both sides of the seam";
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double weights = 0;
    for (const std::uint32_t other : beside_.at(knot(v))) {
      sum += moves.row(other).cast<double>() / length(knot(v), other);
      weights += 1 / length(knot(v), other);
    }
    EXPECT_LT((moves.row(v).cast<double>() - sum / weights).norm(), 1e-4) << v;
  }
}

/// A needle's apex, nearer to its long edge than the means of all neighbours differ, stays on its side of that.
TEST(Relaxing, LeavesANeedleAsItLies) {
  constexpr float kHigh = 0.05F;
  FaceMesh mesh;
  mesh.vertices.resize(8, 3);
  // The apex (0) of a needle over the edge from 1 to 2; around them 3 above and 4 to 7 below.
  mesh.vertices << 0, kHigh, 0, -5, 0, 0, 5, 0, 0, 0, 4, 0, -5, 4, 0, 5, 4, 0, 0, -4, 0, 0, 9, 0;
  mesh.triangles = {{1, 2, 0}, {0, 2, 3}, {0, 3, 1}, {1, 3, 4}, {2, 5, 3}, {2, 1, 6}, {4, 3, 7}, {3, 5, 7}};
  mesh.parts = {{.name = "skin", .kind = PartKind::kSkin, .triangle_count = mesh.triangles.size()}};
  VertexPositions moves = VertexPositions::Zero(8, 3);
  moves.col(1) << 0, 2, 2.5F, 0, 0, 0, 2, 0;  // the edge goes up, the skin above it stays
  const auto apexOverEdge = [&](bool keeps_needles) {
    FaceBinding binding;
    relaxAround(mesh, HeadTopology(mesh, {}), {0}, {}, 0.1, binding, 1, keeps_needles);
    EXPECT_EQ(binding.relaxed.vertices, std::vector<std::uint32_t>{0});
    float up = kHigh;
    for (std::size_t i = 0; i < binding.relaxed.from.size(); ++i)
      up += binding.relaxed.weights[i] * moves(binding.relaxed.from[i], 1);
    return up - 0.5F * (moves(1, 1) + moves(2, 1));
  };
  EXPECT_LT(apexOverEdge(false), 0) << "so that the needle turns over";
  EXPECT_GT(apexOverEdge(true), 0);
}

/// Two corners of a triangle in one place: its third follows them, and not they it.
TEST(Relaxing, FollowsOneWayOverTrianglesWithoutArea) {
  constexpr std::uint32_t kSide = 9;
  FaceMesh mesh;
  mesh.vertices.resize(signedIndex(kSide * kSide), 3);
  std::vector<std::set<std::uint32_t>> followed(kSide * kSide);
  std::vector<std::uint32_t> inner;
  for (std::uint32_t r = 0; r < kSide; ++r) {
    for (std::uint32_t c = 0; c < kSide; ++c) {
      const std::uint32_t v = r * kSide + c;
      mesh.vertices.row(v) << asFloat(1.0 * c), asFloat(1.0 * r), 0;
      if (r + 1 < kSide && c + 1 < kSide)
        mesh.triangles.insert(mesh.triangles.end(), {{v, v + 1, v + kSide + 1}, {v, v + kSide + 1, v + kSide}});
      if (r % (kSide - 1) != 0 && c % (kSide - 1) != 0) inner.push_back(v);
    }
  }
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) followed[v].insert(t.begin(), t.end());
  }
  std::mt19937 random(3);
  for (int i = 0; i < 12; ++i) {
    const std::uint32_t place = inner[random() % inner.size()], follower = inner[random() % inner.size()];
    mesh.triangles.push_back({place, place, follower});
    followed[follower].insert(place);
  }
  mesh.parts = {{.name = "skin", .kind = PartKind::kSkin, .triangle_count = mesh.triangles.size()}};
  VertexPositions moves = VertexPositions::Random(mesh.vertices.rows(), 3);
  SkinRelaxing(mesh, HeadTopology(mesh, {}), inner, {}, 0).relax(moves);
  for (const std::uint32_t v : inner) {
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double weights = 0;
    for (const std::uint32_t other : followed[v]) {
      const double length = double{(mesh.vertices.row(v) - mesh.vertices.row(other)).norm()};
      if (other == v) continue;
      sum += moves.row(other).cast<double>() / length;
      weights += 1 / length;
    }
    EXPECT_LT((moves.row(v).cast<double>() - sum / weights).norm(), 1e-5) << v;
  }
}

/// As rows of a matrix they do the same but for the smallest entries, and what was relaxed before stays so.
TEST_P(RelaxedSheets, GoWhereTheirRowsSay) {
  const HeadTopology topology(mesh_, {});
  FaceBinding binding;
  relaxAround(mesh_, topology, {torn_[0]}, held_, kReach, binding);
  const std::vector<std::uint32_t> first = binding.relaxed.vertices;
  ASSERT_FALSE(first.empty());
  relaxAround(mesh_, topology, {torn_[1]}, held_, kReach, binding);
  const auto& [vertices, ends, from, weights] = binding.relaxed;
  EXPECT_TRUE(std::is_sorted(vertices.begin(), vertices.end()));
  EXPECT_TRUE(std::includes(vertices.begin(), vertices.end(), first.begin(), first.end()));
  EXPECT_EQ(std::set<std::uint32_t>(vertices.begin(), vertices.end()), relaxed_);
  const VertexPositions before = VertexPositions::NullaryExpr(mesh_.vertices.rows(), 3, [&] { return number(-5, 5); });
  VertexPositions moves = before;
  SkinRelaxing(mesh_, topology, torn_, held_, kReach).relax(moves);
  std::size_t entry = 0;
  for (std::size_t row = 0; row < vertices.size(); ++row) {
    Eigen::RowVector3f sum = Eigen::RowVector3f::Zero();
    float whole = 0;
    for (; entry < ends[row]; ++entry) {
      EXPECT_GE(weights[entry], 0.002F);
      EXPECT_FALSE(relaxed_.contains(from[entry]));
      sum += weights[entry] * before.row(from[entry]);
      whole += weights[entry];
    }
    EXPECT_NEAR(whole, 1, 1e-5F);
    EXPECT_LT((sum - moves.row(vertices[row])).norm(), 0.15F) << "up to twenty entries of 0.002 times 5 were left out";
  }
}

}  // namespace
}  // namespace mouthpiece
