// FBX and USD as other programs' readers meet them: tests/blender and tests/browser read them whole.
#include "exports/scenes/scene_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <optional>
#include <vector>

#include "base/text_encoding.h"
#include "deform/mesh/face_mesh.h"
#include "exports/scenes/scene_shape.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using samples::makeTalkingHead;
using samples::TalkingHead;

PrincipalShapes shapesOf(const TalkingHead& head) {
  return principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit);
}

/// The first record of a binary FBX 7.4 with this name, from its header to its end.
std::optional<std::string> fbxRecord(const std::string& fbx, const std::string& name) {
  const std::string marked = std::string(1, static_cast<char>(name.size())) + name;
  for (std::size_t at = fbx.find(marked); at != std::string::npos; at = fbx.find(marked, at + 1)) {
    std::uint32_t end = 0;
    std::memcpy(&end, fbx.data() + at - 12, sizeof(end));
    if (end > at && end <= fbx.size()) return fbx.substr(at - 12, end - (at - 12));
  }
  return std::nullopt;
}

/// The colour that a record of a material has.
std::vector<double> diffuseOf(const std::string& record) {
  std::vector<double> color;
  const std::size_t at = record.find("DiffuseColor");
  for (std::size_t i = record.find('D', at + 13); i + 9 <= record.size() && color.size() < 3; i += 9) {
    double value = 0;
    std::memcpy(&value, record.data() + i + 1, sizeof(value));
    color.push_back(value);
  }
  return color;
}

// Assimp 5.2 reads no animation of a layer whose record has no end of its own.
TEST(Fbx, AnimationLayerEndsWithANullRecord) {
  const TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  const auto layer = fbxRecord(fbxBytes(head.mesh, shapesOf(head), "egg"), "AnimationLayer");
  ASSERT_TRUE(layer);
  EXPECT_TRUE(layer->ends_with(std::string(13, '\0')));
}

TEST(Scenes, PartsHaveTheMeanOfTheirVerticesColours) {
  TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  head.mesh.vertex_colors.assign(head.mesh.vertexCount(), {0.5F, 0.25F, 0.125F});
  for (MeshPart& part : head.mesh.parts) part.base_color = {1, 0.5F, 1, 1};
  const PrincipalShapes shapes = shapesOf(head);
  const auto material = fbxRecord(fbxBytes(head.mesh, shapes, "egg"), "Material");
  ASSERT_TRUE(material);
  const std::vector<double> color = diffuseOf(*material);
  ASSERT_EQ(color.size(), 3U);
  EXPECT_NEAR(color[0], 0.5, 1e-5);
  EXPECT_NEAR(color[1], 0.125, 1e-5);
  EXPECT_NEAR(color[2], 0.125, 1e-5);
  EXPECT_NE(usdaText(head.mesh, shapes, "egg").find("inputs:diffuseColor = (0.5, 0.125, 0.125)"), std::string::npos);
}

TEST(Scenes, HaveNormalsAtRest) {
  const TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  const PrincipalShapes shapes = shapesOf(head);
  const std::string fbx = fbxBytes(head.mesh, shapes, "egg");
  const auto layer = fbxRecord(fbx, "LayerElementNormal");
  ASSERT_TRUE(layer);
  EXPECT_NE(layer->find("ByVertice"), std::string::npos);
  EXPECT_TRUE(fbxRecord(fbx, "LayerElementSmoothing"));
  const std::string usd = usdaText(head.mesh, shapes, "egg");
  EXPECT_NE(usd.find("normal3f[] normals = [("), std::string::npos);
  EXPECT_NE(usd.find("vector3f[] normalOffsets = [("), std::string::npos);
}

/// Moves and turns of a shape come to the vertices that they belong to.
TEST(Scenes, AShapeHoldsWhatItMovesAndWhatItTurns) {
  const TalkingHead head = makeTalkingHead({.rings = 12, .segments = 16});
  const PrincipalShapes shapes = shapesOf(head);
  const ShapeNormals normals = shapeNormals(head.mesh.triangles, shapes);
  const std::vector<std::uint32_t> columns = shapes.columnVertices();
  ASSERT_GT(shapes.shapeCount(), 0);
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k) {
    const SceneShape shape = sceneShape(shapes, normals, k);
    VertexPositions moves = VertexPositions::Zero(head.mesh.vertices.rows(), 3), turns = moves;
    for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
      ASSERT_TRUE(i == 0 || shape.vertices[i - 1] < shape.vertices[i]);
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        moves(shape.vertices[i], axis) = shape.moves[3 * i + static_cast<std::size_t>(axis)];
        turns(shape.vertices[i], axis) = shape.turns[3 * i + static_cast<std::size_t>(axis)];
      }
    }
    for (std::size_t i = 0; i < columns.size(); ++i) {
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        ASSERT_EQ(moves(columns[i], axis), shapes.shapes(k, 3 * static_cast<Eigen::Index>(i) + axis));
    }
    const ShapeNormals::Turns& turned = normals.shapes[static_cast<std::size_t>(k)];
    for (std::size_t i = 0; i < turned.vertices.size(); ++i) {
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        ASSERT_EQ(turns(turned.vertices[i], axis), turned.values[3 * i + static_cast<std::size_t>(axis)]);
    }
  }
}

TEST(Usd, ShowsNamesAsTheyAre) {
  TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  head.mesh.parts[0].name = "肌 \"x\"\n\\";
  const std::string usd = usdaText(head.mesh, shapesOf(head), "Ann \"O'Neil\" 太郎");
  EXPECT_NE(usd.find("displayName = \"肌 \\\"x\\\" \\\\\"\n"), std::string::npos);
  EXPECT_NE(usd.find("displayName = \"Ann \\\"O'Neil\\\" 太郎\"\n"), std::string::npos);
}

}  // namespace
}  // namespace mouthpiece
