// A mesh in every way that glTF 2.0 has to write it is that mesh, where its nodes or bones put it.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/mesh_reader.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

enum Component { kByte = 5120, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt = 5125, kFloat };

/// Puts together a GLB: numbers into its binary part, accessors over them.
class Maker {
 public:
  explicit Maker(std::mt19937& random) : random_(&random) {
    root =
        Json::parse(R"({"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [], "nodes": [], "meshes": []})");
  }

  Json root;

  template <typename T>
  int view(const std::vector<T>& values, std::size_t width, std::size_t gap = 0) {
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    const std::size_t begin = binary_.size(), element = width * sizeof(T);
    for (std::size_t i = 0; i < values.size(); i += width) {
      binary_.append(reinterpret_cast<const char*>(&values[i]), element);
      binary_.append(gap, '\x7f');
    }
    Json made{{"buffer", 0}, {"byteOffset", begin}, {"byteLength", binary_.size() - begin}};
    if (gap > 0) made["byteStride"] = element + gap;
    root["bufferViews"].push_back(made);
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }
  int accessor(int view, Component component, std::size_t count, const char* type, bool normalized = false) {
    Json made{{"componentType", static_cast<int>(component)}, {"count", count}, {"type", type}};
    if (view >= 0) made["bufferView"] = view;
    if (normalized) made["normalized"] = true;
    root["accessors"].push_back(made);
    return static_cast<int>(root["accessors"].size()) - 1;
  }
  /// Side by side, spread with gaps, some replaced by a sparse part, or nothing but that.
  int places(const VertexPositions& vertices) {
    std::vector<float> values(vertices.data(), vertices.data() + vertices.size());
    const auto count = static_cast<std::size_t>(vertices.rows());
    const std::size_t way = (*random_)() % 4;
    if (way == 0) return accessor(view(values, 3), kFloat, count, "VEC3");
    if (way == 1) return accessor(view(values, 3, 4 * (1 + (*random_)() % 3)), kFloat, count, "VEC3");
    std::vector<std::uint16_t> which;
    std::vector<float> replaced;
    for (std::size_t i = 0; i < count; ++i) {
      if (way == 2 && (*random_)() % 3 != 0) continue;
      which.push_back(static_cast<std::uint16_t>(i));
      for (std::size_t k = 0; k < 3; ++k) {
        replaced.push_back(values[3 * i + k]);
        values[3 * i + k] = 777;  // what is replaced does not matter
      }
    }
    const int made = accessor(way == 2 ? view(values, 3) : -1, kFloat, count, "VEC3");
    if (!which.empty()) {
      root["accessors"][static_cast<std::size_t>(made)]["sparse"] = {
          {"count", which.size()},
          {"indices", {{"bufferView", view(which, 1)}, {"componentType", static_cast<int>(kUnsignedShort)}}},
          {"values", {{"bufferView", view(replaced, 3)}}}};
    }
    return made;
  }
  int corners(const std::vector<Triangle>& triangles) {
    const std::size_t way = (*random_)() % 3;
    const auto made = [&](auto zero, Component component) {
      std::vector<decltype(zero)> all;
      for (const Triangle& triangle : triangles) {
        for (const std::uint32_t corner : triangle) all.push_back(static_cast<decltype(zero)>(corner));
      }
      return accessor(view(all, 1), component, all.size(), "SCALAR");
    };
    return way == 0   ? made(std::uint8_t{}, kUnsignedByte)
           : way == 1 ? made(std::uint16_t{}, kUnsignedShort)
                      : made(std::uint32_t{}, kUnsignedInt);
  }
  [[nodiscard]] std::string bytes() {
    root["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    std::string text = root.dump(), padded = binary_;
    text.append((4 - text.size() % 4) % 4, ' ');
    padded.append((4 - padded.size() % 4) % 4, '\0');
    const auto word = [](std::size_t value) {
      const auto v = static_cast<std::uint32_t>(value);
      return std::string(reinterpret_cast<const char*>(&v), 4);
    };
    return "glTF" + word(2) + word(28 + text.size() + padded.size()) + word(text.size()) + "JSON" + text +
           word(padded.size()) + std::string("BIN\0", 4) + padded;
  }

 private:
  std::mt19937* random_ = nullptr;
  std::string binary_;
};

class GlbLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};
  Maker maker_{random_};
  double number(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  Eigen::Quaterniond turn() {
    return Eigen::Quaterniond(number(-1, 1), number(-1, 1), number(-1, 1), number(-1, 1)).normalized();
  }
  VertexPositions vertices(Eigen::Index count) {
    return VertexPositions::NullaryExpr(count, 3, [&] { return static_cast<float>(number(-2, 2)); });
  }
  std::vector<Triangle> triangles(std::uint32_t count) {
    std::vector<Triangle> made;
    for (std::uint32_t i = 0; i + 2 < count; ++i) made.push_back({i, i + 1, i + 2});
    std::shuffle(made.begin(), made.end(), random_);
    return made;
  }
  /// A node that turns, stretches and moves, as one matrix or in its parts; and what that is.
  std::pair<Json, Eigen::Affine3d> node(bool may_mirror) {
    const Eigen::Quaterniond q = turn();
    const Eigen::Vector3d scale(number(0.5, 2), number(0.5, 2),
                                (may_mirror && random_() % 2 == 0 ? -1 : 1) * number(0.5, 2)),
        shift(number(-3, 3), number(-3, 3), number(-3, 3));
    const Eigen::Affine3d whole = Eigen::Translation3d(shift) * q * Eigen::Scaling(scale);
    if (random_() % 2 == 0)
      return {{{"translation", {shift.x(), shift.y(), shift.z()}},
               {"rotation", {q.x(), q.y(), q.z(), q.w()}},
               {"scale", {scale.x(), scale.y(), scale.z()}}},
              whole};
    std::vector<double> columns(whole.matrix().data(), whole.matrix().data() + 16);
    return {{{"matrix", columns}}, whole};
  }
  static void expectAt(const FaceMesh& read, const std::vector<Eigen::Vector3d>& expected) {
    ASSERT_EQ(read.vertexCount(), expected.size());
    for (std::size_t v = 0; v < expected.size(); ++v)
      EXPECT_LT((pointAt(read.vertices, v) - expected[v]).norm(), 1e-4) << v;
  }
};
INSTANTIATE_TEST_SUITE_P(Seeds, GlbLaws, ::testing::Range(1U, 25U));

/// Two meshes under nodes that hang on each other: places, triangles that keep their outside, colours, textures, parts.
TEST_P(GlbLaws, MeshesStandWhereTheirNodesPutThem) {
  const VertexPositions first = vertices(7), second = vertices(5);
  const std::vector<Triangle> corners = triangles(7), others = triangles(5);
  std::vector<float> texture;
  for (int i = 0; i < 14; ++i) texture.push_back(static_cast<float>(number(0, 1)));
  std::vector<std::uint8_t> colors;
  for (int i = 0; i < 28; ++i) colors.push_back(static_cast<std::uint8_t>(random_() % 256));
  maker_.root["materials"] = Json::parse(R"([{"name": "M_Face", "pbrMetallicRoughness":
    {"baseColorFactor": [0.5, 0.25, 0.125, 1], "roughnessFactor": 0.3}}, {"name": "Hair"}])");
  maker_.root["meshes"] = Json::array(
      {{{"name", "a"},
        {"primitives",
         Json::array({{{"attributes",
                        {{"POSITION", maker_.places(first)},
                         {"TEXCOORD_0", maker_.accessor(maker_.view(texture, 2), kFloat, 7, "VEC2")},
                         {"COLOR_0", maker_.accessor(maker_.view(colors, 4), kUnsignedByte, 7, "VEC4", true)}}},
                       {"indices", maker_.corners(corners)},
                       {"material", 0}}})}},
       {{"name", "b"},
        {"primitives", Json::array({{{"attributes", {{"POSITION", maker_.places(second)}}},
                                     {"indices", maker_.corners(others)},
                                     {"material", 1},
                                     {"mode", 4}}})}}});
  auto [outer, outer_pose] = node(true);
  auto [inner, inner_pose] = node(true);
  outer["mesh"] = 0;
  outer["children"] = {1};
  inner["mesh"] = 1;
  maker_.root["nodes"] = {outer, inner};
  maker_.root["scenes"] = Json::array({{{"nodes", {0}}}});
  const std::string bytes = maker_.bytes();
  const FaceMesh read = parseGlb(bytes, "made up");
  const Eigen::Affine3d second_pose = outer_pose * inner_pose;
  std::vector<Eigen::Vector3d> expected;
  for (int v = 0; v < 7; ++v) expected.push_back(outer_pose * pointAt(first, v));
  for (int v = 0; v < 5; ++v) expected.push_back(second_pose * pointAt(second, v));
  expectAt(read, expected);
  EXPECT_EQ(read.metres_per_unit, 1);
  ASSERT_EQ(read.parts.size(), 2U);
  std::vector<Triangle> wanted;
  for (Triangle t : corners) {
    if (outer_pose.linear().determinant() < 0) std::swap(t[1], t[2]);
    wanted.push_back(t);
  }
  for (Triangle t : others) {
    for (std::uint32_t& corner : t) corner += 7;
    if (second_pose.linear().determinant() < 0) std::swap(t[1], t[2]);
    wanted.push_back(t);
  }
  EXPECT_EQ(read.triangles, wanted);
  EXPECT_EQ(read.parts[0].name, "M_Face");
  EXPECT_EQ(read.parts[0].kind, PartKind::kSkin);
  EXPECT_EQ(read.parts[0].base_color, (std::array<float, 4>{0.5F, 0.25F, 0.125F, 1}));
  EXPECT_FLOAT_EQ(read.parts[0].roughness, 0.3F);
  EXPECT_EQ(read.parts[1].kind, PartKind::kHair);
  ASSERT_EQ(read.texture_coordinates.size(), 12U);
  ASSERT_EQ(read.vertex_colors.size(), 12U);
  for (std::size_t v = 0; v < 12; ++v) {
    for (std::size_t k = 0; k < 2; ++k) EXPECT_EQ(read.texture_coordinates[v][k], v < 7 ? texture[2 * v + k] : 0);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(read.vertex_colors[v][k], v < 7 ? static_cast<float>(colors[4 * v + k]) / 255 : 1, 1e-6F);
  }
  const std::vector<GlbRun> runs = glbRuns(bytes, "made up");
  ASSERT_EQ(runs.size(), 2U);
  EXPECT_EQ(runs[1].first_vertex, 7U);
  EXPECT_EQ(runs[1].count, 5U);
  EXPECT_EQ(runs[1].mesh, 1);
  EXPECT_LT((runs[1].sceneFromMesh(3) - second_pose.linear().cast<float>()).norm(), 1e-4F);
  // One object of the two.
  expectAt(parseGlb(bytes, "made up", "b"), {expected.begin() + 7, expected.end()});
}

