#include "made_up_avatar.h"

#include <draco/compression/encode.h>
#include <draco/mesh/mesh.h>
#include <meshoptimizer.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "base/index.h"
#include "deform/mesh/glb_chunks.h"

namespace mouthpiece::test {
namespace {

using Eigen::Vector3f;
using nlohmann::json;
using Points = std::vector<Vector3f>;
using Corners = std::vector<std::uint16_t>;

constexpr int kByte = 5121, kShort = 5122, kUnsignedShort = 5123, kFloat = 5126;

/// A sheet that bulges towards +Z, from (x0, y0) to (x1, y1), `across` by `up` squares.
void addSheet(Points& points, Corners& corners, Vector3f low, Vector3f high, int across, int up) {
  const auto first = static_cast<std::uint16_t>(points.size());
  for (int j = 0; j <= up; ++j) {
    for (int i = 0; i <= across; ++i) {
      const float u = static_cast<float>(i) / static_cast<float>(across),
                  v = static_cast<float>(j) / static_cast<float>(up);
      const float x = low.x() + u * (high.x() - low.x());
      points.emplace_back(x, low.y() + v * (high.y() - low.y()), low.z() + 0.06F * std::cos(12 * x));
    }
  }
  for (int j = 0; j < up; ++j) {
    for (int i = 0; i < across; ++i) {
      const auto at = static_cast<std::uint16_t>(first + j * (across + 1) + i);
      const auto over = static_cast<std::uint16_t>(at + across + 1);
      for (const int corner : {int{at}, at + 1, over + 1, int{at}, over + 1, int{over}})
        corners.push_back(static_cast<std::uint16_t>(corner));
    }
  }
}

class AvatarWriter {
 public:
  explicit AvatarWriter(const AvatarStyle& style) : style_(style) {}

