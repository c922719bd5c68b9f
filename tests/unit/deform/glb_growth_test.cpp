// The lips of a GLB's head cut open: what the file had stays, and what is new is as its parents are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_growth.h"
#include "deform/topology/lip_cut.h"
#include "exports/gltf/glb.h"
#include "support/glb_file.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using test::GlbFile;

constexpr int kColumns = 25, kRows = 21;
constexpr double kHalfWide = 0.025;  ///< of the mouth, metres

/// A bulging sheet of skin whose lips are one surface, the mouth along y = 0.
FaceMesh sheet() {
  FaceMesh mesh;
  mesh.metres_per_unit = 1;
  mesh.vertices.resize(kColumns * kRows, 3);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const float x = 0.08F * static_cast<float>(column) / (kColumns - 1) - 0.04F,
                  y = 0.06F * static_cast<float>(row) / (kRows - 1) - 0.03F;
      mesh.vertices.row(row * kColumns + column) << x, y, -8 * x * x - 4 * y * y;
      mesh.texture_coordinates.push_back({x, y});
    }
  }
  for (std::uint32_t row = 0; row + 1 < kRows; ++row) {
    for (std::uint32_t column = 0; column + 1 < kColumns; ++column) {
      const std::uint32_t a = row * kColumns + column, b = a + 1, c = a + kColumns, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  MeshPart part;
  part.name = "Skin";
  part.triangle_count = mesh.triangles.size();
  mesh.parts.push_back(part);
  return mesh;
}

LipLine lineOf() {
  LipLine line;
  for (int i = 0; i <= 20; ++i) {
    const double x = kHalfWide * (i - 10) / 10;
    line.upper.emplace_back(x, 0.0004, -8 * x * x);
  }
  line.lower = line.upper;
  line.corner_right = line.upper.front();
  line.corner_left = line.upper.back();
  line.is_parted = false;
  return line;
}

/// The sheet as a GLB with a shape, two joints and things that no tool here knows, its node turned and made larger.
std::string dressedSheet() {
  const FaceMesh mesh = sheet();
  PrincipalShapes shapes;
  shapes.frame_rate_hz = 60;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes = 0.1F * shapes.rest;
  shapes.weights.resize(2, 1);
  shapes.weights << 1, 0;
  GlbFile glb(glbBytes(mesh, shapes, "head"));
  const std::size_t count = mesh.vertexCount();
  std::vector<float> custom;
  for (std::size_t v = 0; v < count; ++v) custom.push_back(static_cast<float>(v));
  glb.root["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", glb.binary.size()}, {"byteLength", 4 * count}, {"target", 34962}});
  glb.binary.append(reinterpret_cast<const char*>(custom.data()), 4 * count);
  glb.root["buffers"][0]["byteLength"] = glb.binary.size();
  glb.root["accessors"].push_back({{"bufferView", glb.root["bufferViews"].size() - 1},
                                   {"componentType", 5126},
                                   {"type", "SCALAR"},
                                   {"count", count}});
  glb.root["meshes"][0]["primitives"][0]["attributes"]["_NUMBER"] = glb.root["accessors"].size() - 1;
  glb.root["nodes"][0]["scale"] = {2, 2, 2};
  glb.root["nodes"][0]["extras"] = {{"mine", {1, 2}}};
  glb.root["extras"] = {{"author", "nobody"}};
  return glb.toBytes();
}

class GlbGrowth : public ::testing::Test {
 protected:
  std::string given_bytes_ = dressedSheet();
  FaceMesh given_ = parseFaceMesh(given_bytes_, "sheet.glb");
  GrownMesh cut_ = cutLips(given_, scaledLine());
  std::string cut_bytes_ = grownGlb(given_bytes_, "sheet.glb", "", given_, cut_);

  static LipLine scaledLine() {
    LipLine line = lineOf();
    for (auto* rim : {&line.upper, &line.lower}) {
      for (Eigen::Vector3d& p : *rim) p *= 2;
    }
    line.corner_right *= 2;
    line.corner_left *= 2;
    return line;
  }
};

TEST_F(GlbGrowth, IsTheCutMesh) {
  const FaceMesh read = parseFaceMesh(cut_bytes_, "cut.glb");
  ASSERT_EQ(read.vertexCount(), cut_.mesh.vertexCount());
  EXPECT_LT((read.vertices - cut_.mesh.vertices).cwiseAbs().maxCoeff(), 1e-6F);
  EXPECT_EQ(read.triangles, cut_.mesh.triangles);
  ASSERT_EQ(read.parts.size(), 2U);
  EXPECT_EQ(read.parts[1].kind, PartKind::kMouthInside);
}

