// What GlbModel writes, read back by another route; and what becomes of GLBs that others made.
#include "exports/gltf/glb_model.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>

#include "base/errors.h"
#include "base/index.h"
#include "deform/mesh/face_mesh.h"
#include "exports/gltf/glb.h"
#include "support/glb_file.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using nlohmann::json;
using test::GlbFile;

/// A model that three.js and others would open: one node.
GlbModel emptyModel() {
  GlbModel model;
  model.root = {{"asset", {{"version", "2.0"}}}, {"nodes", {json::object()}}, {"scenes", {{{"nodes", {0}}}}}};
  return model;
}

struct Zeros {
  std::vector<std::uint32_t> indices;
  std::vector<float> values;  ///< three each
  std::vector<float> dense;
};

/// `count` vectors, each there with the probability `share`.
Zeros randomZeros(std::size_t count, double share, std::mt19937& random) {
  std::bernoulli_distribution is_there(share);
  std::normal_distribution<float> value(0, 2);
  Zeros made;
  made.dense.assign(3 * count, 0.0F);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!is_there(random)) continue;
    made.indices.push_back(i);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      made.values.push_back(value(random));
      made.dense[3 * i + axis] = made.values.back();
    }
  }
  return made;
}

void expectBounds(const json& accessor, const std::vector<float>& dense) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float low = dense[axis], high = dense[axis];
    for (std::size_t i = axis; i < dense.size(); i += 3) {
      low = std::min(low, dense[i]);
      high = std::max(high, dense[i]);
    }
    EXPECT_EQ(accessor["min"][axis].get<float>(), low) << axis;
    EXPECT_EQ(accessor["max"][axis].get<float>(), high) << axis;
  }
}

TEST(GlbModel, MostlyZeroVectorsReadBackWhateverIsStored) {
  std::mt19937 random(11);
  for (const std::size_t count : {1U, 7U, 300U, 65'535U, 65'536U}) {
    for (const double share : {0.0, 0.01, 0.3, 0.85, 1.0}) {
      GlbModel model = emptyModel();
      const Zeros zeros = randomZeros(count, share, random);
      const std::size_t accessor = model.addMostlyZeroVec3(zeros.indices, zeros.values, count, GlbUse::kMove);
      const std::size_t again = model.addMostlyZeroVec3({}, {}, count, GlbUse::kMove);
      EXPECT_EQ(accessor == again, zeros.indices.empty()) << "all-zero accessors of a count are one";
      const GlbFile file(std::move(model).toBytes());
      const std::vector<double> read = file.accessor(accessor);
      EXPECT_EQ(std::vector<float>(read.begin(), read.end()), zeros.dense) << count << " at " << share;
      const auto& told = file.root["accessors"][accessor];
      EXPECT_TRUE(told.contains("bufferView") || told.contains("sparse")) << "Assimp 5.2 reads no others";
      expectBounds(told, zeros.dense);
      EXPECT_LE(file.binary.size(), 12 * count + 24)
          << "sparse only where that is smaller, beside a zero for those without any";
    }
  }
}

