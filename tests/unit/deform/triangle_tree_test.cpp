// Closest points, boxes and heights against a look at every triangle.
#include "deform/mesh/triangle_tree.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <optional>
#include <random>

#include "deform/mesh/moving_triangles.h"

namespace mouthpiece {
namespace {

struct Soup {
  VertexPositions vertices;
  std::vector<Triangle> triangles;
};

Soup randomSoup(std::mt19937& random) {
  std::uniform_real_distribution<float> place(-10, 10), size(-2, 2);
  const auto count = static_cast<std::uint32_t>(1 + random() % 80);
  Soup soup{VertexPositions(3 * count, 3), {}};
  for (std::uint32_t t = 0; t < count; ++t) {
    const Eigen::RowVector3f at(place(random), place(random), place(random));
    for (std::uint32_t k = 0; k < 3; ++k)
      soup.vertices.row(3 * t + k) = at + Eigen::RowVector3f(size(random), size(random), size(random));
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  return soup;
}

double distanceToEdge(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const double way = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - way * (b - a)).norm();
}

/// The plane where the foot falls inside, else the nearest edge.
double distanceTo(const Soup& soup, const Triangle& t, const Eigen::Vector3d& p) {
  const std::array<Eigen::Vector3d, 3> c{pointAt(soup.vertices, t[0]), pointAt(soup.vertices, t[1]),
                                         pointAt(soup.vertices, t[2])};
  const Eigen::Vector3d normal = (c[1] - c[0]).cross(c[2] - c[0]).normalized();
  bool is_inside = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d &a = c[k], &b = c[(k + 1) % 3];
    is_inside = is_inside && (b - a).cross(p - a).dot(normal) >= 0;
    nearest = std::min(nearest, distanceToEdge(p, a, b));
  }
  return is_inside ? std::abs((p - c[0]).dot(normal)) : nearest;
}

class RandomSoups : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, RandomSoups, ::testing::Range(1U, 13U));

TEST_P(RandomSoups, TheClosestPointIsThatOfEveryTriangle) {
  std::mt19937 random(GetParam());
  const Soup soup = randomSoup(random);
  const TriangleTree tree(soup.vertices, soup.triangles);
  std::uniform_real_distribution<double> place(-15, 15);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    double nearest = std::numeric_limits<double>::infinity();
    for (const Triangle& triangle : soup.triangles) nearest = std::min(nearest, distanceTo(soup, triangle, p));
    const auto foot = tree.closest(p);
    ASSERT_TRUE(foot);
    EXPECT_NEAR((foot->point - p).norm(), nearest, 1e-9);
    // The weights say the same place.
    const Triangle& t = soup.triangles[foot->triangle];
    Eigen::Vector3d again = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) again += foot->weights[signedIndex(k)] * pointAt(soup.vertices, t[k]);
    EXPECT_LT((again - foot->point).norm(), 1e-6);
    EXPECT_NEAR(foot->weights.sum(), 1, 1e-9);
    EXPECT_GT(foot->weights.minCoeff(), -1e-6);
    // Looked for no further off it is the same one, wherever the search begins, or none.
    const TriangleTree::Foot begin{pointAt(soup.vertices, t[0]), foot->triangle, Eigen::Vector3d::UnitX()};
    for (const TriangleTree::Foot* begin_at : {static_cast<const TriangleTree::Foot*>(nullptr), &begin}) {
      const auto near_one = tree.closest(p, begin_at, nearest + 1e-6);
      ASSERT_TRUE(near_one);
      EXPECT_NEAR((near_one->point - p).norm(), nearest, 1e-9);
      EXPECT_FALSE(tree.closest(p, begin_at, nearest - 1e-6));
    }
  }
}

