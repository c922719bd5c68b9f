// Reading and writing meshes, and refusing what is none.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/mesh_reader.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

using test::ScratchFolder;

/// A tetrahedron.
constexpr std::string_view kObj =
    "# four corners\no thing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl skin\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string messageOf(std::string_view bytes, const std::string& name) {
  try {
    parseFaceMesh(bytes, name);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ObjReader, ReadsVerticesFacesAndParts) {
  const FaceMesh mesh = parseObj(kObj, "a.obj");
  EXPECT_EQ(mesh.vertices.rows(), 4);
  ASSERT_EQ(mesh.triangles.size(), 4U);
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 2, 1}));
  ASSERT_EQ(mesh.parts.size(), 1U);
  EXPECT_EQ(mesh.parts[0].name, "skin");
  EXPECT_EQ(mesh.parts[0].triangle_count, 4U);
  EXPECT_TRUE(mesh.vertex_colors.empty());
}

/// What Blender 3.4 writes for the linear colour 0.2, 0.05, 0.5.
TEST(ObjReader, TakesColoursForSrgb) {
  const FaceMesh mesh = parseObj(
      "v 0 0 0 0.4845 0.2478 0.7353\nv 1 0 0 0.4845 0.2478 0.7353\nv 0 1 0 0.4845 0.2478 0.7353\nf 1 2 3\n", "a.obj");
  ASSERT_EQ(mesh.vertex_colors.size(), 3U);
  EXPECT_NEAR(mesh.vertex_colors[0][0], 0.2, 2e-4);
  EXPECT_NEAR(mesh.vertex_colors[0][1], 0.05, 2e-4);
  EXPECT_NEAR(mesh.vertex_colors[0][2], 0.5, 2e-4);
}

TEST(ObjReader, PassesOverAByteOrderMark) {
  const FaceMesh mesh = parseFaceMesh("\xEF\xBB\xBFv 7 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj");
  ASSERT_EQ(mesh.vertices.rows(), 3);
  EXPECT_EQ(mesh.vertices(0, 0), 7);
}

TEST(ObjReader, AVertexKeepsTheFirstTexturePlaceThatItIsGiven) {
  const FaceMesh mesh = parseObj(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvt 0.25 0.5\nvt 1 0\nvt 0 0.75\nvt 0.5\nf 1/1 2/2 3/3\nf 3/1 2/1 4\nf 1 2 "
      "4/4\n",
      "a.obj");
  const std::vector<std::array<float, 2>> expected{{0.25F, 0.5F}, {1, 0}, {0, 0.75F}, {0.5F, 0}};
  EXPECT_EQ(mesh.texture_coordinates, expected);
}

TEST(ObjReader, CountsBackFromNegativeIndices) {
  const FaceMesh mesh = parseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\n", "a.obj");
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 1, 2}));
}

/// Twice the area over the plane z = 0, and that of the triangles that face down.
std::pair<double, double> areasOf(const FaceMesh& mesh) {
  double up = 0, down = 0;
  for (const Triangle& t : mesh.triangles) {
    const Eigen::RowVector3f ab = mesh.vertices.row(t[1]) - mesh.vertices.row(t[0]),
                             ac = mesh.vertices.row(t[2]) - mesh.vertices.row(t[0]);
    const double area = double{ab.x() * ac.y() - ab.y() * ac.x()};
    (area > 0 ? up : down) += area;
  }
  return {up, down};
}

