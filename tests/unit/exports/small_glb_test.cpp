// The packed GLB against the plain one, by value.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "exports/gltf/glb.h"
#include "exports/gltf/glb_model.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

TEST(SmallGlb, LosesUnderATenthOfAMillimetre) {
  const samples::TalkingHead head = samples::makeTalkingHead({.ripple_mm = 0.6});
  const PrincipalShapes shapes = principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit);
  const std::string plain = glbBytes(head.mesh, shapes, "head"), small = smallGlbBytes(head.mesh, shapes, "head");
  EXPECT_LT(5 * small.size(), plain.size());

  const FaceMesh a = parseFaceMesh(plain, "a.glb"), b = parseFaceMesh(small, "b.glb");
  const FaceShapes moves_a = parseFaceShapes(plain, "a.glb"), moves_b = parseFaceShapes(small, "b.glb");
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  ASSERT_EQ(a.vertices.rows(), b.vertices.rows());
  ASSERT_EQ(moves_a.names, moves_b.names);
  ASSERT_EQ(moves_a.moves.size(), unsignedIndex(shapes.shapeCount()));
  // Triangles and vertices stand in another order, so a vertex is known by its way through the line: its places at
  // rest and in some frames, one beside the other.
  const auto waysOf = [&](const FaceMesh& mesh, const FaceShapes& shown) {
    const std::vector<Eigen::Index> frames{0, 11, 30, 47, 71, 90, 119};
    Eigen::MatrixXf ways(mesh.vertices.rows(), 3 * (1 + std::ssize(frames)));
    ways.leftCols<3>() = mesh.vertices;
    for (Eigen::Index i = 0; i < std::ssize(frames); ++i) {
      VertexPositions at = mesh.vertices;
      for (std::size_t k = 0; k < shown.moves.size(); ++k)
        at += shapes.weights(frames[unsignedIndex(i)], signedIndex(k)) * shown.moves[k];
      ways.middleCols<3>(3 * (i + 1)) = at;
    }
    return ways;
  };
  const Eigen::MatrixXf ways_a = waysOf(a, moves_a), ways_b = waysOf(b, moves_b);
  const double mm = 1000 * a.metres_per_unit;
  double worst = 0;
  std::set<Eigen::Index> met;
  std::vector<std::uint32_t> a_from_b(b.vertexCount());
  for (Eigen::Index v = 0; v < ways_b.rows(); ++v) {
    const Eigen::MatrixXf off = ways_a.rowwise() - ways_b.row(v);
    Eigen::Index nearest = 0;
    off.rowwise().squaredNorm().minCoeff(&nearest);
    met.insert(nearest);
    a_from_b[unsignedIndex(v)] = static_cast<std::uint32_t>(nearest);
    for (Eigen::Index frame = 0; frame < off.cols(); frame += 3)
      worst = std::max(worst, mm * static_cast<double>(off.row(nearest).segment<3>(frame).norm()));
  }
  EXPECT_EQ(std::ssize(met), ways_a.rows()) << "every vertex is there once";
  // The same triangles, each beginning with its least corner.
  const auto trianglesOf = [](std::vector<Triangle> triangles) {
    for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(triangles.begin(), triangles.end());
    return triangles;
  };
  std::vector<Triangle> renumbered = b.triangles;
  for (Triangle& t : renumbered) {
    for (std::uint32_t& corner : t) corner = a_from_b[corner];
  }
  EXPECT_EQ(trianglesOf(renumbered), trianglesOf(a.triangles));
  EXPECT_LT(worst, 0.1) << "mm";
  EXPECT_GT(worst, 0) << "nothing was packed";
}

TEST(HeadAnimation, TurnsWhatIsShownAboutItsPlace) {
  const samples::TalkingHead head = samples::makeTalkingHead({.ripple_mm = 0.6});
  const PrincipalShapes shapes = principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit);
  HeadAnimation track{std::vector<std::array<float, 4>>(unsignedIndex(shapes.frameCount()), {0, 0.1F, 0, 0.995F}),
                      {0.01, 0.02, -0.03}};
  for (const std::string& bytes :
       {glbBytes(head.mesh, shapes, "head", {}, &track), smallGlbBytes(head.mesh, shapes, "head", &track)}) {
    const GlbModel model(bytes, "head.glb");
    const nlohmann::json& root = model.root;
    const auto turning = root["scenes"][0]["nodes"][0].get<std::size_t>();
    ASSERT_EQ(root["scenes"][0]["nodes"].size(), 1U);
    EXPECT_EQ(root["nodes"][turning]["translation"], nlohmann::json({0.01, 0.02, -0.03}));
    const nlohmann::json& back = root["nodes"][root["nodes"][turning]["children"][0].get<std::size_t>()];
    EXPECT_EQ(back["translation"], nlohmann::json({-0.01, -0.02, 0.03})) << "at rest nothing moves";
    EXPECT_EQ(back["children"], nlohmann::json::array({0})) << "the face";
    ASSERT_EQ(root["animations"].size(), 1U);
    const nlohmann::json& channel = root["animations"][0]["channels"].back();
    EXPECT_EQ(channel["target"], nlohmann::json({{"node", turning}, {"path", "rotation"}}));
    const auto sampler = channel["sampler"].get<std::size_t>();
    const nlohmann::json& accessor =
        root["accessors"][root["animations"][0]["samplers"][sampler]["output"].get<std::size_t>()];
    EXPECT_EQ(accessor["count"], shapes.frameCount());
    EXPECT_EQ(accessor["type"], "VEC4");
    EXPECT_EQ(parseFaceMesh(bytes, "head.glb").vertexCount(), head.mesh.vertexCount()) << "it is still read as a head";
  }
}

}  // namespace
}  // namespace mouthpiece
