// Meshes torn apart and sewn again.
#include "deform/topology/welding.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/binding.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

/// A bumpy ball.
FaceMesh ball(std::mt19937& random) {
  const auto rings = static_cast<std::uint32_t>(4 + random() % 6),
             around = static_cast<std::uint32_t>(5 + random() % 8);
  std::uniform_real_distribution<double> bump(0.9, 1.1);
  FaceMesh mesh;
  mesh.vertices.resize(rings * around + 2, 3);
  const auto at = [&](std::uint32_t r, std::uint32_t k) { return r * around + k % around; };
  for (std::uint32_t r = 0; r < rings; ++r) {
    const double angle = 3.14159 * (r + 1) / (rings + 1);
    for (std::uint32_t k = 0; k < around; ++k) {
      const double turn = 6.28318 * k / around, radius = 10 * bump(random);
      mesh.vertices.row(at(r, k)) << asFloat(radius * std::sin(angle) * std::cos(turn)),
          asFloat(radius * std::cos(angle)), asFloat(radius * std::sin(angle) * std::sin(turn));
    }
  }
  const std::uint32_t top = rings * around, bottom = top + 1;
  mesh.vertices.row(top) << 0, 10, 0;
  mesh.vertices.row(bottom) << 0, -10, 0;
  for (std::uint32_t k = 0; k < around; ++k) {
    mesh.triangles.push_back({top, at(0, k + 1), at(0, k)});
    mesh.triangles.push_back({bottom, at(rings - 1, k), at(rings - 1, k + 1)});
    for (std::uint32_t r = 0; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, k), at(r, k + 1), at(r + 1, k)});
      mesh.triangles.push_back({at(r, k + 1), at(r + 1, k + 1), at(r + 1, k)});
    }
  }
  mesh.parts = {{.name = "ball", .triangle_count = mesh.triangles.size()}};
  return mesh;
}

/// Every triangle with corners of its own, in a random order.
FaceMesh tornApart(const FaceMesh& mesh, std::mt19937& random, std::vector<std::uint32_t>* from = nullptr) {
  std::vector<std::uint32_t> numbers(3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  std::shuffle(numbers.begin(), numbers.end(), random);
  FaceMesh torn = mesh;
  torn.vertices.resize(signedIndex(numbers.size()), 3);
  std::vector<std::uint32_t> origin(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    std::uint32_t& corner = torn.triangles[i / 3][i % 3];
    torn.vertices.row(numbers[i]) = mesh.vertices.row(corner);
    origin[numbers[i]] = corner;
    corner = numbers[i];
  }
  if (from != nullptr) *from = origin;
  return torn;
}

class Torn : public ::testing::TestWithParam<unsigned> {};
INSTANTIATE_TEST_SUITE_P(Seeds, Torn, ::testing::Range(1U, 13U));

TEST_P(Torn, IsSewnToWhatItWas) {
  std::mt19937 random(GetParam());
  const FaceMesh whole = ball(random);
  std::vector<std::uint32_t> origin;
  const FaceMesh torn = tornApart(whole, random, &origin);
  const Welding welding = weldSplitTriangles(torn);
  ASSERT_FALSE(welding.isNothing());
  EXPECT_EQ(welding.mesh.vertices.rows(), whole.vertices.rows());
  EXPECT_EQ(welding.mesh.triangles.size(), whole.triangles.size());
  // Given vertices are one where they were one, and only there.
  std::map<std::uint32_t, std::uint32_t> welded_of;
  for (std::size_t v = 0; v < origin.size(); ++v) {
    const auto [known, is_new] = welded_of.emplace(origin[v], welding.welded_of[v]);
    EXPECT_EQ(known->second, welding.welded_of[v]) << v;
  }
  for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(welding.mesh.triangles[t][k], welded_of.at(whole.triangles[t][k]));
  }
  EXPECT_TRUE(weldSplitTriangles(welding.mesh).isNothing()) << "sewn once it is sewn";
}

