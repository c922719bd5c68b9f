// The packed GLB against the plain one, by value.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "exports/gltf/glb.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

TEST(SmallGlb, LosesUnderATenthOfAMillimetre) {
  const testing::TalkingHead head = testing::makeTalkingHead({.ripple_mm = 0.6});
  const PrincipalShapes shapes = principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit);
  const std::string plain = glbBytes(head.mesh, shapes, "head"), small = smallGlbBytes(head.mesh, shapes, "head");
  EXPECT_LT(3 * small.size(), plain.size());

  const FaceMesh a = parseFaceMesh(plain, "a.glb"), b = parseFaceMesh(small, "b.glb");
  const FaceShapes moves_a = parseFaceShapes(plain, "a.glb"), moves_b = parseFaceShapes(small, "b.glb");
  ASSERT_EQ(a.triangles.size(), b.triangles.size());
  ASSERT_EQ(moves_a.names, moves_b.names);
  ASSERT_EQ(moves_a.moves.size(), unsignedIndex(shapes.shapeCount()));
  const auto row = [](const VertexPositions& at, std::uint32_t vertex) {
    return at.row(signedIndex(std::size_t{vertex}));
  };
  // The vertices stand in another order, and a packed triangle may begin with another corner.
  std::vector<std::array<std::uint32_t, 2>> corners;
  for (std::size_t t = 0; t < a.triangles.size(); ++t) {
    std::size_t turn = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t by = 0; by < 3; ++by) {
      double off = 0;
      for (std::size_t c = 0; c < 3; ++c)
        off += static_cast<double>(
            (row(a.vertices, a.triangles[t][c]) - row(b.vertices, b.triangles[t][(c + by) % 3])).norm());
      if (off < least) turn = by;
      least = std::min(least, off);
    }
    for (std::size_t c = 0; c < 3; ++c) corners.push_back({a.triangles[t][c], b.triangles[t][(c + turn) % 3]});
  }
  const double mm = 1000 * a.metres_per_unit;
  double worst = 0;
  for (const Eigen::Index frame : {0, 11, 30, 47, 71, 90, 119}) {
    VertexPositions at_a = a.vertices, at_b = b.vertices;
    for (std::size_t k = 0; k < moves_a.moves.size(); ++k) {
      at_a += shapes.weights(frame, signedIndex(k)) * moves_a.moves[k];
      at_b += shapes.weights(frame, signedIndex(k)) * moves_b.moves[k];
    }
    for (const auto& [of_a, of_b] : corners)
      worst = std::max(worst, mm * static_cast<double>((row(at_a, of_a) - row(at_b, of_b)).norm()));
  }
  EXPECT_LT(worst, 0.1) << "mm";
  EXPECT_GT(worst, 0) << "nothing was packed";
}

}  // namespace
}  // namespace mouthpiece