  std::string write() {
    root_ = {{"asset", {{"version", "2.0"}, {"generator", "made up"}, {"copyright", "nobody's"}}},
             {"scene", 0},
             {"scenes", {{{"nodes", {0}}, {"extras", {{"stage", "attic"}}}}}},
             {"extensionsUsed", {"EXT_nobody_knows", "KHR_texture_basisu"}},
             {"extensions", {{"EXT_nobody_knows", {{"deep", {{"list", {1.5, -2, "ä"}}}}}}}},
             {"extras", {{"studio", 7}}},
             {"images",
              {{{"uri", "data:image/ktx2;base64,q0tUWCAyMLsNChoK"}, {"mimeType", "image/ktx2"}, {"name", "paint"}}}},
             {"textures", {{{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}}}},
             {"materials",
              {{{"name", "N00_000_00_HairBack_00"},  // says hair, but is what the mouth's shapes move
                {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}, {"roughnessFactor", 0.5}}},
                {"extensions", {{"EXT_nobody_knows", {{"flag", true}}}}}},
               {{"name", "Iris"}},
               {{"name", "Teeth"}},
               {{"name", "Boot_Skin"}},
               {{"name", "Lash"}}}}};
    for (const char* list : {"nodes", "meshes", "skins", "animations", "accessors", "bufferViews"})
      root_[list] = json::array();
    addPerson("Ann", 0);
    if (style_.two_heads) addPerson("Ben", 2);
    root_["nodes"][0]["extras"] = {{"rig", "hips"}};
    json buffer{{"byteLength", binary_.size()}};
    root_["buffers"] = json::array({buffer});
    if (style_.meshopt) {
      root_["buffers"].push_back(
          {{"byteLength", fallback_bytes_}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
      need("EXT_meshopt_compression");
    }
    if (style_.quantised) need("KHR_mesh_quantization");
    if (style_.draco) need("KHR_draco_mesh_compression");
    if (style_.vrm == 1) {
      root_["extensionsUsed"].push_back("VRMC_vrm");
      root_["extensions"]["VRMC_vrm"] = {
          {"specVersion", "1.0"},
          {"humanoid", {{"humanBones", {{"head", {{"node", 1}}}}}}},
          {"expressions",
           {{"preset",
             {{"aa", {{"morphTargetBinds", {{{"node", 4}, {"index", 0}, {"weight", 1.0}}}}}},
              {"blinkLeft", {{"morphTargetBinds", {{{"node", 4}, {"index", 1}, {"weight", 1.0}}}}}},
              {"surprised",
               {{"morphTargetBinds",
                 {{{"node", 4}, {"index", 0}, {"weight", 0.5}}, {{"node", 4}, {"index", 1}}}}}}}}}}};
    }
    if (style_.vrm == 0) {
      const auto group = [](const char* preset, const json& binds) {
        return json{{"name", "Group"}, {"presetName", preset}, {"binds", binds}};
      };
      root_["extensionsUsed"].push_back("VRM");
      root_["extensions"]["VRM"] = {{"specVersion", "0.0"},
                                    {"humanoid", {{"humanBones", {{{"bone", "head"}, {"node", 1}}}}}},
                                    {"secondaryAnimation", {{"boneGroups", {{{"bones", {3}}, {"stiffiness", 0.5}}}}}},
                                    {"blendShapeMaster",
                                     {{"blendShapeGroups",
                                       {group("a", {{{"mesh", 0}, {"index", 0}, {"weight", 100}}}),
                                        group("blink_l", {{{"mesh", 0}, {"index", 1}, {"weight", 100}}}),
                                        group("joy", {{{"mesh", 0}, {"index", 0}}, {{"mesh", 0}, {"index", 1}}})}}}}};
    }
    return glbOf(root_.dump(), binary_);
  }

 private:
  void need(const char* extension) {
    root_["extensionsUsed"].push_back(extension);
    root_["extensionsRequired"].push_back(extension);
  }

  template <typename T>
  std::size_t view(const std::vector<T>& values, std::size_t stride, int target) {
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    const std::string_view bytes(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    json made{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
    if (target != 0) made["target"] = target;
    if (stride != 0 && target == 34962) made["byteStride"] = stride;
    if (style_.meshopt && target != 0 && stride % 4 == 0 && target == 34962) {
      const std::size_t count = bytes.size() / stride;
      std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, stride));
      packed.resize(meshopt_encodeVertexBuffer(packed.data(), packed.size(), bytes.data(), count, stride));
      made["extensions"]["EXT_meshopt_compression"] = {
          {"buffer", 0},    {"byteOffset", binary_.size()}, {"byteLength", packed.size()}, {"byteStride", stride},
          {"count", count}, {"mode", "ATTRIBUTES"}};
      made["buffer"] = 1;
      made["byteOffset"] = fallback_bytes_;
      fallback_bytes_ += bytes.size();
      binary_.append(reinterpret_cast<const char*>(packed.data()), packed.size());
    } else {
      binary_.append(bytes);
    }
    root_["bufferViews"].push_back(made);
    return root_["bufferViews"].size() - 1;
  }

  std::size_t accessor(json made) {
    root_["accessors"].push_back(std::move(made));
    return root_["accessors"].size() - 1;
  }

  static json bounds(const Points& points, bool low) {
    Vector3f bound = points[0];
    for (const Vector3f& p : points) bound = low ? Vector3f(bound.cwiseMin(p)) : Vector3f(bound.cwiseMax(p));
    return {bound.x(), bound.y(), bound.z()};
  }

  /// Positions as they are, or in 16 bits with what a bone takes back (kQuantum).
  std::size_t positions(const Points& points) {
    if (!style_.quantised) return vectors(points, true);
    std::vector<std::int16_t> values;
    std::array<int, 3> low{40'000, 40'000, 40'000}, high{-40'000, -40'000, -40'000};
    for (const Vector3f& p : points) {
      for (int axis = 0; axis < 3; ++axis) {
        values.push_back(static_cast<std::int16_t>(std::lround(p[axis] / kQuantum)));
        low[static_cast<std::size_t>(axis)] = std::min<int>(low[static_cast<std::size_t>(axis)], values.back());
        high[static_cast<std::size_t>(axis)] = std::max<int>(high[static_cast<std::size_t>(axis)], values.back());
      }
      values.push_back(0);  // each vertex on a multiple of four bytes
    }
    return accessor({{"bufferView", view(values, 8, 34962)},
                     {"componentType", kShort},
                     {"count", points.size()},
                     {"type", "VEC3"},
                     {"min", low},
                     {"max", high}});
  }

  std::size_t vectors(const Points& points, bool is_base) {
    std::vector<float> values;
    for (const Vector3f& p : points) values.insert(values.end(), {p.x(), p.y(), p.z()});
    json made{{"componentType", kFloat},
              {"count", points.size()},
              {"type", "VEC3"},
              {"min", bounds(points, true)},
              {"max", bounds(points, false)}};
    if (is_base && style_.sparse) {
      // The first vertex stands elsewhere in the plain data.
      const std::vector<float> right(values.begin(), values.begin() + 3);
      values[0] += 1;
      made["sparse"] = {
          {"count", 1},
          {"indices", {{"bufferView", view(std::vector<std::uint16_t>{0}, 0, 0)}, {"componentType", kUnsignedShort}}},
          {"values", {{"bufferView", view(right, 0, 0)}}}};
    }
    made["bufferView"] = view(values, 12, 34962);
    return accessor(std::move(made));
  }

  std::size_t scalars(const std::vector<float>& values, bool bounded) {
    json made{
        {"bufferView", view(values, 0, 0)}, {"componentType", kFloat}, {"count", values.size()}, {"type", "SCALAR"}};
    if (bounded) made.update({{"min", {values.front()}}, {"max", {values.back()}}});
    return accessor(std::move(made));
  }

  json primitive(const Points& points, const Corners& corners, int material, const std::vector<std::uint8_t>& joints) {
    json made{{"attributes", {{"POSITION", positions(points)}}},
              {"material", material},
              {"mode", 4},
              {"extras", {{"note", material}}}};
    made["indices"] = accessor({{"bufferView", view(corners, 0, 34963)},
                                {"componentType", kUnsignedShort},
                                {"count", corners.size()},
                                {"type", "SCALAR"}});
    if (joints.empty()) return made;
    std::vector<std::uint8_t> all, weights;
    for (const std::uint8_t joint : joints) {
      all.insert(all.end(), {joint, 0, 0, 0});
      weights.insert(weights.end(), {255, 0, 0, 0});
    }
    made["attributes"]["JOINTS_0"] = accessor(
        {{"bufferView", view(all, 4, 34962)}, {"componentType", kByte}, {"count", joints.size()}, {"type", "VEC4"}});
    made["attributes"]["WEIGHTS_0"] = accessor({{"bufferView", view(weights, 4, 34962)},
                                                {"componentType", kByte},
                                                {"normalized", true},
                                                {"count", joints.size()},
                                                {"type", "VEC4"}});
    return made;
  }

  std::size_t node(json made) {
    root_["nodes"].push_back(std::move(made));
    return root_["nodes"].size() - 1;
  }
  std::size_t mesh(json made) {
    root_["meshes"].push_back(std::move(made));
    return root_["meshes"].size() - 1;
  }

  /// The face's primitive by Draco: its accessors say what there is, their data are in the extension's view.
  void pack(json& made, const Points& points, const Corners& corners) {
    draco::Mesh mesh;
    mesh.set_num_points(static_cast<std::uint32_t>(points.size()));
    draco::GeometryAttribute attribute;
    attribute.Init(draco::GeometryAttribute::POSITION, nullptr, 3, draco::DT_FLOAT32, false, 12, 0);
    const int id = mesh.AddAttribute(attribute, true, mesh.num_points());
    for (std::uint32_t v = 0; v < mesh.num_points(); ++v)
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(v), points[v].data());
    mesh.SetNumFaces(corners.size() / 3);
    for (std::uint32_t f = 0; f < mesh.num_faces(); ++f) {
      mesh.SetFace(draco::FaceIndex(f), {draco::PointIndex(corners[3 * f]), draco::PointIndex(corners[3 * f + 1]),
                                         draco::PointIndex(corners[3 * f + 2])});
    }
    draco::Encoder encoder;
    encoder.SetEncodingMethod(draco::MESH_SEQUENTIAL_ENCODING);
    draco::EncoderBuffer buffer;
    if (!encoder.EncodeMeshToBuffer(mesh, &buffer).ok()) throw std::runtime_error("draco");
    const std::vector<char> bytes(buffer.data(), buffer.data() + buffer.size());
    made["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", view(bytes, 0, 0)}, {"attributes", {{"POSITION", mesh.attribute(id)->unique_id()}}}};
    json& position = root_["accessors"][made["attributes"]["POSITION"].get<std::size_t>()];
    json& indices = root_["accessors"][made["indices"].get<std::size_t>()];
    position.erase("bufferView");
    indices.erase("bufferView");
  }

