// A GLB that is packed, by meshoptimizer or Draco, is the GLB that it was before.
#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/mesh/glb_chunks.h"
#include "support/error_of.h"

namespace mouthpiece {
namespace {

using Json = nlohmann::json;

enum class Packing { kNone, kTriangles, kSequence, kExponents, kDraco };

/// A random sheet on two bones, coloured; which of its accessors are packed, and how.
class PackedSheets : public ::testing::TestWithParam<unsigned> {
 protected:
  PackedSheets() {
    const auto rows = static_cast<std::uint32_t>(3 + random_() % 6),
               columns = static_cast<std::uint32_t>(3 + random_() % 6);
    std::uniform_real_distribution<float> place(-10, 10), share(0, 1);
    for (std::uint32_t v = 0; v < rows * columns; ++v) {
      positions_.push_back({place(random_), place(random_), place(random_)});
      colors_.push_back({byte(), byte(), byte(), 255});
      joints_.push_back({static_cast<std::uint8_t>(random_() % 2), static_cast<std::uint8_t>(random_() % 2), 0, 0});
      const float first = share(random_);
      weights_.push_back({first, 1 - first, 0, 0});
    }
    for (std::uint32_t r = 0; r + 1 < rows; ++r) {
      for (std::uint32_t c = 0; c + 1 < columns; ++c) {
        const std::uint32_t a = r * columns + c, d = a + columns;
        for (const std::uint32_t corner : {a, a + 1, d, a + 1, d + 1, d}) corners_.push_back(corner);
      }
    }
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_() % 256); }

  [[nodiscard]] std::string glb(Packing packing) {
    packing_ = packing;
    binary_.clear();
    const std::size_t count = positions_.size();
    root_ = Json::parse(R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
      "nodes": [{"mesh": 0, "skin": 0}, {"name": "head", "translation": [1, 2, 3], "children": [2]},
                {"name": "jaw", "translation": [-4, 0.5, 2]}],
      "skins": [{"joints": [1, 2]}], "meshes": [{"name": "face", "primitives": [{"indices": 4,
        "attributes": {"POSITION": 0, "COLOR_0": 1, "JOINTS_0": 2, "WEIGHTS_0": 3}}]}],
      "accessors": [], "bufferViews": []})");
    addVertices(positions_, {{"componentType", 5126}, {"type", "VEC3"}});
    addVertices(colors_, {{"componentType", 5121}, {"type", "VEC4"}, {"normalized", true}});
    addVertices(joints_, {{"componentType", 5121}, {"type", "VEC4"}});
    addVertices(weights_, {{"componentType", 5126}, {"type", "VEC4"}});
    addCorners();
    if (packing == Packing::kDraco) packByDraco(count);
    const char* extension = packing == Packing::kNone    ? nullptr
                            : packing == Packing::kDraco ? "KHR_draco_mesh_compression"
                                                         : meshopt_;
    if (extension != nullptr) root_["extensionsUsed"] = root_["extensionsRequired"] = Json::array({extension});
    root_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
    return glbOf(root_.dump(), binary_);
  }

  std::mt19937 random_{GetParam()};
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::array<std::uint8_t, 4>> colors_, joints_;
  std::vector<std::array<float, 4>> weights_;
  std::vector<std::uint32_t> corners_;
  Json root_;
  /// The same by two names.
  const char* meshopt_ = GetParam() % 2 == 0 ? "EXT_meshopt_compression" : "KHR_meshopt_compression";

