// Sides of lips, pieces and ways along random sheets with a slit.
#include "deform/topology/head_topology.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_surface.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

/// A wavy sheet of skin, cut along part of one row; the cut's edges lie in the same places. A seam elsewhere runs from
/// top to bottom: its vertices are doubled, too, but it is one surface.
struct SlitSheet {
  FaceMesh mesh;
  FaceOpenings openings;
  std::vector<int> side;  ///< of each vertex: 1 above the slit's row, -1 below, 0 on it but beside the slit
};

SlitSheet randomSheet(std::mt19937& random) {
  std::uniform_int_distribution<int> size(9, 16);
  std::uniform_real_distribution<double> jitter(-0.2, 0.2), bend(-2, 2);
  const int rows = size(random), columns = size(random) + 6, slit = rows / 2;
  const int first = 2 + size(random) % 3, last = columns - 5, seam = columns - 3;
  const double height = bend(random), turn = bend(random);
  SlitSheet sheet;
  std::vector<Eigen::Vector3d> points;
  const auto add = [&](const Eigen::Vector3d& p, int side) {
    points.push_back(p);
    sheet.side.push_back(side);
    return static_cast<std::uint32_t>(points.size() - 1);
  };
  // Of each place: the vertex that the cell above right uses, above left, below right, below left.
  std::vector<std::array<std::uint32_t, 4>> corner;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double across = c + jitter(random), up = r + jitter(random);  // in this order with every compiler
      const Eigen::Vector3d p(across, up, height * std::sin(0.3 * c + turn * 0.2 * r));
      const bool is_cut = r == slit && c > first && c < last;
      const std::uint32_t below = add(p, is_cut ? -1 : r > slit ? 1 : r < slit ? -1 : 0);
      const std::uint32_t above = is_cut ? add(p, 1) : below;
      const std::uint32_t right = c == seam ? add(p, sheet.side[below]) : below;
      corner.push_back({c == seam ? right : above, above, c == seam ? right : below, below});
      if (is_cut) sheet.openings.lip_line.push_back(p);
    }
  }
  sheet.openings.lips_reach = 0.01;
  const auto at = [&](int r, int c, std::size_t use) { return corner[static_cast<std::size_t>(r * columns + c)][use]; };
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      const std::uint32_t a = at(r, c, 0), b = at(r, c + 1, 1), d = at(r + 1, c, 2), e = at(r + 1, c + 1, 3);
      sheet.mesh.triangles.push_back({a, b, e});
      sheet.mesh.triangles.push_back({a, e, d});
    }
  }
  sheet.mesh.vertices.resize(signedIndex(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    sheet.mesh.vertices.row(signedIndex(i)) = points[i].transpose().cast<float>();
  sheet.mesh.parts = {{.name = "skin", .triangle_count = sheet.mesh.triangles.size()}};
  const int middle = (first + last) / 2;
  const auto place = [&](int r) { return points[at(r, middle, 0)]; };
  sheet.openings.sides[0] = {{place(slit + 2)}, {place(slit - 2)}};
  return sheet;
}

class RandomSheets : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, RandomSheets, ::testing::Range(1U, 21U));

TEST_P(RandomSheets, LipsThatTouchAreNeverTied) {
  std::mt19937 random(GetParam());
  const SlitSheet sheet = randomSheet(random);
  const HeadTopology topology(sheet.mesh, sheet.openings);
  std::size_t doubled = 0;
  for (std::size_t v = 0; v + 1 < sheet.side.size(); ++v) {
    if (sheet.side[v] != -1 || sheet.side[v + 1] != 1) continue;
    const auto row = signedIndex(v);
    if (sheet.mesh.vertices.row(row) != sheet.mesh.vertices.row(row + 1)) continue;
    if (std::abs(topology.lowerShare(v + 1) - 0.5) < 0.02) continue;  // round the slit's end it is as far from both
    ++doubled;
    EXPECT_EQ(topology.forbidden()[v], kUpperLip) << "the lower edge of the slit, vertex " << v;
    EXPECT_EQ(topology.forbidden()[v + 1], kLowerLip) << "its upper edge, vertex " << v + 1;
    EXPECT_GT(topology.lowerShare(v), 0.5);
    EXPECT_LT(topology.lowerShare(v + 1), 0.5);
  }
  EXPECT_GE(doubled, 3U);
  // All that is clearly above or below belongs there.
  for (std::size_t v = 0; v < sheet.side.size(); ++v) {
    const double share = topology.lowerShare(v);
    EXPECT_GE(share, 0);
    EXPECT_LE(share, 1);
    if (std::abs(share - 0.5) < 0.05 || sheet.side[v] == 0) continue;
    EXPECT_EQ(topology.forbidden()[v] & (kUpperLip | kLowerLip), share < 0.5 ? kLowerLip : kUpperLip);
  }
}

