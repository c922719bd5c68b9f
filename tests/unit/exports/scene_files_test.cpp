// FBX and USD as other programs' readers meet them: tests/blender and tests/browser read them whole.
#include "exports/scenes/scene_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>
#include <vector>

#include "base/text_encoding.h"
#include "base/zip.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_chunks.h"
#include "exports/scenes/scene_shape.h"
#include "exports/scenes/scene_textures.h"
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

/// A file of `binary` whose materials, textures and the rest `root` has.
SceneTextures texturesOf(nlohmann::json root, const std::string& binary = "") {
  root["asset"] = {{"version", "2.0"}};
  return sceneTextures(glbOf(root.dump(), binary), "head.glb");
}

const std::string kPngBytes = "\x89PNG\r\n\x1A\nskin", kJpgBytes = "\xFF\xD8\xFFnormals";

/// A PNG on material 0, cut out and clamped, and a JPEG as the normals of material 1.
SceneTextures twoPictures() {
  const auto view = [](std::size_t offset, std::size_t length) {
    return nlohmann::json{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}};
  };
  return texturesOf({{"bufferViews", {view(0, kPngBytes.size()), view(kPngBytes.size(), kJpgBytes.size())}},
                     {"images", {{{"bufferView", 0}}, {{"bufferView", 1}}}},
                     {"samplers", {{{"wrapS", 33071}, {"wrapT", 33648}}}},
                     {"textures", {{{"source", 0}, {"sampler", 0}}, {{"source", 1}}}},
                     {"materials",
                      {{{"alphaMode", "MASK"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}},
                       {{"normalTexture", {{"index", 1}}}}}}},
                    kPngBytes + kJpgBytes);
}

TEST(SceneTextures, AreWhatMaterialsShow) {
  const SceneTextures textures = twoPictures();
  ASSERT_EQ(textures.pictures.size(), 2U);
  EXPECT_EQ(textures.pictures[0].name, "texture_0.png");
  EXPECT_EQ(textures.pictures[0].bytes, kPngBytes);
  EXPECT_EQ(textures.pictures[1].name, "texture_1.jpg");
  EXPECT_EQ(textures.pictures[1].bytes, kJpgBytes);
  const SceneTextures::Material skin = textures.of(0), other = textures.of(1);
  ASSERT_TRUE(skin.color && other.normal);
  EXPECT_EQ(skin.color->u, SceneTexture::Wrap::kClamp);
  EXPECT_EQ(skin.color->v, SceneTexture::Wrap::kMirror);
  EXPECT_EQ(skin.alpha, SceneTextures::Material::Alpha::kCutOut);
  EXPECT_EQ(other.normal->u, SceneTexture::Wrap::kRepeat);
  for (const int none : {-1, 2}) EXPECT_FALSE(textures.of(none).color || textures.of(none).normal) << none;
}

TEST(SceneTextures, LeaveOutWhatOtherFilesHaveNoPlaceFor) {
  nlohmann::json root{{"bufferViews", {{{"buffer", 0}, {"byteLength", kPngBytes.size()}}}},
                      {"images", {{{"bufferView", 0}}}},
                      {"textures", {{{"source", 0}}}},
                      {"materials", {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}}}};
  EXPECT_TRUE(texturesOf(root, kPngBytes).of(0).color);
  EXPECT_FALSE(texturesOf(root, "RIFF????WEBPVP8 ").of(0).color) << "neither PNG nor JPEG";
  nlohmann::json& shown = root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  shown["texCoord"] = 1;
  EXPECT_FALSE(texturesOf(root, kPngBytes).of(0).color) << "another set of coordinates";
  shown = {{"index", 0}, {"extensions", {{"KHR_texture_transform", {{"scale", {2, 2}}}}}}};
  EXPECT_FALSE(texturesOf(root, kPngBytes).of(0).color) << "turned";
  shown = {{"index", 0}};
  for (const auto& [list, key, value] :
       {std::tuple("textures", "source", nlohmann::json(7)), std::tuple("textures", "source", nlohmann::json(-1)),
        std::tuple("images", "bufferView", nlohmann::json("0")),
        std::tuple("bufferViews", "byteLength", nlohmann::json(1e9)),
        std::tuple("bufferViews", "byteOffset", nlohmann::json(18446744073709551615U))}) {
    nlohmann::json broken = root;
    broken[list][0][key] = value;
    EXPECT_FALSE(texturesOf(broken, kPngBytes).of(0).color) << list << " " << key << " " << value;
  }
  EXPECT_TRUE(texturesOf({{"materials", 3}, {"images", "no"}}).pictures.empty());
}

TEST(SceneTextures, GoIntoFbxAndUsdz) {
  TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  head.mesh.texture_coordinates.assign(head.mesh.vertexCount(), {0.25F, 0.25F});
  head.mesh.parts[0].material = 0;
  head.mesh.parts[0].base_color = {0.5F, 1, 1, 1};
  const PrincipalShapes shapes = shapesOf(head);
  const SceneTextures textures = twoPictures();
  const std::string fbx = fbxBytes(head.mesh, shapes, "egg", textures);
  const auto video = fbxRecord(fbx, "Video");
  ASSERT_TRUE(video);
  EXPECT_NE(video->find(kPngBytes), std::string::npos);
  EXPECT_NE(fbx.find(kJpgBytes), std::string::npos);
  EXPECT_NE(fbx.find("TransparentColor"), std::string::npos);
  const std::string archive = usdzBytes(head.mesh, shapes, "egg", textures);
  const std::string usd = unzipped(archive, "face.usda", "egg.usdz");
  for (const char* line :
       {"asset inputs:file = @texture_0.png@", "inputs:scale = (0.5, 1, 1, 1)", "inputs:wrapS = \"clamp\"",
        "inputs:opacityThreshold = 0.5", "inputs:diffuseColor.connect = </egg/Materials/part_0/color.outputs:rgb>"})
    EXPECT_NE(usd.find(line), std::string::npos) << line;
  EXPECT_EQ(unzipped(archive, "texture_1.jpg", "egg.usdz"), kJpgBytes);
  // Nothing in a file alone names a file beside it.
  EXPECT_EQ(usdaText(head.mesh, shapes, "egg").find('@'), std::string::npos);
}

/// A reader of USDZ maps the file: each content begins at a multiple of 64 bytes.
TEST(Usdz, ContentIsAligned) {
  const TalkingHead head = makeTalkingHead({.rings = 8, .segments = 10});
  const std::string archive = usdzBytes(head.mesh, shapesOf(head), "egg", twoPictures());
  std::size_t files = 0;
  for (std::size_t at = 0; archive.substr(at, 4) == "PK\x03\x04"; ++files) {
    std::uint16_t name = 0, further = 0;
    std::uint32_t size = 0;
    std::memcpy(&size, archive.data() + at + 18, sizeof(size));
    std::memcpy(&name, archive.data() + at + 26, sizeof(name));
    std::memcpy(&further, archive.data() + at + 28, sizeof(further));
    at += 30U + name + further;
    EXPECT_EQ(at % 64, 0U) << files;
    at += size;
  }
  EXPECT_EQ(files, 3U);
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