 private:
  /// A view of the bytes as they are; its number.
  std::size_t view(const void* bytes, std::size_t size) {
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    root_["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", size}});
    binary_.append(static_cast<const char*>(bytes), size);
    return root_["bufferViews"].size() - 1;
  }
  /// A view of what meshoptimizer made of `count` entries of `stride`.
  std::size_t packedView(std::vector<unsigned char> packed, std::size_t size, std::size_t count, std::size_t stride,
                         const char* mode, const char* filter = nullptr) {
    packed.resize(size);
    const std::size_t number = view(packed.data(), size);
    Json& made = root_["bufferViews"][number];
    Json& extension = made["extensions"][meshopt_];
    extension = made;
    extension.erase("extensions");
    extension.update({{"byteStride", stride}, {"count", count}, {"mode", mode}});
    if (filter != nullptr) extension["filter"] = filter;
    made.update({{"byteOffset", 0}, {"byteLength", count * stride}});
    return number;
  }

  template <typename Entry>
  void addVertices(std::vector<Entry> entries, Json accessor) {
    constexpr std::size_t kStride = sizeof(Entry);
    accessor["count"] = entries.size();
    if (packing_ == Packing::kNone) accessor["bufferView"] = view(entries.data(), kStride * entries.size());
    if (packing_ != Packing::kNone && packing_ != Packing::kDraco) {
      const bool has_exponents = packing_ == Packing::kExponents && kStride >= 12;
      if (has_exponents) {
        std::vector<Entry> filtered(entries.size());
        meshopt_encodeFilterExp(filtered.data(), entries.size(), kStride, 20,
                                reinterpret_cast<const float*>(entries.data()));
        entries = filtered;
      }
      std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(entries.size(), kStride));
      const std::size_t size =
          meshopt_encodeVertexBuffer(packed.data(), packed.size(), entries.data(), entries.size(), kStride);
      accessor["bufferView"] = packedView(std::move(packed), size, entries.size(), kStride, "ATTRIBUTES",
                                          has_exponents ? "EXPONENTIAL" : nullptr);
    }
    root_["accessors"].push_back(accessor);
  }

  void addCorners() {
    Json accessor{{"componentType", 5125}, {"type", "SCALAR"}, {"count", corners_.size()}};
    if (packing_ == Packing::kNone) accessor["bufferView"] = view(corners_.data(), 4 * corners_.size());
    if (packing_ == Packing::kTriangles || packing_ == Packing::kExponents) {
      std::vector<unsigned char> packed(meshopt_encodeIndexBufferBound(corners_.size(), positions_.size()));
      const std::size_t size =
          meshopt_encodeIndexBuffer(packed.data(), packed.size(), corners_.data(), corners_.size());
      accessor["bufferView"] = packedView(std::move(packed), size, corners_.size(), 4, "TRIANGLES");
    }
    if (packing_ == Packing::kSequence) {
      std::vector<unsigned char> packed(meshopt_encodeIndexSequenceBound(corners_.size(), positions_.size()));
      const std::size_t size =
          meshopt_encodeIndexSequence(packed.data(), packed.size(), corners_.data(), corners_.size());
      accessor["componentType"] = 5123;
      accessor["bufferView"] = packedView(std::move(packed), size, corners_.size(), 2, "INDICES");
    }
    root_["accessors"].push_back(accessor);
  }

  template <typename Entry>
  static std::uint32_t addAttribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, draco::DataType data,
                                    const std::vector<Entry>& entries) {
    draco::GeometryAttribute attribute;
    attribute.Init(type, nullptr, static_cast<std::int8_t>(std::tuple_size_v<Entry>), data, false, sizeof(Entry), 0);
    const int id = mesh.AddAttribute(attribute, true, static_cast<std::uint32_t>(entries.size()));
    for (std::uint32_t v = 0; v < entries.size(); ++v)
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), entries[v].data());
    return mesh.attribute(id)->unique_id();
  }

  void packByDraco(std::size_t count) {
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<std::uint32_t>(count));
    using Attribute = draco::GeometryAttribute;
    Json attributes;
    attributes["POSITION"] = addAttribute(mesh, Attribute::POSITION, draco::DT_FLOAT32, positions_);
    attributes["COLOR_0"] = addAttribute(mesh, Attribute::COLOR, draco::DT_UINT8, colors_);
    attributes["JOINTS_0"] = addAttribute(mesh, Attribute::GENERIC, draco::DT_UINT8, joints_);
    // Packing rounds: weights do not add up to one, places leave the bounds that are told.
    auto rounded = weights_;
    for (auto& weights : rounded) weights = {0.998F * weights[0], 0.998F * weights[1], 0, 0};
    attributes["WEIGHTS_0"] = addAttribute(mesh, Attribute::GENERIC, draco::DT_FLOAT32, rounded);
    root_["accessors"][0]["min"] = root_["accessors"][0]["max"] = {0, 0, 0};
    mesh.SetNumFaces(corners_.size() / 3);
    for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
      draco::Mesh::Face face;
      for (std::uint32_t k = 0; k < 3; ++k) face[k] = corners_[3 * f + k];
      mesh.SetFace(draco::FaceIndex(f), face);
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
    draco::EncoderBuffer buffer;
    ASSERT_TRUE(encoder.EncodeMeshToBuffer(mesh, &buffer).ok());
    root_["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", view(buffer.data(), buffer.size())}, {"attributes", attributes}};
  }

  Packing packing_ = Packing::kNone;
  std::string binary_;
};
INSTANTIATE_TEST_SUITE_P(Seeds, PackedSheets, ::testing::Range(1U, 9U));