TEST(GlbModel, IndicesAreNarrowWhereThatIsAllowed) {
  GlbModel model = emptyModel();
  const std::vector<std::uint32_t> indices{0, 65'534, 7};
  EXPECT_EQ(model.addIndices(indices, 65'535), 0U);
  EXPECT_EQ(model.addIndices(indices, 65'536), 1U);
  const GlbFile file(std::move(model).toBytes());
  EXPECT_EQ(file.root["accessors"][0]["componentType"], 5123);
  EXPECT_EQ(file.root["accessors"][1]["componentType"], 5125);
  EXPECT_EQ(file.accessor(0), file.accessor(1));
  EXPECT_EQ(file.root["bufferViews"][1]["byteOffset"].get<std::size_t>() % 4, 0U);
}

TEST(GlbModel, ATakenApartFileIsTheSameAgain) {
  const auto head = samples::makeTalkingHead({.frames = 12, .rings = 6, .segments = 8});
  const std::string written = glbBytes(head.mesh, principalShapes(head.animation, head.mesh.vertices, 0.001), "egg");
  EXPECT_EQ(GlbModel(written, "egg.glb").toBytes(), written);
}

/// A GLB that has a little of everything that is none of our business.
GlbFile dressed() {
  const auto head = samples::makeTalkingHead({.frames = 6, .rings = 4, .segments = 6});
  GlbFile glb(glbBytes(head.mesh, principalShapes(head.animation, head.mesh.vertices, 0.001), "egg"));
  glb.root["asset"]["copyright"] = "someone";
  glb.root["extensionsUsed"] = {"KHR_materials_unlit", "KHR_texture_transform", "KHR_lights_punctual", "EXT_own"};
  glb.root["extensions"] = {
      {"EXT_own", {{"numbers", {1, 2.5, -3}}, {"deep", {{"flag", true}, {"text", "ä"}}}}},
      {"KHR_lights_punctual",
       {{"lights", {{{"type", "point"}, {"color", {1.0, 0.5, 0.25}}, {"intensity", 3.0}, {"name", "lamp"}}}}}}};
  glb.root["extras"] = {{"studio", "attic"}};
  glb.root["images"] = {{{"bufferView", 0}, {"mimeType", "image/png"}, {"name", "paint"}}};
  glb.root["samplers"] = {{{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33648}}};
  glb.root["textures"] = {{{"source", 0}, {"sampler", 0}, {"name", "skin"}}};
  json& material = glb.root["materials"][0];
  material["pbrMetallicRoughness"]["baseColorTexture"] = {
      {"index", 0}, {"extensions", {{"KHR_texture_transform", {{"offset", {0.25, 0.5}}, {"rotation", 1.5}}}}}};
  material["normalTexture"] = {{"index", 0}, {"scale", 0.75}};
  material["emissiveFactor"] = {0.125, 0.25, 0.5};
  material["alphaMode"] = "MASK";
  material["alphaCutoff"] = 0.25;
  material["extensions"]["KHR_materials_unlit"] = json::object();
  glb.root["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.75}, {"znear", 0.125}, {"zfar", 100.0}}}}};
  glb.root["nodes"][0]["extras"] = {{"rig", 7}};
  glb.root["nodes"].push_back({{"name", "eye"}, {"camera", 0}, {"translation", {0.0, 1.0, 2.0}}});
  glb.root["scenes"][0]["nodes"].push_back(1);
  glb.root["scenes"][0]["name"] = "stage";
  return glb;
}

/// The vertex attributes and indices of every primitive, as numbers.
std::vector<std::vector<double>> geometryOf(const GlbFile& glb) {
  std::vector<std::vector<double>> all;
  for (const json& primitive : glb.root["meshes"][0]["primitives"]) {
    for (const json& attribute : primitive["attributes"]) all.push_back(glb.accessor(attribute));
    all.push_back(glb.accessor(primitive["indices"]));
  }
  return all;
}

int jawColumn(std::string_view name) { return name == "shape_01" ? 0 : -1; }

TEST(GivenGlb, KeepsWhatItKnowsNothingOf) {
  const GlbFile given = dressed();
  RowMajorMatrixF weights(3, 1);
  weights << 0, 0.5F, 1;
  const auto made = glbWithWeights(given.toBytes(), "dressed.glb", 30, {weights, jawColumn});
  ASSERT_TRUE(made);
  const GlbFile after(*made);
  for (const char* key : {"asset", "extensionsUsed", "extensions", "extras", "images", "samplers", "textures",
                          "materials", "meshes", "cameras", "nodes", "scenes", "scene"}) {
    EXPECT_EQ(after.root[key], given.root[key]) << key;
  }
  EXPECT_EQ(geometryOf(after), geometryOf(given));
  EXPECT_LE(after.binary.size(), given.binary.size()) << "the keys of the animation that gave way are gone";
}

TEST(GivenGlb, OnlyTheNamedTargetFollowsItsColumn) {
  const GlbFile given = dressed();
  const std::size_t targets = given.root["meshes"][0]["primitives"][0]["targets"].size();
  ASSERT_GE(targets, 2U);
  RowMajorMatrixF weights(3, 1);
  weights << 0, 0.5F, 1;
  const GlbFile after(*glbWithWeights(given.toBytes(), "dressed.glb", 30, {weights, jawColumn}));
  ASSERT_EQ(after.root["animations"].size(), 1U);
  const json& speech = after.root["animations"][0];
  const std::vector<double> times = after.accessor(speech["samplers"][0]["input"]);
  ASSERT_EQ(times.size(), 3U);
  for (std::size_t f = 0; f < 3; ++f) EXPECT_FLOAT_EQ(asFloat(times[f]), asFloat(asReal(f) / 30));
  std::vector<double> expected(3 * targets, 0.0);
  expected[targets + 1] = 0.5;
  expected[2 * targets + 1] = 1;
  EXPECT_EQ(after.accessor(speech["samplers"][0]["output"]), expected);
  EXPECT_FALSE(glbWithWeights(given.toBytes(), "dressed.glb", 30, {weights, [](std::string_view) { return -1; }}));
}

/// Damage may be refused, with the file's name first, or go unseen; nothing else may happen.
void expectNoHarm(const std::string& glb, const PrincipalShapes& shapes) {
  const auto tryOne = [](const auto& write) {
    try {
      (void)write();
    } catch (const InputError& error) {
      EXPECT_TRUE(std::string_view(error.what()).starts_with("cut.glb")) << error.what();
    }
  };
  tryOne([&] { return glbWithShapes(glb, "cut.glb", shapes, Eigen::Matrix3d::Identity()); });
  tryOne([&] { return glbWithWeights(glb, "cut.glb", 30, {RowMajorMatrixF::Zero(2, 1), jawColumn}); });
}

TEST(GivenGlb, DamageIsRefusedOrHarmless) {
  const GlbFile given = dressed();
  const std::string whole = given.toBytes();
  const FaceMesh mesh = parseFaceMesh(whole, "cut.glb");
  PrincipalShapes shapes;
  shapes.frame_rate_hz = 30;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes = RowMajorMatrixF::Ones(1, mesh.vertices.size());
  shapes.weights = RowMajorMatrixF::Ones(2, 1);
  ASSERT_TRUE(glbWithShapes(whole, "cut.glb", shapes, Eigen::Matrix3d::Identity()));
  std::mt19937 random(3);
  const std::size_t json_end = 20 + given.root.dump().size();
  for (int trial = 0; trial < 400; ++trial) {
    std::string damaged = whole;
    for (int flips = 0; flips < 1 + trial % 3; ++flips)
      damaged[random() % (trial % 2 == 0 ? json_end : whole.size())] = static_cast<char>(random());
    expectNoHarm(damaged, shapes);
  }
  for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 97)
    expectNoHarm(whole.substr(0, size), shapes);
}

TEST(GivenGlb, NumbersOutOfRangeAreRefusedOrHarmless) {
  const GlbFile given = dressed();
  PrincipalShapes shapes;
  const FaceMesh mesh = parseFaceMesh(given.toBytes(), "cut.glb");
  shapes.frame_rate_hz = 30;
  shapes.rest = Eigen::Map<const Eigen::RowVectorXf>(mesh.vertices.data(), mesh.vertices.size());
  shapes.shapes = RowMajorMatrixF::Ones(1, mesh.vertices.size());
  shapes.weights = RowMajorMatrixF::Ones(2, 1);
  for (const char* pointer :
       {"/scene", "/scenes/0/nodes/0", "/nodes/0/mesh", "/nodes/0/children",
        "/meshes/0/primitives/0/attributes/POSITION", "/meshes/0/primitives/0/mode", "/accessors/0/count",
        "/accessors/0/bufferView", "/accessors/0/componentType", "/bufferViews/0/byteLength", "/bufferViews/0/buffer",
        "/buffers/0/byteLength", "/meshes/0/extras", "/animations", "/meshes/0/primitives"}) {
    for (const json& value : {json(-1), json(77), json(2'000'000'000), json("text"), json::array(), json(nullptr)}) {
      GlbFile damaged = given;
      damaged.root[json::json_pointer(pointer)] = value;
      expectNoHarm(damaged.toBytes(), shapes);
    }
  }
  GlbFile ring = given;
  ring.root["nodes"][0]["children"] = {0};
  EXPECT_THROW((void)glbWithShapes(ring.toBytes(), "cut.glb", shapes, Eigen::Matrix3d::Identity()), InputError);
}

}  // namespace
}  // namespace mouthpiece