TEST_P(RandomSheets, SeamsAreClosedAndTheSlitIsNot) {
  std::mt19937 random(GetParam());
  SlitSheet sheet = randomSheet(random);
  const HeadTopology topology(sheet.mesh, sheet.openings);
  EXPECT_EQ(*std::max_element(topology.pieces().begin(), topology.pieces().end()), 0U) << "the seam is one surface";
  const auto anywhere = [](std::uint32_t) { return true; };
  const std::uint32_t upper = topology.nearestSkin(sheet.openings.sides[0].upper[0]).value();
  const std::uint32_t lower = topology.nearestSkin(sheet.openings.sides[0].lower[0]).value();
  const double around = topology.reachFrom({upper}, anywhere).distance[lower];
  // Where nothing is said of lips, doubled vertices are seams and the way is straight.
  const HeadTopology sewn(sheet.mesh, {});
  EXPECT_LT(sewn.reachFrom({upper}, anywhere).distance[lower], around);
  EXPECT_TRUE(std::all_of(sewn.forbidden().begin(), sewn.forbidden().end(), [](auto bits) { return bits == 0; }));
  EXPECT_EQ(sewn.lowerShare(upper), 0.5);
  // Without its seam the sheet comes apart.
  for (MeshPart& part : sheet.mesh.parts) part.stands_off = true;
  const HeadTopology apart(sheet.mesh, {});
  EXPECT_EQ(*std::max_element(apart.pieces().begin(), apart.pieces().end()), 1U);
}

/// Closed lips before a mouth bag are two surfaces that go on through the places where they touch: no seam, wherever
/// the lips are thought to be.
TEST(HeadTopology, SurfacesThatTouchAreNotTied) {
  constexpr int kSize = 5;
  FaceMesh mesh;
  mesh.vertices.resize(2 * kSize * kSize, 3);
  for (int sheet = 0; sheet < 2; ++sheet) {
    const int first = sheet * kSize * kSize;
    for (int r = 0; r < kSize; ++r) {
      for (int c = 0; c < kSize; ++c) {
        // Two trays, one upside down on the other: they touch along the middle row.
        const float height = static_cast<float>(std::abs(r - 2)) * (sheet == 0 ? 1.0F : -1.0F);
        mesh.vertices.row(first + r * kSize + c) << static_cast<float>(c), height, static_cast<float>(r);
        if (r + 1 == kSize || c + 1 == kSize) continue;
        const auto at = [&](int row, int column) { return static_cast<std::uint32_t>(first + row * kSize + column); };
        mesh.triangles.push_back({at(r, c), at(r, c + 1), at(r + 1, c + 1)});
        mesh.triangles.push_back({at(r, c), at(r + 1, c + 1), at(r + 1, c)});
      }
    }
  }
  mesh.parts = {{.name = "skin", .triangle_count = mesh.triangles.size()}};
  const auto pieces = HeadTopology(mesh, {}).pieces();
  // At both ends of the row the sheets end, and a seam may join them there.
  const auto reach = HeadTopology(mesh, {}).reachFrom({12}, [](std::uint32_t) { return true; });
  EXPECT_EQ(mesh.vertices.row(12), mesh.vertices.row(37)) << "the middles are in one place";
  EXPECT_NEAR(reach.distance[37], 4, 1e-6) << "the way leads around the end of the row";
  EXPECT_EQ(pieces[12], pieces[37]);
}

/// The other route: relax every edge until nothing gets shorter.
TEST_P(RandomSheets, WaysAreTheShortest) {
  std::mt19937 random(GetParam());
  const SlitSheet sheet = randomSheet(random);
  const HeadTopology topology(sheet.mesh, sheet.openings);
  const std::size_t count = sheet.mesh.vertexCount();
  std::vector<bool> may_pass(count);
  for (std::size_t v = 0; v < count; ++v) may_pass[v] = random() % 8 != 0;
  const std::vector<std::uint32_t> seeds{static_cast<std::uint32_t>(random() % count),
                                         static_cast<std::uint32_t>(random() % count)};
  const auto found = topology.reachFrom(seeds, [&](std::uint32_t v) { return bool{may_pass[v]}; });
  std::vector<double> shortest(count, std::numeric_limits<double>::infinity());
  for (const std::uint32_t seed : seeds) shortest[seed] = 0;
  const auto relax = [&](std::size_t a, std::size_t b) {
    const double length{(sheet.mesh.vertices.row(signedIndex(a)) - sheet.mesh.vertices.row(signedIndex(b))).norm()};
    if (!may_pass[b] || shortest[a] + length >= shortest[b]) return false;
    shortest[b] = shortest[a] + length;
    return true;
  };
  bool changes = true;
  while (changes) {
    changes = false;
    for (const Triangle& t : sheet.mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        changes |= relax(t[k], t[(k + 1) % 3]);
        changes |= relax(t[(k + 1) % 3], t[k]);
      }
    }
    for (std::size_t v = 0; v + 1 < count; ++v) {  // the seam's doubles follow each other
      const auto row = signedIndex(v);
      if (sheet.side[v] != sheet.side[v + 1] || sheet.mesh.vertices.row(row) != sheet.mesh.vertices.row(row + 1))
        continue;
      changes |= relax(v, v + 1);
      changes |= relax(v + 1, v);
    }
  }
  for (std::size_t v = 0; v < count; ++v) {
    if (!std::isfinite(shortest[v])) {
      EXPECT_EQ(found.source[v], -1) << v;
      continue;
    }
    EXPECT_NEAR(found.distance[v], shortest[v], 1e-9) << v;
    EXPECT_TRUE(std::find(seeds.begin(), seeds.end(), static_cast<std::uint32_t>(found.source[v])) != seeds.end());
  }
}