TEST_F(GlbGrowth, NewVerticesAreAsTheirParents) {
  const GlbFile file(cut_bytes_);
  ASSERT_GT(cut_.parents.size(), 20U);
  const json& primitives = file.root["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2U);
  EXPECT_EQ(primitives[1]["attributes"], primitives[0]["attributes"]);
  EXPECT_EQ(primitives[1]["targets"], primitives[0]["targets"]);
  const auto numbers = file.accessor(primitives[0]["attributes"]["_NUMBER"]);
  const auto uv = file.accessor(primitives[0]["attributes"]["TEXCOORD_0"]);
  const auto moves = file.accessor(primitives[0]["targets"][0]["POSITION"]);
  ASSERT_EQ(numbers.size(), cut_.mesh.vertexCount());
  ASSERT_EQ(moves.size(), 3 * cut_.mesh.vertexCount());
  for (std::size_t i = 0; i < cut_.parents.size(); ++i) {
    const std::size_t v = given_.vertexCount() + i, parent = cut_.parents[i];
    EXPECT_EQ(numbers[v], numbers[parent]) << v;
    for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(uv[2 * v + k], uv[2 * parent + k]) << v;
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(moves[3 * v + k], moves[3 * parent + k]) << v;
  }
}

/// A part that a shape leaves alone has one accessor of zeros for both.
TEST_F(GlbGrowth, MovesAndTurnsOfAShapeMayBeOneAccessor) {
  GlbFile shared(given_bytes_);
  json& target = shared.root["meshes"][0]["primitives"][0]["targets"][0];
  target["NORMAL"] = target["POSITION"];
  const GlbFile file(grownGlb(shared.toBytes(), "sheet.glb", "", given_, cut_));
  const std::size_t moves = file.root["meshes"][0]["primitives"][0]["targets"][0]["POSITION"];
  for (const char* bound : {"min", "max"}) EXPECT_TRUE(file.root["accessors"][moves].contains(bound)) << bound;
  const auto values = file.accessor(json(moves));
  for (std::size_t i = 0; i < cut_.parents.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(values[3 * (given_.vertexCount() + i) + k], values[3 * cut_.parents[i] + k]) << i;
  }
}

TEST_F(GlbGrowth, KeepsAllElse) {
  const GlbFile before(given_bytes_), after(cut_bytes_);
  for (const char* key : {"asset", "nodes", "scenes", "scene", "animations", "extras"})
    EXPECT_EQ(after.root[key], before.root[key]) << key;
  EXPECT_EQ(after.root["materials"][0], before.root["materials"][0]);
  EXPECT_EQ(after.root["meshes"][0]["extras"], before.root["meshes"][0]["extras"]);
  EXPECT_EQ(after.root["meshes"][0]["weights"], before.root["meshes"][0]["weights"]);
  const json& sampler = before.root["animations"][0]["samplers"][0];
  for (const char* key : {"input", "output"})
    EXPECT_EQ(after.accessor(sampler[key]), before.accessor(sampler[key])) << key;
  // Nothing is left behind that nothing shows.
  std::size_t shown = 0;
  for (const json& view : after.root["bufferViews"]) shown += (view["byteLength"].get<std::size_t>() + 3) / 4 * 4;
  EXPECT_EQ(shown, (after.binary.size() + 3) / 4 * 4);
  std::set<std::size_t> views;
  for (const json& accessor : after.root["accessors"]) {
    if (accessor.contains("bufferView")) views.insert(accessor["bufferView"].get<std::size_t>());
    if (!accessor.contains("sparse")) continue;
    for (const char* part : {"indices", "values"})
      views.insert(accessor["sparse"][part]["bufferView"].get<std::size_t>());
  }
  EXPECT_EQ(views.size(), after.root["bufferViews"].size());
}

TEST_F(GlbGrowth, RefusesDataOutsideOfTheFile) {
  GlbFile file(given_bytes_);
  const std::string data = "data:application/octet-stream;base64,AAAA";
  file.root["buffers"].insert(file.root["buffers"].begin(), {{"byteLength", 3}, {"uri", data}});
  EXPECT_THROW((void)grownGlb(file.toBytes(), "sheet.glb", "", given_, cut_), InputError);
}

}  // namespace
}  // namespace mouthpiece