/// Skinned: where the bones put each vertex, each in its share; the node itself does not count.
TEST_P(GlbLaws, SkinsAreWhereTheirBonesPutThem) {
  const VertexPositions places = vertices(6);
  std::vector<float> weights, binds;
  std::vector<std::uint8_t> joints;
  for (int v = 0; v < 6; ++v) {
    const float share = v == 0 ? 1.0F : v == 1 ? 0.0F : static_cast<float>(number(0.1, 0.9));
    weights.insert(weights.end(), {share, 1 - share, 0, 0});
    joints.insert(joints.end(), {0, 1, 1, 0});
  }
  std::array<Eigen::Affine3d, 2> bones, bind_poses;
  std::array<Json, 2> nodes;
  for (std::size_t j = 0; j < 2; ++j) {
    std::tie(nodes[j], bones[j]) = node(false);
    bind_poses[j] = node(false).second;
    const Eigen::Matrix4f bind = bind_poses[j].matrix().cast<float>();
    binds.insert(binds.end(), bind.data(), bind.data() + 16);
  }
  nodes[0]["name"] = "head";
  nodes[0]["children"] = {1};
  nodes[1]["name"] = "jaw";
  bones[1] = bones[0] * bones[1];
  auto [holder, ignored] = node(false);
  holder["mesh"] = 0;
  holder["skin"] = 0;
  maker_.root["nodes"] = {nodes[0], nodes[1], holder};
  maker_.root["scenes"] = Json::array({{{"nodes", {0, 2}}}});
  maker_.root["skins"] = Json::array(
      {{{"joints", {0, 1}}, {"inverseBindMatrices", maker_.accessor(maker_.view(binds, 16), kFloat, 2, "MAT4")}}});
  maker_.root["meshes"] = Json::array(
      {{{"primitives", Json::array({{{"attributes",
                                      {{"POSITION", maker_.places(places)},
                                       {"JOINTS_0", maker_.accessor(maker_.view(joints, 4), kUnsignedByte, 6, "VEC4")},
                                       {"WEIGHTS_0", maker_.accessor(maker_.view(weights, 4), kFloat, 6, "VEC4")}}},
                                     {"indices", maker_.corners(triangles(6))}}})}}});
  std::vector<Eigen::Vector3d> expected;
  for (int v = 0; v < 6; ++v) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (std::size_t j = 0; j < 2; ++j)
      place += double{weights[4 * static_cast<std::size_t>(v) + j]} * (bones[j] * bind_poses[j] * pointAt(places, v));
    expected.push_back(place);
  }
  expectAt(parseGlb(maker_.bytes(), "made up"), expected);
}