  void addPerson(const std::string& name, float aside) {
    const std::size_t hips = node({{"name", name}, {"translation", {aside, 1, 0}}});
    const std::size_t head = node({{"name", name + "Head"}, {"translation", {0, 0.5, 0}}});
    const std::size_t jaw = node({{"name", name + "Jaw"}});
    const std::size_t eye =
        node({{"name", name + "Eye_L"}, {"translation", {0.03, 0.06, 0.05}}, {"scale", {0.5, 0.5, 0.5}}});
    root_["nodes"][hips]["children"] = {head};
    root_["nodes"][head]["children"] = {jaw, eye};
    if (aside > 0) root_["scenes"][0]["nodes"].push_back(hips);

    Points face;
    Corners corners;
    addSheet(face, corners, {-0.07F, 0.0F, 0}, {0.07F, 0.12F, 0}, 14, 12);
    const std::size_t upper = face.size();
    addSheet(face, corners, {-0.07F, -0.08F, 0}, {0.07F, -0.0005F, 0}, 14, 8);
    Points jaw_open(face.size(), Vector3f::Zero()), blink(face.size(), Vector3f::Zero());
    for (std::size_t v = upper; v < face.size(); ++v)
      jaw_open[v] = {0, -0.03F * std::max(0.0F, 1 - std::abs(face[v].x()) / 0.04F), 0};
    for (std::size_t v = 0; v < upper; ++v) {
      if ((face[v] - Vector3f(0.03F, 0.06F, face[v].z())).norm() < 0.015F) blink[v] = {0, -0.01F, 0};
    }
    const auto scale = static_cast<float>(style_.bind_scale);
    const auto scaled = [scale](Points points) {
      for (Vector3f& p : points) p *= scale;
      return points;
    };
    const std::vector<std::uint8_t> on_head(face.size(), 0);
    const Points shown = scaled(face);
    json skin_part = primitive(shown, corners, 0, on_head);
    if (style_.draco) pack(skin_part, shown, corners);
    const auto moves = [&](const Points& points) {
      return vectors(style_.quantised ? quantised(scaled(points)) : scaled(points), false);
    };
    skin_part["targets"] = {{{"POSITION", moves(jaw_open)}}, {{"POSITION", moves(blink)}}};
    json extras{{"artist", "Ö"}};
    if (style_.named == ShapesNamedBy::kMesh) extras["targetNames"] = {"jawOpen", "eyeBlinkLeft"};
    if (style_.named == ShapesNamedBy::kPrimitive) skin_part["extras"]["targetNames"] = {"jawOpen", "eyeBlinkLeft"};
    if (style_.named == ShapesNamedBy::kExpressions) extras["targetNames"] = {"あ", "ウィンク"};
    const std::size_t face_mesh = mesh({{"name", name + "Face"},
                                        {"primitives", {skin_part}},
                                        {"weights", {0.0, 0.25}},
                                        {"extras", std::move(extras)}});
    // Joint 0 is the head. What its bind matrix holds beside its place takes the mesh's scale back.
    const float unit = (style_.quantised ? kQuantum : 1.0F) / scale;
    const std::vector<float> binds{unit, 0, 0, 0, 0, unit, 0, 0, 0, 0, unit, 0, 0, 0,    0, 1,
                                   unit, 0, 0, 0, 0, unit, 0, 0, 0, 0, unit, 0, 0, 0.5F, 0, 1};
    const std::size_t bind_accessor =
        accessor({{"bufferView", view(binds, 0, 0)}, {"componentType", kFloat}, {"count", 2}, {"type", "MAT4"}});
    const std::size_t skin = root_["skins"].size();
    root_["skins"].push_back({{"joints", {head, hips}},
                              {"inverseBindMatrices", bind_accessor},
                              {"name", "bones"},
                              {"extras", {{"kept", true}}},
                              {"extensions", {{"EXT_nobody_knows", {{"skin", 1.25}}}}}});
    // The node's own place does not count: the skin tells it.
    const std::size_t shown_face =
        node({{"name", name + "FaceNode"}, {"mesh", face_mesh}, {"skin", skin}, {"translation", {9, 9, 9}}});
    root_["nodes"][hips]["children"].push_back(shown_face);

    Points ball;
    Corners ball_corners;
    addSheet(ball, ball_corners, {-0.01F, -0.01F, -0.05F}, {0.01F, 0.01F, -0.05F}, 3, 3);
    const float back = style_.quantised ? kQuantum : 1.0F;
    const auto shownAt = [&](const char* what, std::size_t mesh_number, Vector3f place, std::size_t parent) {
      const std::size_t made = node({{"name", name + what},
                                     {"mesh", mesh_number},
                                     {"translation", {place.x(), place.y(), place.z()}},
                                     {"scale", {back, back, back}}});
      root_["nodes"][parent]["children"].push_back(made);
      return made;
    };
    shownAt("EyeMesh", mesh({{"name", "ball"}, {"primitives", {primitive(ball, ball_corners, 1, {})}}}), {0, 0, 0},
            eye);
    shownAt("TeethMesh", mesh({{"name", "bite"}, {"primitives", {primitive(ball, ball_corners, 2, {})}}}),
            {0, 0, -0.02F}, head);
    const std::size_t lash = mesh({{"name", "fringe"}, {"primitives", {primitive(ball, ball_corners, 4, {})}}});
    shownAt("LashL", lash, {0.03F, 0.07F, 0.06F}, head);
    if (style_.shared_lash) shownAt("LashR", lash, {-0.03F, 0.07F, 0.06F}, head);
    shownAt("Boots", mesh({{"name", "boots"}, {"primitives", {primitive(ball, ball_corners, 3, {})}}}), {0, -0.9F, 0},
            hips);

    const std::size_t times = scalars({0, 0.5F, 1}, true);
    root_["animations"].push_back(
        {{"name", name + " idle"},
         {"extras", {{"loop", true}}},
         {"samplers",
          {{{"input", times},
            {"output", accessor({{"bufferView", view(std::vector<float>{0, 0.5F, 0, 0, 0.6F, 0, 0, 0.5F, 0}, 0, 0)},
                                 {"componentType", kFloat},
                                 {"count", 3},
                                 {"type", "VEC3"}})},
            {"interpolation", "LINEAR"}},
           {{"input", times}, {"output", scalars({0, 0.25F, 0.5F, 1, 0, 0.25F}, false)}}}},
         {"channels",
          {{{"sampler", 0}, {"target", {{"node", head}, {"path", "translation"}}}},
           {{"sampler", 1}, {"target", {{"node", shown_face}, {"path", "weights"}}}}}}});
  }

  static Points quantised(Points points) {
    for (Vector3f& p : points) p /= kQuantum;
    return points;
  }

  static constexpr float kQuantum = 1.0F / 16384;  ///< metres
  AvatarStyle style_;
  json root_;
  std::string binary_;
  std::size_t fallback_bytes_ = 0;
};

}  // namespace

std::string madeUpAvatar(const AvatarStyle& style) { return AvatarWriter(style).write(); }

}  // namespace mouthpiece::test