/// The corner of the least number first: packing may turn triangles.
std::vector<Triangle> turned(std::vector<Triangle> triangles) {
  for (Triangle& t : triangles) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return triangles;
}

TEST_P(PackedSheets, AreThePlainOnes) {
  const FaceMesh plain = parseFaceMesh(glb(Packing::kNone), "a.glb");
  ASSERT_EQ(plain.vertexCount(), positions_.size());
  ASSERT_EQ(plain.vertex_colors.size(), positions_.size());
  for (const Packing packing : {Packing::kTriangles, Packing::kSequence, Packing::kExponents, Packing::kDraco}) {
    SCOPED_TRACE(static_cast<int>(packing));
    const FaceMesh mesh = parseFaceMesh(glb(packing), "a.glb");
    EXPECT_EQ(turned(mesh.triangles), turned(plain.triangles));
    EXPECT_EQ(mesh.parts.size(), plain.parts.size());
    ASSERT_EQ(mesh.vertexCount(), plain.vertexCount());
    const float exactly = packing == Packing::kExponents ? 1e-3F : 1e-6F;
    EXPECT_LT((mesh.vertices - plain.vertices).cwiseAbs().maxCoeff(), exactly);
    ASSERT_EQ(mesh.vertex_colors.size(), plain.vertex_colors.size());
    for (std::size_t v = 0; v < plain.vertex_colors.size(); ++v) {
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(mesh.vertex_colors[v][k], plain.vertex_colors[v][k], 1e-6F);
    }
  }
}

/// Whoever reads what was unpacked needs no extension, and finds nothing packed.
TEST_P(PackedSheets, AreUnpackedWhole) {
  EXPECT_EQ(unpackedGlb(glb(Packing::kNone), "a.glb"), "");
  for (const Packing left : {Packing::kNone, Packing::kTriangles})
    EXPECT_EQ(withoutDraco(glb(left), "a.glb"), glb(left));
  EXPECT_EQ(withoutDraco(glb(Packing::kDraco), "a.glb"), unpackedGlb(glb(Packing::kDraco), "a.glb"));
  for (const Packing packing : {Packing::kTriangles, Packing::kSequence, Packing::kExponents, Packing::kDraco}) {
    const std::string unpacked = unpackedGlb(glb(packing), "a.glb");
    const GlbChunks chunks = glbChunks(unpacked, "a.glb");
    const Json root = Json::parse(chunks.json);
    EXPECT_FALSE(root.contains("extensionsUsed"));
    EXPECT_FALSE(root.contains("extensionsRequired"));
    EXPECT_EQ(std::string(chunks.json).find("compression"), std::string::npos);
    EXPECT_EQ(root["buffers"], Json::array({{{"byteLength", chunks.binary.size()}}}));
    for (const Json& view : root["bufferViews"]) {
      EXPECT_EQ(view["buffer"], 0);
      EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0U);
      EXPECT_LE(view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>(), chunks.binary.size());
    }
    for (const Json& accessor : root["accessors"]) EXPECT_TRUE(accessor.contains("bufferView"));
    if (packing != Packing::kDraco) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax_element(positions_.begin(), positions_.end(),
                                                   [&](const auto& a, const auto& b) { return a[k] < b[k]; });
      EXPECT_EQ(root["accessors"][0]["min"][k], (*low)[k]);
      EXPECT_EQ(root["accessors"][0]["max"][k], (*high)[k]);
    }
  }
}