/// Made of another pose and with triangles that have lost their area it finds what a tree of this one does.
TEST_P(RandomSoups, TrianglesThatHaveMovedAreWhereTheyAre) {
  std::mt19937 random(GetParam());
  Soup soup = randomSoup(random);
  const MovingTriangles moving(soup.vertices, soup.triangles);
  std::uniform_real_distribution<float> way(-3, 3);
  for (float& x : soup.vertices.reshaped()) x += way(random);
  for (std::size_t t = 1; t < soup.triangles.size(); t += 7)
    soup.vertices.row(soup.triangles[t][2]) = soup.vertices.row(soup.triangles[t][0]);
  const MovingTriangles::Posed posed(moving, soup.vertices);
  const TriangleTree tree(soup.vertices, soup.triangles);
  std::uniform_real_distribution<double> place(-15, 15);
  std::optional<TriangleTree::Foot> last;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p(place(random), place(random), place(random));
    const auto expected = tree.closest(p);
    ASSERT_TRUE(expected);
    const double nearest = (expected->point - p).norm();
    const TriangleTree::Foot* const before = last ? &*last : nullptr;
    for (const TriangleTree::Foot* begin_at : {static_cast<const TriangleTree::Foot*>(nullptr), before}) {
      for (const double within : {std::numeric_limits<double>::infinity(), nearest + 1e-6}) {
        const auto foot = posed.closest(p, begin_at, within);
        ASSERT_TRUE(foot);
        EXPECT_EQ(foot->triangle, expected->triangle);
        EXPECT_LT((foot->point - expected->point).norm(), 1e-6);
        EXPECT_LT((foot->weights - expected->weights).norm(), 1e-6);
      }
      EXPECT_FALSE(posed.closest(p, begin_at, nearest - 1e-6));
    }
    last = expected;
  }
  const MovingTriangles none;
  EXPECT_FALSE(MovingTriangles::Posed(none, soup.vertices).closest({0, 0, 0}, nullptr, 1));
}

TEST_P(RandomSoups, ABoxTouchesTheTrianglesWhoseBoxesDo) {
  std::mt19937 random(GetParam());
  const Soup soup = randomSoup(random);
  const TriangleTree tree(soup.vertices, soup.triangles);
  std::uniform_real_distribution<double> place(-12, 12), size(0, 6);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d low(place(random), place(random), place(random));
    const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d(size(random), size(random), size(random)));
    std::vector<std::size_t> expected;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
      Eigen::AlignedBox3d own;
      for (const std::uint32_t v : soup.triangles[t]) own.extend(pointAt(soup.vertices, v));
      if (own.intersects(box)) expected.push_back(t);
    }
    EXPECT_EQ(tree.touching(box), expected);
  }
}

/// A net without gaps: straight over any place lies one triangle, on its edges and corners, too.
TEST_P(RandomSoups, OverEveryPlaceOfASurfaceLiesOneTriangle) {
  std::mt19937 random(GetParam());
  constexpr int kCells = 8;
  Soup net{VertexPositions((kCells + 1) * (kCells + 1), 3), {}};
  const auto height = [](double x, double z) { return 2 * x - 3 * z + 5; };
  for (std::uint32_t i = 0; i <= kCells; ++i) {
    for (std::uint32_t j = 0; j <= kCells; ++j) {
      net.vertices.row(i * (kCells + 1) + j) << asFloat(i), asFloat(height(asReal(i), asReal(j))), asFloat(j);
      if (i == kCells || j == kCells) continue;
      const std::uint32_t a = i * (kCells + 1) + j, b = a + kCells + 1;
      const bool cut = random() % 2 == 0;
      const Triangle one = cut ? Triangle{a, b, b + 1} : Triangle{a, b, a + 1};
      const Triangle two = cut ? Triangle{a, b + 1, a + 1} : Triangle{b, b + 1, a + 1};
      net.triangles.push_back(random() % 2 == 0 ? one : Triangle{one[0], one[2], one[1]});  // some inside out
      net.triangles.push_back(two);
    }
  }
  const TriangleTree tree(net.vertices, net.triangles);
  std::uniform_int_distribution<int> quarter(1, 4 * kCells - 1);
  for (int i = 0; i < 200; ++i) {
    const double x = quarter(random) / 4.0, z = quarter(random) / 4.0;
    const auto crossings = tree.crossings(x, z);
    ASSERT_EQ(crossings.size(), 1U) << x << " " << z;
    EXPECT_NEAR(crossings[0].height, height(x, z), 1e-9);
  }
  EXPECT_TRUE(tree.crossings(-1, 2).empty());
  EXPECT_TRUE(tree.crossings(2, kCells + 0.5).empty());
}

TEST(TriangleTree, NoTrianglesAreNear) {
  const TriangleTree none(VertexPositions::Zero(3, 3), {});
  EXPECT_TRUE(none.empty());
  EXPECT_FALSE(none.closest({0, 0, 0}));
  EXPECT_TRUE(none.crossings(0, 0).empty());
  EXPECT_TRUE(none.touching({Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}).empty());
  const std::vector<Triangle> flat{{0, 1, 2}};
  EXPECT_TRUE(TriangleTree(VertexPositions::Zero(3, 3), flat).empty()) << "a point is no triangle";
}

}  // namespace
}  // namespace mouthpiece
