#include "exports/gltf/glb.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "deform/mesh/face_mesh.h"
#include "support/glb_file.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using samples::makeTalkingHead;
using samples::TalkingHead;
using test::GlbFile;

GlbFile glbOf(const TalkingHead& head) {
  return GlbFile(
      glbBytes(head.mesh, principalShapes(head.animation, head.mesh.vertices, head.mesh.metres_per_unit), "egg"));
}

/// Positions of one primitive in one frame, as a reader of glTF computes them.
std::vector<double> positionsAt(const GlbFile& glb, const nlohmann::json& primitive, std::size_t frame) {
  auto positions = glb.accessor(primitive["attributes"]["POSITION"]);
  const auto weights = glb.accessor(glb.root["animations"][0]["samplers"][0]["output"]);
  const std::size_t shapes = primitive["targets"].size();
  for (std::size_t k = 0; k < shapes; ++k) {
    const auto target = glb.accessor(primitive["targets"][k]["POSITION"]);
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += weights[frame * shapes + k] * target[i];
  }
  return positions;
}

/// The mesh's vertices that a part uses, rising: the order in which the primitive holds them.
std::vector<std::uint32_t> usedVertices(const FaceMesh& mesh, const MeshPart& part) {
  std::vector<std::uint32_t> used;
  for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
    used.insert(used.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  }
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

TEST(Glb, EveryFrameComesBackWithinATenthOfAMillimetre) {
  const TalkingHead head = makeTalkingHead({.rings = 12, .segments = 16, .ripple_mm = 0.4});
  const GlbFile glb = glbOf(head);
  const auto& primitives = glb.root["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 3U);
  double largest_mm = 0;
  for (std::size_t p = 0; p < primitives.size(); ++p) {
    const auto used = usedVertices(head.mesh, head.mesh.parts[p]);
    for (const std::size_t frame : {0U, 17U, 30U, 64U, 119U}) {
      const auto positions = positionsAt(glb, primitives[p], frame);
      ASSERT_EQ(positions.size(), 3 * used.size());
      for (std::size_t i = 0; i < used.size(); ++i) {
        const Eigen::Vector3d shown(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
        const Eigen::Vector3f expected =
            head.animation.positions.block<1, 3>(static_cast<Eigen::Index>(frame), 3 * used[i]).transpose();
        largest_mm = std::max(largest_mm, (1000 * shown - expected.cast<double>()).norm());
      }
    }
  }
  EXPECT_LE(largest_mm, 0.1);
  EXPECT_GT(largest_mm, 0) << "a comparison of a thing with itself";
}

TEST(Glb, TrianglesAreThoseOfTheMesh) {
  const TalkingHead head = makeTalkingHead({.frames = 8, .rings = 5, .segments = 7});
  const GlbFile glb = glbOf(head);
  for (std::size_t p = 0; p < head.mesh.parts.size(); ++p) {
    const MeshPart& part = head.mesh.parts[p];
    const auto used = usedVertices(head.mesh, part);
    const auto indices = glb.accessor(glb.root["meshes"][0]["primitives"][p]["indices"]);
    ASSERT_EQ(indices.size(), 3 * part.triangle_count);
    for (std::size_t i = 0; i < indices.size(); ++i) {
      EXPECT_EQ(used[static_cast<std::size_t>(indices[i])], head.mesh.triangles[part.first_triangle + i / 3][i % 3]);
    }
  }
}

TEST(Glb, TheAnimationRunsAtTheFrameRate) {
  const TalkingHead head = makeTalkingHead({.frames = 48, .frame_rate_hz = 24});
  const GlbFile glb = glbOf(head);
  const auto times = glb.accessor(glb.root["animations"][0]["samplers"][0]["input"]);
  ASSERT_EQ(times.size(), 48U);
  EXPECT_EQ(times.front(), 0);
  EXPECT_FLOAT_EQ(static_cast<float>(times.back()), 47.0F / 24);
  EXPECT_EQ(glb.root["animations"][0]["samplers"][0]["interpolation"], "LINEAR");
}

TEST(Glb, NamesBoundsAndMaterialsAreThere) {
  const TalkingHead head = makeTalkingHead({.frames = 20});
  const GlbFile glb = glbOf(head);
  EXPECT_EQ(glb.root["asset"]["generator"], "Mouthpiece");
  EXPECT_EQ(glb.root["nodes"][0]["name"], "egg");
  EXPECT_EQ(glb.root["materials"][1]["name"], "lower head");
  EXPECT_FLOAT_EQ(glb.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][0].get<float>(), 0.82F);
  EXPECT_EQ(glb.root["meshes"][0]["extras"]["targetNames"][0], "shape_00");
  const auto& bounds =
      glb.root["accessors"][glb.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"].get<std::size_t>()];
  EXPECT_NEAR(bounds["max"][1].get<double>(), 0.095, 1e-4);  // metres
}

TEST(Glb, ColoursAndTextureCoordinatesAreKept) {
  TalkingHead head = makeTalkingHead({.frames = 4, .rings = 3, .segments = 5});
  const auto count = static_cast<std::size_t>(head.mesh.vertices.rows());
  head.mesh.vertex_colors.assign(count, {0.25F, 1.5F, -1});
  head.mesh.texture_coordinates.assign(count, {0.25F, 0.75F});
  const GlbFile glb = glbOf(head);
  const auto& attributes = glb.root["meshes"][0]["primitives"][2]["attributes"];
  const auto colors = glb.accessor(attributes["COLOR_0"]);
  EXPECT_EQ(std::vector<double>(colors.begin(), colors.begin() + 4), (std::vector<double>{16384, 65535, 0, 65535}));
  const auto coordinates = glb.accessor(attributes["TEXCOORD_0"]);
  EXPECT_EQ(std::vector<double>(coordinates.begin(), coordinates.begin() + 2), (std::vector<double>{0.25, 0.25}));
}

TEST(Glb, AStillFaceHasNoTargetsAndNoAnimation) {
  TalkingHead head = makeTalkingHead({.frames = 4, .rings = 3, .segments = 5});
  for (Eigen::Index f = 0; f < 4; ++f) {
    head.animation.positions.row(f) =
        Eigen::Map<const Eigen::RowVectorXf>(head.mesh.vertices.data(), head.mesh.vertices.size());
  }
  const GlbFile glb = glbOf(head);
  EXPECT_FALSE(glb.root.contains("animations"));
  EXPECT_FALSE(glb.root["meshes"][0]["primitives"][0].contains("targets"));
}

TEST(Glb, ManyVerticesGetWideIndices) {
  const TalkingHead head = makeTalkingHead({.frames = 3, .rings = 260, .segments = 256});
  const GlbFile glb = glbOf(head);
  const auto& primitive = glb.root["meshes"][0]["primitives"][0];
  EXPECT_EQ(glb.root["accessors"][primitive["indices"].get<std::size_t>()]["componentType"], 5125);
  const auto indices = glb.accessor(primitive["indices"]);
  EXPECT_EQ(*std::max_element(indices.begin(), indices.end()), 261 * 256 - 1);
}

TEST(Glb, NamesThatAreNoUtf8DoNotBreakTheFile) {
  TalkingHead head = makeTalkingHead({.frames = 4, .rings = 3, .segments = 5});
  head.mesh.parts[0].name = "skin\"\xFF\n";
  EXPECT_NO_THROW(glbOf(head));
}

}  // namespace
}  // namespace mouthpiece
