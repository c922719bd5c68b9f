// What is wrong with a GLB is told: one place of a sound one changed at a time.
#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_scene.h"
#include "deform/mesh/mesh_reader.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

/// A triangle on two bones, with a shape, colours and a sparse accessor.
Json soundJson() {
  return Json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"name": "root", "children": [1, 2]}, {"mesh": 0, "skin": 0}, {"name": "head", "children": [3]}, {"name": "jaw"}],
    "skins": [{"joints": [2, 3], "inverseBindMatrices": 4}],
    "meshes": [{"name": "face", "extras": {"targetNames": ["jawOpen"]}, "primitives": [{"indices": 1, "targets": [{"POSITION": 6}],
      "attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3, "COLOR_0": 5}}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
      {"bufferView": 1, "componentType": 5125, "count": 3, "type": "SCALAR"},
      {"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"},
      {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC4"},
      {"bufferView": 4, "componentType": 5126, "count": 2, "type": "MAT4"},
      {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
      {"componentType": 5126, "count": 3, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": 5, "componentType": 5121}, "values": {"bufferView": 0}}}],
    "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 12},
      {"buffer": 0, "byteOffset": 48, "byteLength": 12}, {"buffer": 0, "byteOffset": 60, "byteLength": 48},
      {"buffer": 0, "byteOffset": 108, "byteLength": 128}, {"buffer": 0, "byteOffset": 236, "byteLength": 4}],
    "buffers": [{"byteLength": 240}]})");
}

std::string soundBinary() {
  std::string bytes;
  const auto put = [&](const auto& values) {
    bytes.append(reinterpret_cast<const char*>(std::data(values)), std::size(values) * sizeof(values[0]));
  };
  put(std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  put(std::vector<std::uint32_t>{0, 1, 2});
  put(std::vector<std::uint8_t>{0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0});
  put(std::vector<float>{1, 0, 0, 0, 0.5F, 0.5F, 0, 0, 1, 0, 0, 0});
  for (int bone = 0; bone < 2; ++bone) put(std::vector<float>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
  put(std::vector<std::uint8_t>{2, 0, 0, 0});
  return bytes;
}

std::string word(std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  return {reinterpret_cast<const char*>(&v), 4};
}

std::string glbOf(const Json& root, const std::string& binary = soundBinary()) {
  std::string json = root.dump();
  json.append((4 - json.size() % 4) % 4, ' ');
  return "glTF" + word(2) + word(28 + json.size() + binary.size()) + word(json.size()) + "JSON" + json +
         word(binary.size()) + std::string("BIN\0", 4) + binary;
}

/// What reading the mesh and its shapes says; "no error" where both are read.
std::string errorOfGlb(const std::string& glb) {
  return errorOf([&] {
    parseGlb(glb, "a.glb");
    parseGlbShapes(glb, "a.glb");
  });
}

struct Change {
  const char* place;  ///< a JSON pointer
  const char* value;  ///< JSON; nullptr: taken away
  const char* said;
};

class DamagedGlbs : public ::testing::TestWithParam<Change> {};

TEST_P(DamagedGlbs, AreRefusedWithWhatIsWrong) {
  ASSERT_EQ(errorOfGlb(glbOf(soundJson())), "no error");
  Json root = soundJson();
  const Json::json_pointer place(GetParam().place);
  if (GetParam().value == nullptr) {
    root[place.parent_pointer()].erase(place.back());
  } else {
    root[place] = Json::parse(GetParam().value);
  }
  EXPECT_EQ(errorOfGlb(glbOf(root)), std::string("a.glb: ") + GetParam().said);
}

constexpr const char* kRing = "found nodes that hold each other in a ring";
constexpr const char* kType = "found an accessor of the wrong type";
INSTANTIATE_TEST_SUITE_P(
    All, DamagedGlbs,
    ::testing::Values(
        Change{"/nodes/0/children/0", "9", "names a node that it does not hold"},
        Change{"/scenes/0/nodes/0", "9", "names a node that it does not hold"},
        Change{"/scene", "3", "names a scene that it does not hold"},
        Change{"/nodes/1/mesh", "5", "names a mesh that it does not hold"},
        Change{"/nodes/1/skin", "5", "names a skin that it does not hold"},
        Change{"/skins/0/joints/1", "9", "names a node that it does not hold"},
        Change{"/nodes/3/children", "[2]", kRing}, Change{"/nodes/3/children", "[0]", kRing},
        Change{"/nodes",
               R"([{"children": [1, 2], "scale": [1e200, 1e200, 1e200]}, {"mesh": 0, "skin": 0},
                 {"children": [3], "scale": [1e200, 1e200, 1e200]}, {"name": "jaw"}])",
               "found a node whose transform is no number"},
        Change{"/skins/0/joints", "[2]", "found joint 1; the skin has 1"},
        Change{"/accessors/4/count", "1", "found fewer bind matrices than joints"},
        Change{"/accessors/2/count", "2", "found fewer joints or weights than vertices"},
        Change{"/accessors/3/count", "2", "found fewer joints or weights than vertices"},
        Change{"/accessors/5/count", "2", "found fewer colours than vertices"},
        Change{"/accessors/6/count", "4", "found a shape that is no list of one move a vertex"},
        Change{"/meshes/0/primitives/0/mode", "5", "found a triangle strip or fan; expected triangles"},
        Change{"/meshes/0/primitives/0/mode", "6", "found a triangle strip or fan; expected triangles"},
        Change{"/meshes/0/primitives/0/attributes/POSITION", nullptr, "mesh 'face' has no positions"},
        Change{"/meshes/0/primitives/0/attributes/POSITION", "12", "names an accessor that it does not hold"},
        Change{"/accessors/0/type", "\"VEC4\"", kType}, Change{"/accessors/2/type", "\"VEC3\"", kType},
        Change{"/accessors/4/type", "\"VEC4\"", kType}, Change{"/accessors/5/type", "\"SCALAR\"", kType},
        Change{"/accessors/1/type", "\"VEC3\"", kType},
        Change{"/accessors/0/count", "4", "accessor 0 reaches beyond its buffer of 36 bytes"},
        Change{"/accessors/0/byteOffset", "4", "accessor 0 reaches beyond its buffer of 36 bytes"},
        Change{"/accessors/0/count", "70000000", "accessor 0 holds more than a head has"},
        Change{"/accessors/6/count", "5000", "accessor 6 reaches beyond its data"},
        Change{"/accessors/0/componentType", "5124", "found an accessor of an unknown type"},
        Change{"/accessors/1/componentType", "5126", "found indices that are no whole numbers"},
        Change{"/accessors/2/componentType", "5126", "found indices that are no whole numbers"},
        Change{"/accessors/6/sparse/indices/componentType", "5126", "found indices that are no whole numbers"},
        Change{"/accessors/6/sparse/count", "4", "found a damaged sparse accessor"},
        Change{"/accessors/6/sparse/count", "-1", "found a damaged sparse accessor"},
        Change{"/accessors/6/sparse/indices/byteOffset", "4", "found a sparse accessor that reaches beyond its buffer"},
        Change{"/accessors/6/sparse/values/byteOffset", "28", "found a sparse accessor that reaches beyond its buffer"},
        Change{"/accessors/6/sparse/values/bufferView", "9", "names a buffer view that it does not hold"},
        Change{"/accessors/0/bufferView", "9", "names a buffer view that it does not hold"},
        Change{"/bufferViews/0/buffer", "4", "names a buffer that it does not hold"},
        Change{"/bufferViews/0/byteLength", "241", "buffer view 0 reaches beyond its buffer of 240 bytes"},
        Change{"/extensionsRequired", "[\"ACME_hair\"]",
               "needs the extension ACME_hair, which is not understood; expected a GLB exported without it"},
        Change{"/nodes", "[]", "found no node; expected a scene with a mesh"}));

TEST(DamagedGlb, SparseIndicesStayWithinTheirAccessor) {
  std::string binary = soundBinary();
  binary[236] = 3;
  EXPECT_EQ(errorOfGlb(glbOf(soundJson(), binary)), "a.glb: found a sparse accessor with an index out of range");
}

TEST(DamagedGlb, NumbersAreNumbers) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), far = 1e8F;
  const auto with = [&](std::size_t at, float value) {
    std::string binary = soundBinary();
    std::memcpy(binary.data() + at, &value, 4);
    return errorOfGlb(glbOf(soundJson(), binary));
  };
  for (const float value : {nan, far, -far}) {
    EXPECT_EQ(with(12, value), "a.glb: vertex 1: found a coordinate that is no usable number");
  }
  EXPECT_EQ(with(112, nan), "a.glb: found a bind matrix that is no number");
}

/// The frame around it, which tinygltf does not look at.
TEST(DamagedGlb, TheFrameIsChecked) {
  const std::string glb = glbOf(soundJson());
  const auto with = [&](std::size_t at, const std::string& bytes) {
    std::string changed = glb;
    changed.replace(at, bytes.size(), bytes);
    return errorOfGlb(changed);
  };
  EXPECT_EQ(with(0, "glTf"), "a.glb: found no 'glTF' at the start; expected a GLB file");
  EXPECT_EQ(with(4, word(1)), "a.glb: found glTF version 1; expected 2");
  EXPECT_EQ(with(8, word(glb.size() + 1)), "a.glb: is " + std::to_string(glb.size()) + " bytes long; its header says " +
                                               std::to_string(glb.size() + 1));
  EXPECT_EQ(with(16, "json"), "a.glb: is no GLB that can be read: found no whole JSON chunk");
  EXPECT_EQ(with(12, word(glb.size())), "a.glb: is no GLB that can be read: found no whole JSON chunk");
  const std::size_t binary = glb.size() - soundBinary().size() - 8;
  EXPECT_EQ(with(binary, word(soundBinary().size() + 1)), "a.glb: is no GLB that can be read: its data is cut off");
  EXPECT_EQ(errorOfGlb(glb + "what follows is not read"), "no error");
  Json deep = soundJson();
  deep["extras"] = Json::parse(std::string(97, '[') + std::string(97, ']'));
  EXPECT_EQ(errorOfGlb(glbOf(deep)), "a.glb: holds JSON nested deeper than 96 levels");
  deep["extras"] = Json::parse(std::string(95, '[') + std::string(95, ']'));
  EXPECT_EQ(errorOfGlb(glbOf(deep)), "no error") << "the root is one of 96";
  deep["extras"] = std::string(200, '[') + "\\\"" + std::string(200, '{');
  EXPECT_EQ(errorOfGlb(glbOf(deep)), "no error") << "text is no nesting";
}

TEST(DamagedGlb, ShapesAreCalledByNumberWhereNamesAreMissing) {
  Json root = soundJson();
  EXPECT_EQ(parseGlbShapes(glbOf(root), "a.glb").names, std::vector<std::string>{"jawOpen"});
  root["meshes"][0]["extras"]["targetNames"] = Json::array({7});
  EXPECT_EQ(parseGlbShapes(glbOf(root), "a.glb").names, std::vector<std::string>{"shape_00"});
  root["meshes"][0].erase("extras");
  EXPECT_EQ(parseGlbShapes(glbOf(root), "a.glb").names, std::vector<std::string>{"shape_00"});
}

TEST(DamagedGlb, AnObjectThatIsNotThereIsNamedWithThoseThatAre) {
  EXPECT_EQ(errorOf([] { parseGlb(glbOf(soundJson()), "a.glb", "hat"); }),
            "a.glb: shows no object named 'hat'; its scene holds 'root'");
}

/// A mesh is chosen by its own name, by a node above it, or by what its bones hang on.
TEST(DamagedGlb, ObjectsAreMeshesNodesAndBones) {
  for (const char* object : {"face", "root", "head"})
    EXPECT_EQ(parseGlb(glbOf(soundJson()), "a.glb", object).vertexCount(), 3U) << object;
  EXPECT_NE(errorOf([] { parseGlb(glbOf(soundJson()), "a.glb", "jaw"); }), "no error") << "its first bone tells";
}

/// Packed by meshopt (EXT_meshopt_compression): what describes the packing is checked before anything is unpacked.
TEST(DamagedGlb, PackedViewsAreDescribedSoundly) {
  const auto with = [&](const char* place, const char* value) {
    Json root = soundJson();
    root["extensionsUsed"] = root["extensionsRequired"] = Json::array({"EXT_meshopt_compression"});
    root["bufferViews"][1]["extensions"]["EXT_meshopt_compression"] = {
        {"buffer", 0}, {"byteOffset", 36}, {"byteLength", 12}, {"byteStride", 4}, {"count", 3}, {"mode", "TRIANGLES"}};
    Json& packed = root["bufferViews"][1]["extensions"]["EXT_meshopt_compression"];
    if (value == nullptr)
      packed.erase(place);
    else
      packed[place] = Json::parse(value);
    return errorOfGlb(glbOf(root));
  };
  const std::string layout = "a.glb: found meshopt data of an unknown layout",
                    far = "a.glb: found compressed data that reaches beyond the file's own";
  EXPECT_EQ(with("count", "3"), "a.glb: found meshopt data that is damaged");
  EXPECT_EQ(with("count", nullptr), "a.glb: found no usable 'count' of compressed data");
  EXPECT_EQ(with("count", "-3"), "a.glb: found no usable 'count' of compressed data");
  EXPECT_EQ(with("byteStride", "300"), "a.glb: found no usable 'byteStride' of compressed data");
  EXPECT_EQ(with("buffer", "1"), far);
  EXPECT_EQ(with("byteLength", "205"), far);
  EXPECT_EQ(with("count", "4"), layout);
  EXPECT_EQ(with("byteStride", "3"), layout);
  EXPECT_EQ(with("count", "900000"), "a.glb: found meshopt data that is cut off");
  EXPECT_EQ(with("mode", "\"STRIPS\""), "a.glb: found meshopt data of the unknown mode 'STRIPS'");
  EXPECT_EQ(with("mode", "7"), "a.glb: holds compressed data that its JSON does not describe");
}

/// A node that no skin has among its joints is no bone, whatever it is called.
TEST(GlbBones, AreJoints) {
  Json root = soundJson();
  root["nodes"].push_back({{"name", "hair_stand"}, {"mesh", 1}});
  root["nodes"][0]["children"].push_back(4);
  Json visor = root["meshes"][0];
  visor["name"] = "visor";
  visor.erase("extras");
  for (const char* of_bones : {"JOINTS_0", "WEIGHTS_0"}) visor["primitives"][0]["attributes"].erase(of_bones);
  visor["primitives"][0].erase("targets");
  root["meshes"].push_back(visor);
  const FaceMesh mesh = parseGlb(glbOf(root), "a.glb");
  ASSERT_EQ(mesh.parts.size(), 2U);
  EXPECT_EQ(mesh.parts[1].name, "visor");
  EXPECT_EQ(mesh.parts[1].kind, PartKind::kSkin);
}

/// What the head's own shapes of the mouth move is its skin, whatever it is called and whichever of them moves it.
TEST(GlbShapes, TellTheSkin) {
  Json root = soundJson();
  root["meshes"][0]["name"] = "outfit";
  ASSERT_EQ(parseGlb(glbOf(root), "a.glb").parts.at(0).kind, PartKind::kOther) << "a shape that moves nothing";
  Json moving = root["accessors"][6];
  moving["sparse"]["values"]["byteOffset"] = 12;
  root["accessors"].push_back(moving);
  Json& mesh = root["meshes"][0];
  for (const bool is_last : {false, true}) {
    mesh["extras"]["targetNames"] = {"jawOpen", "mouthSmile_L"};
    mesh["primitives"][0]["targets"] = Json::array({{{"POSITION", is_last ? 6 : 7}}, {{"POSITION", is_last ? 7 : 6}}});
    EXPECT_EQ(parseGlb(glbOf(root), "a.glb").parts.at(0).kind, PartKind::kSkin) << is_last;
  }
  mesh["extras"]["targetNames"] = {"eyeBlink_L", "browInnerUp"};
  EXPECT_EQ(parseGlb(glbOf(root), "a.glb").parts.at(0).kind, PartKind::kOther) << "what moves is no mouth";
}

}  // namespace
}  // namespace mouthpiece