TEST(ObjReader, CutsPolygonsThatTurnInwardsInsideThemselves) {
  // A dart, whose shorter diagonal lies outside, from each of its corners; and a pentagon with a notch.
  const std::string dart = "v 0 0 0\nv 4 -0.4 0\nv 3 0 0\nv 4 0.4 0\n";
  for (const char* face : {"f 1 2 3 4\n", "f 2 3 4 1\n", "f 3 4 1 2\n", "f 4 1 2 3\n"}) {
    const FaceMesh mesh = parseObj(dart + face, "a.obj");
    EXPECT_EQ(mesh.triangles.size(), 2U);
    EXPECT_NEAR(areasOf(mesh).first, 2.4, 1e-6) << face;
    EXPECT_EQ(areasOf(mesh).second, 0) << face;
  }
  const FaceMesh notched = parseObj("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n", "a.obj");
  EXPECT_EQ(notched.triangles.size(), 3U);
  EXPECT_NEAR(areasOf(notched).first, 20, 1e-6);
  EXPECT_EQ(areasOf(notched).second, 0);
}

TEST(ObjReader, SplitsPolygonsAndSkipsDoubledCorners) {
  const FaceMesh quad = parseObj("v 0 0 0\nv 3 0 0\nv 3 1 0\nv 0 1 0\nf 1 2 3 4\n", "a.obj");
  EXPECT_EQ(quad.triangles.size(), 2U);
  const FaceMesh pentagon = parseObj("v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n", "a.obj");
  EXPECT_EQ(pentagon.triangles.size(), 3U);
  const FaceMesh doubled = parseObj("v 0 0 0\nv 2 0 0\nv 3 1 0\nf 1 2 2\nf 1 2 3\n", "a.obj");
  EXPECT_EQ(doubled.triangles.size(), 1U);
}

/// Programs that know no back of a face write it as a second one: the face finder saw a black head, and nothing was
/// bound.
TEST(ObjReader, MakesOneSurfaceOfOneThatIsDrawnFromBothSides) {
  const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
  const std::string kOutward = "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", kInward = "f 1 2 3\nf 4 2 1\nf 1 3 4\nf 2 4 3\n";
  const std::vector<Triangle> once = parseObj(kObj, "a.obj").triangles;
  EXPECT_EQ(parseObj(kCorners + kOutward + kInward, "a.obj").triangles, once);
  EXPECT_EQ(parseObj(kCorners + kOutward + kOutward, "a.obj").triangles, once);
  const FaceMesh back_first = parseObj(kCorners + "usemtl back\n" + kInward + "usemtl front\n" + kOutward, "a.obj");
  EXPECT_EQ(back_first.triangles, once);
  ASSERT_EQ(back_first.parts.size(), 1U);
  EXPECT_EQ(back_first.parts[0].name, "front");
  EXPECT_EQ(parseObj(kCorners + kInward, "a.obj").triangles.size(), 4U) << "what faces inwards by itself stays";
  EXPECT_EQ(parseObj(kCorners + kInward + kInward + kOutward + kOutward, "a.obj").triangles, once);
}

/// A mask encloses nothing, and may lie anywhere.
TEST(ObjReader, TakesTheOuterSideOfAMaskThatIsDrawnFromBoth) {
  const std::string kCorners = "v -1 -1 -10\nv 1 -1 -10\nv 1 1 -10\nv -1 1 -10\nv 0 0 -9\n";
  const std::string kOutward = "f 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n", kInward = "f 2 1 5\nf 3 2 5\nf 4 3 5\nf 1 4 5\n";
  const std::vector<Triangle> once = parseObj(kCorners + kOutward, "a.obj").triangles;
  EXPECT_EQ(parseObj(kCorners + kOutward + kInward, "a.obj").triangles, once);
  EXPECT_EQ(parseObj(kCorners + kInward + kOutward, "a.obj").triangles, once);
}

TEST(ObjReader, ReadsWindowsLineEndsTabsAndNoFinalNewline) {
  const FaceMesh mesh = parseObj("v\t0 0 0 \r\nv 1e0 0 0\r\nv 0 +1 0\r\nf 1//1 2//1 3//1", "a.obj");
  EXPECT_EQ(mesh.triangles.size(), 1U);
  EXPECT_EQ(mesh.vertices(2, 1), 1.0F);
}

