// Loop subdivision with creases: the tool the default face is made with.
#include "deform/mesh/face_mesh.h"
#include "retarget/sample_head/head_model.h"

#include <gtest/gtest.h>

#include <map>

namespace mouthpiece {
namespace {

/// A bumpy sheet of n x n squares.
ModelMesh sheet(int n) {
  ModelMesh mesh;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) mesh.addVertex({1.0 * x, 1.0 * y, (x * 7 + y * 3) % 5 * 0.2});
  }
  const auto at = [n](int x, int y) { return static_cast<std::uint32_t>(y * (n + 1) + x); };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) mesh.addQuad(at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1), 0);
  }
  return mesh;
}

/// No edge belongs to more than two triangles, and each direction of it to at most one.
void expectManifold(const ModelMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(++uses[std::make_pair(t[k], t[(k + 1) % 3])], 1);
  }
}

TEST(LoopSubdivision, MakesFourTrianglesOfOneAndKeepsNumbers) {
  const ModelMesh mesh = sheet(4);
  const ModelMesh finer = loopSubdivided(mesh);
  EXPECT_EQ(finer.triangles.size(), 4 * mesh.triangles.size());
  expectManifold(finer);
  for (std::uint32_t v = 0; v < mesh.vertices.rows(); ++v) EXPECT_LT((finer.point(v) - mesh.point(v)).norm(), 1.0);
}

TEST(LoopSubdivision, KeepsAPlaneAndItsChannelsLinear) {
  ModelMesh mesh = sheet(4);
  for (std::uint32_t v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.vertices(v, kZ) = 2 * mesh.vertices(v, kX) - mesh.vertices(v, kY);
    mesh.vertices(v, kVermilion) = 0.1 * mesh.vertices(v, kX);
  }
  const ModelMesh finer = loopSubdivided(mesh);
  for (std::uint32_t v = 0; v < finer.vertices.rows(); ++v) {
    EXPECT_NEAR(finer.vertices(v, kZ), 2 * finer.vertices(v, kX) - finer.vertices(v, kY), 1e-12);
    EXPECT_NEAR(finer.vertices(v, kVermilion), 0.1 * finer.vertices(v, kX), 1e-12);
  }
}

TEST(LoopSubdivision, ACreaseForgetsWhatLiesBesideIt) {
  ModelMesh mesh = sheet(4);
  for (std::uint32_t x = 0; x < 4; ++x) mesh.creases.insert(ModelMesh::edge(10 + x, 11 + x));  // the middle row
  ModelMesh moved = mesh;
  for (std::uint32_t v = 0; v < 10; ++v) moved.vertices(v, kZ) += 50;  // one side goes away
  const ModelMesh a = loopSubdivided(loopSubdivided(mesh));
  const ModelMesh b = loopSubdivided(loopSubdivided(moved));
  for (std::uint32_t v = 10; v <= 14; ++v) EXPECT_LT((a.point(v) - b.point(v)).norm(), 1e-12);
  EXPECT_EQ(a.creases.size(), 16U);
}

TEST(LoopSubdivision, RefiningARegionLeavesNoGap) {
  const ModelMesh mesh = sheet(6);
  const ModelMesh finer = loopSubdividedWhere(mesh, [](std::size_t triangle) { return triangle % 7 == 0; });
  expectManifold(finer);
  EXPECT_GT(finer.triangles.size(), mesh.triangles.size());
  // The sheet keeps its area in the plane: nothing is missing or doubled.
  double area = 0;
  for (const auto& [a, b, c] : finer.triangles) {
    const Eigen::Vector3d u = finer.point(b) - finer.point(a);
    const Eigen::Vector3d w = finer.point(c) - finer.point(a);
    area += 0.5 * (u.x() * w.y() - u.y() * w.x());
  }
  EXPECT_NEAR(area, 36, 1e-9);
}

TEST(LoopSubdivision, FittedVerticesLieOnTheLimit) {
  ModelMesh mesh = sheet(5);
  const ModelMesh::Channels wanted = mesh.vertices;
  fitLimitToVertices(mesh, static_cast<std::size_t>(mesh.vertices.rows()), 1.0, 60);
  EXPECT_LT((loopLimit(mesh) - wanted).leftCols<3>().cwiseAbs().maxCoeff(), 1e-3);
}

}  // namespace
}  // namespace mouthpiece