TEST_P(RandomSheets, OpenedElsewhereIsAsIfMadeAnew) {
  std::mt19937 random(GetParam());
  const SlitSheet sheet = randomSheet(random);
  FaceOpenings other = sheet.openings;
  std::swap(other.sides[0].upper, other.sides[0].lower);
  other.sides[1] = sheet.openings.sides[0];
  const HeadTopology made(sheet.mesh, other), opened = HeadTopology(sheet.mesh, {}).openedAt(other);
  EXPECT_EQ(opened.forbidden(), made.forbidden());
  EXPECT_EQ(opened.pieces(), made.pieces());
  EXPECT_EQ(opened.wayToUpperLip(), made.wayToUpperLip());
  EXPECT_EQ(&opened.kinds(), &HeadTopology(opened).kinds()) << "copies share what the mesh tells";
  // Turned over, the sides change places.
  const HeadTopology straight(sheet.mesh, sheet.openings);
  for (std::size_t v = 0; v < made.forbidden().size(); ++v) {
    if (straight.wayToUpperLip()[v] == straight.wayToLowerLip()[v]) continue;
    const std::uint32_t before = straight.forbidden()[v] & (kUpperLip | kLowerLip);
    EXPECT_EQ(made.forbidden()[v] & (kUpperLip | kLowerLip), before == kUpperLip ? kLowerLip : kUpperLip);
    EXPECT_EQ(made.forbidden()[v] >> 2U, before) << "the eye's sides are where the mouth's were";
  }
}

TEST(HeadTopology, KindsOfSharedVerticesAreTheSkins) {
  FaceMesh mesh;
  mesh.vertices = VertexPositions::Random(5, 3);
  mesh.triangles = {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}};
  const auto kindsOf = [&](PartKind a, PartKind b, PartKind c) {
    mesh.parts = {{.name = "a", .kind = a, .triangle_count = 1},
                  {.name = "b", .kind = b, .first_triangle = 1, .triangle_count = 1},
                  {.name = "c", .kind = c, .first_triangle = 2, .triangle_count = 1}};
    return vertexKinds(mesh);
  };
  using enum PartKind;
  EXPECT_EQ(kindsOf(kSkin, kLips, kMouthInside), (std::vector{kSkin, kLips, kLips, kLips, kMouthInside}));
  EXPECT_EQ(kindsOf(kMouthInside, kSkin, kEye), (std::vector{kMouthInside, kSkin, kSkin, kSkin, kEye}));
  EXPECT_EQ(kindsOf(kHair, kMouthInside, kEye), (std::vector{kHair, kMouthInside, kMouthInside, kMouthInside, kEye}));
  EXPECT_EQ(kindsOf(kHair, kEye, kOther), (std::vector{kHair, kHair, kHair, kEye, kOther}));
}

TEST(HeadTopology, TheOpeningsOfAControlMeshAreItsLipsAndLids) {
  const FaceOpenings openings = openingsOf(samples::sampleControl());
  EXPECT_EQ(openings.lip_line.size(), 12U);
  EXPECT_NEAR(openings.lips_reach, 0.06 * samples::sampleControl().mouth_width, 1e-12);
  for (const FaceOpenings::Sides& sides : openings.sides) {
    EXPECT_FALSE(sides.upper.empty());
    EXPECT_FALSE(sides.lower.empty());
    double lowest_above = 1e9, highest_below = -1e9;
    for (const Eigen::Vector3d& p : sides.upper) lowest_above = std::min(lowest_above, p.y());
    for (const Eigen::Vector3d& p : sides.lower) highest_below = std::max(highest_below, p.y());
    EXPECT_GE(lowest_above, highest_below - 1e-9);
  }
  EXPECT_LT(openings.sides[1].upper[0].x(), 0) << "the right eye first";
  EXPECT_GT(openings.sides[2].upper[0].x(), 0);
}

TEST(HeadTopology, AMeshWithoutSkinHasNoNearestSkin) {
  FaceMesh mesh;
  mesh.vertices = VertexPositions::Random(3, 3);
  mesh.triangles = {{0, 1, 2}};
  mesh.parts = {{.name = "eye", .kind = PartKind::kEye, .triangle_count = 1}};
  const HeadTopology topology(mesh, {});
  EXPECT_FALSE(topology.nearestSkin(Eigen::Vector3d::Zero()));
  EXPECT_TRUE(std::isinf(distanceToLine({1, 2, 3}, {})));
  EXPECT_NEAR(distanceToLine({1, 2, 3}, {{1, 2, 0}}), 3, 1e-12);
  EXPECT_NEAR(distanceToLine({1, 1, 0}, {{0, 0, 0}, {2, 0, 0}}), 1, 1e-12);
}

}  // namespace
}  // namespace mouthpiece