TEST(ObjReader, ReadsLinesThatGoOn) {
  const FaceMesh mesh = parseObj("v 0 0 \\\n 0\nv 1 0 0\r\nv 0 1 0\nv 1 1 0\ng a\\b\nf 1 \\\r\n 2 4 \\\n3\n", "a.obj");
  EXPECT_EQ(mesh.vertexCount(), 4U);
  EXPECT_EQ(mesh.triangles.size(), 2U);
  EXPECT_EQ(mesh.parts.at(0).name, "a\\b");
  EXPECT_EQ(messageOf("v 0 0 \\\n 0\nv 1 0 x\n", "a.obj").substr(0, 8), "a.obj:3:")
      << "lines are counted as the file has them";
}

TEST(ObjReader, KeepsColorsOnlyWhenEveryVertexHasOne) {
  EXPECT_EQ(parseObj("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n", "a.obj").vertex_colors.size(), 3U);
  EXPECT_TRUE(parseObj("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 1\nf 1 2 3\n", "a.obj").vertex_colors.empty());
}

struct BadObj {
  const char* text;
  const char* message;
};
class BadObjs : public ::testing::TestWithParam<BadObj> {};
TEST_P(BadObjs, AreRefusedWithFileAndLine) { EXPECT_EQ(messageOf(GetParam().text, "a.obj"), GetParam().message); }
INSTANTIATE_TEST_SUITE_P(
    All, BadObjs,
    ::testing::Values(
        BadObj{"", "a.obj: found no faces; expected a surface of triangles or polygons"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj: found no faces; expected a surface of triangles or polygons"},
        BadObj{"v 0 0 nan\n", "a.obj:1: found 'nan' as z; expected a number between -1e7 and 1e7"},
        BadObj{"v 0 inf 0\n", "a.obj:1: found 'inf' as y; expected a number between -1e7 and 1e7"},
        BadObj{"v 1e99999 0 0\n", "a.obj:1: found '1e99999' as x; expected a number between -1e7 and 1e7"},
        BadObj{"v 0 0\n", "a.obj:1: found '' as z; expected a number between -1e7 and 1e7"},
        BadObj{"v 0 0 0x10\n", "a.obj:1: found '0x10' as z; expected a number between -1e7 and 1e7"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj:4: found vertex index 4; expected 1 to 3"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "a.obj:4: found vertex index -4; expected 1 to 3"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n",
               "a.obj:4: found '0' as a vertex index; expected a whole number other than 0"},
        BadObj{"v 0 0 0\nf 1 1 99999999999999999999\n",
               "a.obj:2: found '99999999999999999999' as a vertex index; expected a whole number other than 0"},
        BadObj{"RIFF1234WAVEfmt ", "a.obj: is a sound (WAV); expected a .obj, as its name says"},
        BadObj{"v 0 0 0\nv 1 0 0\nf 1 2\n", "a.obj:3: found a face with 2 corners; expected at least 3"},
        BadObj{"v 0 0 0\nvt 0 0\nf 1/1 1/2 1/1\n", "a.obj:3: found texture index 2; expected 1 to 1"},
        BadObj{"v 0 0 0 2 0 0\n", "a.obj:1: found a colour outside 0 to 1"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nv 0 0 1\nv",
               "a.obj:8: found '' as x; expected a number between -1e7 and 1e7"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3",
               "a.obj:5: ends here, but 1 of 4 vertices have no face; expected a whole file"},
        BadObj{"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nv 2 2 0\nv 3 2 0\nf 1 2 3\n",
               "a.obj:8: ends here, but 4 of 7 vertices have no face; expected a whole file"}));

TEST(ObjReader, AWholeFileMayHaveALooseVertex) {
  EXPECT_EQ(parseObj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n", "a.obj").vertexCount(), 4U);
}

TEST(ObjWriter, WritesWhatItReadsByteForByte) {
  FaceMesh mesh = parseObj(kObj, "a.obj");
  mesh.vertices(1, 0) = 0.1F;  // no short binary fraction
  mesh.vertex_colors.assign(4, {0.25F, 0.1F, 1.0F});
  const std::string once = objBytes(mesh);
  const FaceMesh again = parseObj(once, "b.obj");
  EXPECT_EQ(objBytes(again), once);
  EXPECT_EQ(again.vertices, mesh.vertices);
  EXPECT_NEAR(again.vertex_colors[1][0], 0.25, 2e-5);
  EXPECT_EQ(again.triangles, mesh.triangles);
}

TEST(MeshReader, RefusesOtherEndingsAndMissingFiles) {
  const ScratchFolder folder;
  EXPECT_THROW(readFaceMesh(folder.path() / "head.obj"), InputError);
  EXPECT_NE(messageOf("", "head.fbx").find("convert_a_head.md"), std::string::npos);
  EXPECT_NE(messageOf("", "head.xyz").find("expected .obj, .ply, .off, .glb or .vrm"), std::string::npos);
  EXPECT_EQ(parseFaceMesh(kObj, "HEAD.OBJ").triangles.size(), 4U);
}

constexpr std::string_view kPly =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\n"
    "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 "
    "3\n";

std::string replaced(std::string_view text, std::string_view from, std::string_view to) {
  std::string result(text);
  result.replace(result.find(from), from.size(), to);
  return result;
}

/// The tetrahedron as a binary PLY.
std::string binaryPly() {
  std::string bytes = replaced(kPly.substr(0, kPly.find("0 0 0\n")), "ascii", "binary_little_endian");
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  bytes.append(reinterpret_cast<const char*>(points), sizeof points);
  for (const auto& face : {std::array{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}) {
    bytes.push_back(3);
    bytes.append(reinterpret_cast<const char*>(face.data()), 12);
  }
  return bytes;
}

TEST(PlyReader, ReadsTextAndBinaryAlike) {
  const FaceMesh text = parsePly(kPly, "a.ply");
  const FaceMesh binary = parsePly(binaryPly(), "b.ply");
  EXPECT_EQ(text.triangles.size(), 4U);
  EXPECT_EQ(text.vertices.row(3), Eigen::RowVector3f(0, 0, 1));
  EXPECT_EQ(text.vertices, binary.vertices);
  EXPECT_EQ(text.triangles, binary.triangles);
}

/// As programs write them that keep texture coordinates by corners, or a vertex' neighbours.
TEST(PlyReader, PassesOverListsThatItDoesNotNeed) {
  std::string text = replaced(kPly, "property float z\n", "property float z\nproperty list uchar int neighbours\n");
  text = replaced(text, "end_header", "property list uchar float texcoord\nend_header");
  std::string given;
  bool is_body = false, is_face = false;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    is_face = is_face || (is_body && line.starts_with("3 "));
    given += line + (!is_body ? "" : is_face ? " 6 0 0 0.5 0 1 1" : line.back() == '1' ? " 2 7 8" : " 0") + "\n";
    is_body = is_body || line == "end_header";
  }
  const FaceMesh plain = parsePly(kPly, "a.ply"), passed = parsePly(given, "b.ply");
  EXPECT_EQ(passed.vertices, plain.vertices);
  EXPECT_EQ(passed.triangles, plain.triangles);
  EXPECT_NE(messageOf(replaced(given, "6 0 0 0.5 0 1 1\n", "600 0 0 0.5 0 1 1\n"), "b.ply"), "no error");
}

TEST(PlyReader, RefusesWhatIsNoMesh) {
  EXPECT_NE(messageOf("", "a.ply").find("found no 'ply'"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kPly, "vertex 4", "vertex 400000000"), "a.ply").find("can hold"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kPly, "face 4", "face 0"), "a.ply").find("no faces"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kPly, "3 1 2 3", "3 1 2 9"), "a.ply").find("index 9"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kPly, "3 1 2 3", "3 1 2 -1"), "a.ply").find("index -1"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kPly, "0 0 1\n", "0 0 nan\n"), "a.ply"), "no error");
  EXPECT_NE(messageOf(replaced(kPly, "0 0 1\n", "0 0 1e30\n"), "a.ply").find("vertex 3"), std::string::npos);
}