/// Morph targets of two meshes by name: one that both have is one shape; moves turn and stretch with their node.
TEST_P(GlbLaws, ShapesOfOneNameAreOneAndTurnWithTheirNode) {
  const VertexPositions first = vertices(6), second = vertices(4);
  const VertexPositions jaw_first = vertices(6), jaw_second = vertices(4), smile = vertices(6);
  const auto mesh = [&](const VertexPositions& places, const std::vector<VertexPositions>& moves, Json names) {
    Json targets = Json::array();
    for (const VertexPositions& move : moves) targets.push_back({{"POSITION", maker_.places(move)}});
    return Json{
        {"primitives", Json::array({{{"attributes", {{"POSITION", maker_.places(places)}}},
                                     {"indices", maker_.corners(triangles(static_cast<std::uint32_t>(places.rows())))},
                                     {"targets", targets}}})},
        {"extras", {{"targetNames", std::move(names)}}}};
  };
  maker_.root["meshes"] = {mesh(first, {jaw_first, smile}, {"jawOpen", "smile"}),
                           mesh(second, {jaw_second}, {"jawOpen"})};
  auto [a, a_pose] = node(true);
  auto [b, b_pose] = node(true);
  a["mesh"] = 0;
  b["mesh"] = 1;
  maker_.root["nodes"] = {a, b};
  maker_.root["scenes"] = Json::array({{{"nodes", {0, 1}}}});
  const FaceShapes shapes = parseGlbShapes(maker_.bytes(), "made up");
  ASSERT_EQ(shapes.names, (std::vector<std::string>{"jawOpen", "smile"}));
  for (const VertexPositions& moves : shapes.moves) ASSERT_EQ(moves.rows(), 10);
  for (Eigen::Index v = 0; v < 10; ++v) {
    const Eigen::Vector3d jaw =
        v < 6 ? a_pose.linear() * pointAt(jaw_first, v) : b_pose.linear() * pointAt(jaw_second, v - 6);
    EXPECT_LT((pointAt(shapes.moves[0], v) - jaw).norm(), 1e-4) << v;
    const Eigen::Vector3d smiles =
        v < 6 ? Eigen::Vector3d(a_pose.linear() * pointAt(smile, v)) : Eigen::Vector3d::Zero();
    EXPECT_LT((pointAt(shapes.moves[1], v) - smiles).norm(), 1e-4) << v;
  }
}

/// Whole numbers that stand for shares of their type's largest.
TEST_P(GlbLaws, NormalisedNumbersAreShares) {
  std::vector<std::int16_t> shorts;
  std::vector<std::int8_t> bytes;
  std::vector<std::uint16_t> words;
  for (int i = 0; i < 12; ++i) {
    shorts.push_back(static_cast<std::int16_t>(random_()));
    bytes.push_back(static_cast<std::int8_t>(random_()));
    words.push_back(static_cast<std::uint16_t>(random_()));
  }
  shorts[0] = -32768;
  bytes[0] = -128;  // both ends are -1
  const std::vector<float> floats{0.5F, -3, 7};
  maker_.root["meshes"] =
      Json::array({{{"primitives", Json::array({{{"attributes", {{"POSITION", maker_.places(vertices(3))}}}}})}}});
  maker_.root["nodes"] = Json::array({{{"mesh", 0}}});
  maker_.root["scenes"] = Json::array({{{"nodes", {0}}}});
  const std::vector<std::size_t> which{
      static_cast<std::size_t>(maker_.accessor(maker_.view(shorts, 1), kShort, 12, "SCALAR", true)),
      static_cast<std::size_t>(maker_.accessor(maker_.view(bytes, 1), kByte, 12, "SCALAR", true)),
      static_cast<std::size_t>(maker_.accessor(maker_.view(words, 1), kUnsignedShort, 12, "SCALAR", true)),
      static_cast<std::size_t>(maker_.accessor(maker_.view(words, 1), kUnsignedShort, 12, "SCALAR")),
      static_cast<std::size_t>(maker_.accessor(maker_.view(floats, 1, 8), kFloat, 3, "SCALAR"))};
  const auto scalars = glbScalars(maker_.bytes(), "made up", which);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_FLOAT_EQ(scalars[0][i], std::max(-1.0F, static_cast<float>(shorts[i]) / 32767));
    EXPECT_FLOAT_EQ(scalars[1][i], std::max(-1.0F, static_cast<float>(bytes[i]) / 127));
    EXPECT_FLOAT_EQ(scalars[2][i], static_cast<float>(words[i]) / 65535);
    EXPECT_EQ(scalars[3][i], static_cast<float>(words[i]));
  }
  EXPECT_EQ(scalars[4], floats);
  EXPECT_EQ(parseGlb(maker_.bytes(), "made up").triangles, (std::vector<Triangle>{{0, 1, 2}})) << "without indices";
}

}  // namespace
}  // namespace mouthpiece