TEST_P(Torn, NamesAndPlacesGoThereAndBack) {
  std::mt19937 random(GetParam());
  const FaceMesh torn = tornApart(ball(random), random);
  const Welding welding = weldSplitTriangles(torn);
  ASSERT_EQ(welding.welded_of.size(), torn.vertexCount());
  for (std::uint32_t v = 0; v < welding.given_of.size(); ++v) {
    EXPECT_EQ(welding.welded_of[welding.given_of[v]], v);
    if (v > 0) {
      EXPECT_GT(welding.given_of[v], welding.given_of[v - 1]) << "welded vertices keep the order of the first given";
    }
  }
  for (std::uint32_t v = 0; v < welding.welded_of.size(); ++v) {
    EXPECT_LE(welding.given_of[welding.welded_of[v]], v) << "a set is called by the least of its vertices";
    EXPECT_EQ(welding.mesh.vertices.row(welding.welded_of[v]), torn.vertices.row(v));
  }
  const VertexPositions moved = VertexPositions::Random(signedIndex(welding.given_of.size()), 3);
  VertexPositions given;
  welding.givenFromWelded(moved, given);
  EXPECT_EQ(welding.weldedFromGiven(given), moved);
}

TEST_P(Torn, BindingsGoThereAndBack) {
  std::mt19937 random(GetParam());
  const FaceMesh torn = tornApart(ball(random), random);
  const Welding welding = weldSplitTriangles(torn);
  std::uniform_real_distribution<float> share(0, 1);
  FaceBinding welded;
  for (std::uint32_t v = 0; v < welding.given_of.size(); ++v) {
    welded.patch.push_back(static_cast<std::int32_t>(random() % 50));
    for (auto* column : {&welded.u, &welded.v, &welded.d, &welded.skin_weight, &welded.jaw_weight})
      column->push_back(share(random));
    if (random() % 4 == 0) welded.carried.push_back(v);
  }
  const FaceBinding given = givenBinding(welded, welding);
  ASSERT_EQ(given.patch.size(), torn.vertexCount());
  for (std::size_t v = 0; v < given.patch.size(); ++v) {
    EXPECT_EQ(given.d[v], welded.d[welding.welded_of[v]]);
    EXPECT_EQ(isCarried(given, v), isCarried(welded, welding.welded_of[v]));
  }
  const FaceBinding again = weldedBinding(given, welding);
  EXPECT_EQ(again.patch, welded.patch);
  EXPECT_EQ(again.u, welded.u);
  EXPECT_EQ(again.jaw_weight, welded.jaw_weight);
  EXPECT_EQ(again.carried, welded.carried);
}

/// Two balls that touch along nothing but share no edge: each stays itself, wherever the other is.
TEST_P(Torn, TwoSolidsStayTwo) {
  std::mt19937 random(GetParam());
  const FaceMesh one = ball(random);
  FaceMesh two = one;
  const auto count = static_cast<std::uint32_t>(one.vertices.rows());
  two.vertices.conservativeResize(2 * count, 3);
  two.vertices.bottomRows(count) = one.vertices.rowwise() + Eigen::RowVector3f(25, 0, 0);
  for (const Triangle& t : one.triangles) two.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  two.parts[0].triangle_count = two.triangles.size();
  const Welding welding = weldSplitTriangles(tornApart(two, random));
  EXPECT_EQ(welding.mesh.vertices.rows(), 2 * count);
}

TEST(Welding, LeavesAWholeMeshAlone) {
  EXPECT_TRUE(weldSplitTriangles(samples::sampleFace().mesh).isNothing()) << "its lips touch and stay apart";
}

TEST(Welding, ATornFaceIsBoundAsTheWholeOne) {
  std::mt19937 random(4);
  const samples::SampleFace face = samples::makeSampleFace(5);
  std::vector<std::uint32_t> origin;
  const FaceMesh torn = tornApart(face.mesh, random, &origin);
  const Welding welding = weldSplitTriangles(torn);
  const FaceBinding whole = bindFace(face.mesh, samples::sampleControl());
  const FaceBinding sewn = givenBinding(bindFace(welding.mesh, samples::sampleControl()), welding);
  std::size_t same = 0;
  for (std::size_t v = 0; v < origin.size(); ++v) {
    if (sewn.patch[v] == whole.patch[origin[v]]) ++same;
  }
  EXPECT_GT(asReal(same), 0.99 * asReal(origin.size())) << "the mouth's corners may go to either lip";
}

}  // namespace
}  // namespace mouthpiece