TEST(PlyReader, RefusesEveryTruncation) {
  const std::string bytes = binaryPly();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(messageOf(std::string_view(bytes).substr(0, size), "a.ply"), "no error") << size;
  }
}

TEST(OffReader, ReadsAndRefuses) {
  constexpr std::string_view kOff =
      "OFF\n# a comment\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  EXPECT_EQ(parseOff(kOff, "a.off").triangles.size(), 4U);
  EXPECT_EQ(parseOff(kOff, "a.off").vertices.row(3), Eigen::RowVector3f(0, 0, 1));
  EXPECT_NE(messageOf("nonsense", "a.off").find("no 'OFF'"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kOff, "4 4 6", "4000000 4 6"), "a.off").find("can hold"), std::string::npos);
  EXPECT_NE(messageOf(replaced(kOff, "3 1 2 3", "3 1 2 4"), "a.off").find("index 4"), std::string::npos);
  EXPECT_NE(messageOf(kOff.substr(0, kOff.size() - 12), "a.off"), "no error");
}

/// A GLB with one triangle under a node that doubles, turns and moves it. `change` edits the JSON first.
std::string glb(const std::function<void(nlohmann::json&)>& change = {}) {
  std::string binary(48, '\0');
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::uint32_t indices[] = {0, 1, 2};
  std::memcpy(binary.data(), points, sizeof points);
  std::memcpy(binary.data() + 36, indices, sizeof indices);
  nlohmann::json json = nlohmann::json::parse(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
    "nodes":[{"children":[1],"translation":[0,10,0]},{"mesh":0,"scale":[2,2,2]}],
    "materials":[{"name":"M_Face","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1]}}],
    "meshes":[{"name":"head","primitives":[{"attributes":{"POSITION":0},"indices":1,"material":0}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5125,"count":3,"type":"SCALAR"}],
    "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],"buffers":[{"byteLength":48}]})");
  if (change) change(json);
  std::string text = json.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t value) {
    const auto v = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&v), 4);
  };
  return "glTF" + word(2) + word(28 + text.size() + binary.size()) + word(text.size()) + "JSON" + text +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

/// Maya calls them so: the mesh tells the kind, and each material stays a part that anchors can name.
TEST(GlbReader, MaterialsThatTellNoKindStayParts) {
  const auto namesOf = [](const std::vector<std::string>& materials) {
    const FaceMesh mesh = parseGlb(glb([&](nlohmann::json& root) {
                                     const nlohmann::json primitive = root["meshes"][0]["primitives"][0];
                                     root["materials"] = root["meshes"][0]["primitives"] = nlohmann::json::array();
                                     for (const std::string& name : materials) {
                                       nlohmann::json& own = root["meshes"][0]["primitives"].emplace_back(primitive);
                                       own["material"] = root["materials"].size();
                                       root["materials"].push_back({{"name", name}});
                                     }
                                   }),
                                   "a.glb");
    std::vector<std::string> names;
    for (const MeshPart& part : mesh.parts) names.push_back(part.name);
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(namesOf({"lambert1", "lambert2", "", "Teeth"}), (Names{"head", "head.lambert2", "head.2", "Teeth"}));
  EXPECT_EQ(namesOf({"lambert1"}), Names{"head"});
}

TEST(GlbReader, WhatTinygltfSaysIsOneLine) {
  const std::string said = messageOf(glb([](nlohmann::json& root) {
                                       root["buffers"].push_back({{"byteLength", 4}, {"uri", "x.bin"}});
                                     }),
                                     "a.glb");
  EXPECT_TRUE(said.starts_with("a.glb: is no GLB that can be read: ")) << said;
  EXPECT_EQ(said.find("\\x0A"), std::string::npos) << said;
}

TEST(GlbReader, AppliesNodeTransformsAndMaterials) {
  const FaceMesh mesh = parseGlb(glb(), "a.glb");
  ASSERT_EQ(mesh.vertices.rows(), 3);
  EXPECT_EQ(mesh.metres_per_unit, 1.0);
  EXPECT_EQ(mesh.vertices.row(1), Eigen::RowVector3f(2, 10, 0));
  EXPECT_EQ(mesh.parts[0].name, "M_Face");
  EXPECT_FLOAT_EQ(mesh.parts[0].base_color[1], 0.25F);
}

TEST(GlbReader, ColoursBeyondTheirBoundsAreHeldThere) {
  const FaceMesh mesh =
      parseGlb(glb([](auto& json) {
                 json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1.5, -0.25, 0.5, 1.1};
               }),
               "a.glb");
  EXPECT_EQ(mesh.parts[0].base_color, (std::array<float, 4>{1, 0, 0.5F, 1}));
}

TEST(GlbReader, AMirroredNodeKeepsTheOutsideOutside) {
  const FaceMesh mesh = parseGlb(glb([](auto& json) { json["nodes"][1]["scale"] = {-1, 1, 1}; }), "a.glb");
  EXPECT_EQ(mesh.triangles[0], (Triangle{0, 2, 1}));
}

TEST(GlbReader, RefusesWhatReachesBeyondItsBuffers) {
  using Json = nlohmann::json;
  EXPECT_NE(messageOf(glb([](Json& j) { j["accessors"][0]["count"] = 4; }), "a.glb"), "no error");
  EXPECT_NE(messageOf(glb([](Json& j) { j["accessors"][0]["count"] = 4000000000U; }), "a.glb"), "no error");
  EXPECT_NE(messageOf(glb([](Json& j) { j["accessors"][1]["byteOffset"] = 8; }), "a.glb"), "no error");
  EXPECT_NE(messageOf(glb([](Json& j) { j["bufferViews"][1]["byteOffset"] = 4000000000U; }), "a.glb"), "no error");
  EXPECT_NE(messageOf(glb([](Json& j) { j["nodes"][1]["mesh"] = 7; }), "a.glb"), "no error");
  EXPECT_NE(messageOf(glb([](Json& j) {
                        j["nodes"][1] = {{"mesh", 0}, {"children", Json::array({0})}};
                      }),
                      "a.glb")
                .find("ring"),
            std::string::npos);
  EXPECT_NE(messageOf(glb([](Json& j) { j["meshes"][0]["primitives"][0]["attributes"].erase("POSITION"); }), "a.glb"),
            "no error");
  EXPECT_NE(
      messageOf(glb([](Json& j) { j["extensionsRequired"] = Json::array({"KHR_draco_mesh_compression"}); }), "a.glb")
          .find("KHR_draco"),
      std::string::npos);
}

TEST(GlbReader, RefusesEveryTruncationAndBadIndices) {
  const std::string bytes = glb();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(messageOf(std::string_view(bytes).substr(0, size), "a.glb"), "no error") << size;
  }
  std::string far_index = bytes;
  far_index[far_index.size() - 4] = 9;
  EXPECT_NE(messageOf(far_index, "a.glb").find("vertex index 9"), std::string::npos);
}

TEST(VertexNormals, AreUnitAreaWeightedAndZeroForLooseVertices) {
  VertexPositions vertices(5, 3);
  vertices << 0, 0, 0, 4, 0, 0, 0, 4, 0, 0, 0, 1, 9, 9, 9;
  const VertexPositions normals = vertexNormals(vertices, {{0, 1, 2}, {0, 3, 1}});
  // Areas 8 (along +z) and 2 (along +y).
  EXPECT_LT((normals.row(0) - Eigen::RowVector3f(0, 2, 8).normalized()).norm(), 1e-6F);
  EXPECT_EQ(normals.row(4).norm(), 0.0F);
}

}  // namespace
}  // namespace mouthpiece