TEST_P(PackedSheets, WhoseDescriptionIsWrongAreRefused) {
  const auto after = [&](Packing packing, auto&& damage) {
    std::string whole = glb(packing);
    const GlbChunks chunks = glbChunks(whole, "a.glb");
    Json root = Json::parse(chunks.json);
    damage(root, root["meshes"][0]["primitives"][0]);
    return errorOf([&] { parseFaceMesh(glbOf(root.dump(), std::string(chunks.binary)), "a.glb"); });
  };
  ASSERT_EQ(after(Packing::kDraco, [](Json&, Json&) {}), "no error");
  const auto draco = [](Json& primitive) -> Json& { return primitive["extensions"]["KHR_draco_mesh_compression"]; };
  EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { draco(p)["attributes"]["POSITION"] = "first"; }),
            "a.glb: found a Draco attribute without a number");
  EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { draco(p)["attributes"]["POSITION"] = 77; }),
            "a.glb: names a Draco attribute that it lacks");
  EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { draco(p)["attributes"]["NORMAL"] = 0; }),
            "a.glb: names a Draco attribute that it lacks");
  EXPECT_EQ(after(Packing::kDraco, [&](Json& r, Json&) { r["accessors"][0]["type"] = "VEC4"; }),
            "a.glb: found a Draco attribute of another width");
  EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { draco(p)["bufferView"] = 1; }),
            "a.glb: found no usable 'bufferView' of compressed data");
  for (const int accessor : {5, 99}) {
    EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { p["indices"] = accessor; }),
              "a.glb: names an accessor that it does not hold");
    EXPECT_EQ(after(Packing::kDraco, [&](Json&, Json& p) { p["attributes"]["COLOR_0"] = accessor; }),
              "a.glb: names an accessor that it does not hold");
  }
  EXPECT_EQ(after(Packing::kDraco, [&](Json& r, Json&) { r["bufferViews"][0]["byteLength"] = 20; }).substr(0, 40),
            "a.glb: found Draco data that is damaged:");
  const auto meshopt = [this](Json& root, int view) -> Json& {
    return root["bufferViews"][static_cast<std::size_t>(view)]["extensions"][meshopt_];
  };
  EXPECT_EQ(after(Packing::kTriangles, [&](Json& r, Json&) { meshopt(r, 0)["filter"] = "MEDIAN"; }),
            "a.glb: found the unknown meshopt filter 'MEDIAN'");
  EXPECT_EQ(after(Packing::kTriangles, [&](Json& r, Json&) { meshopt(r, 4)["filter"] = "EXPONENTIAL"; }),
            "a.glb: found the unknown meshopt filter 'EXPONENTIAL'");
  EXPECT_EQ(after(Packing::kTriangles, [&](Json& r, Json&) { meshopt(r, 0)["filter"] = "OCTAHEDRAL"; }),
            "a.glb: found the unknown meshopt filter 'OCTAHEDRAL'")
      << "of twelve bytes";
}

}  // namespace
}  // namespace mouthpiece
