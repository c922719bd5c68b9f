// Geometry that a GLB keeps compressed, by meshoptimizer's and Draco's own decoders.
#include <draco/compression/decode.h>
#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "base/errors.h"
#include "base/json_text.h"
#include "deform/mesh/glb_chunks.h"
#include "deform/mesh/mesh_limits.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

/// The same but for a filter and a younger code of vertices, which the decoder refuses.
constexpr std::array kMeshopts{"EXT_meshopt_compression", "KHR_meshopt_compression"};
constexpr const char* kDraco = "KHR_draco_mesh_compression";
constexpr int kFloat = 5126, kUnsignedInt = 5125;
constexpr std::uint64_t kMostUnpacked = std::uint64_t{1} << 31;

bool uses(const json& root, const char* extension) {
  const auto used = root.find("extensionsUsed");
  return used != root.end() && used->is_array() && std::find(used->begin(), used->end(), extension) != used->end();
}

bool usesMeshopt(const json& root) {
  return std::any_of(kMeshopts.begin(), kMeshopts.end(), [&](const char* name) { return uses(root, name); });
}

void forget(json& root, const char* extension) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    const auto found = root.find(list);
    if (found == root.end() || !found->is_array()) continue;
    found->erase(std::remove(found->begin(), found->end(), extension), found->end());
    if (found->empty()) root.erase(found);
  }
}

const json* extensionOf(const json& object, const char* name) {
  const auto all = object.find("extensions");
  if (all == object.end() || !all->is_object()) return nullptr;
  const auto own = all->find(name);
  return own == all->end() || !own->is_object() ? nullptr : &*own;
}

class Unpacker {
 public:
  Unpacker(json root, std::string_view binary, std::string_view file)
      : root_(std::move(root)), given_(binary), file_(file) {}

  std::string unpack() {
    // Other buffers are the fallback that the extension allows, without data in a GLB.
    for (json& view : root_.at("bufferViews")) moveView(view);
    if (uses(root_, kDraco)) {
      for (json& mesh : root_.at("meshes")) {
        for (json& primitive : mesh.at("primitives")) {
          if (const json* packed = extensionOf(primitive, kDraco)) unpackPrimitive(primitive, json(*packed));
        }
      }
    }
    root_["buffers"] = json::array({{{"byteLength", binary_.size()}}});
    for (const char* name : kMeshopts) forget(root_, name);
    forget(root_, kDraco);
    return glbOf(jsonText(root_), std::move(binary_));
  }

 private:
  [[noreturn]] void fail(std::string_view what) const { throw InputError(std::string(file_), "", what); }

  /// A number of the file's, 0 to `most`; `fallback` where it is missing.
  std::uint64_t whole(const json& object, const char* key, std::uint64_t most,
                      std::optional<std::uint64_t> fallback = std::nullopt) const {
    const auto found = object.find(key);
    if (found == object.end() && fallback) return *fallback;
    if (found == object.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > most)
      fail(fmt::format("found no usable '{}' of compressed data", key));
    return found->get<std::uint64_t>();
  }

  std::string_view bytesAt(std::uint64_t buffer, std::uint64_t offset, std::uint64_t length) const {
    if (buffer != 0 || offset > given_.size() || length > given_.size() - offset)
      fail("found compressed data that reaches beyond the file's own");
    return given_.substr(offset, length);
  }

  /// Appends room for `bytes` and returns where it begins.
  std::size_t grow(std::uint64_t bytes) {
    binary_.append((4 - binary_.size() % 4) % 4, '\0');
    const std::size_t at = binary_.size();
    if (bytes > kMostUnpacked - std::min<std::uint64_t>(at, kMostUnpacked)) fail("unpacks to more than 2 GB");
    binary_.resize(at + bytes);
    return at;
  }

  void moveView(json& view) {
    const std::uint64_t far = given_.size();
    for (const char* name : kMeshopts) {
      if (const json* packed = extensionOf(view, name)) return unpackView(view, json(*packed), name);
    }
    const std::string_view own =
        bytesAt(whole(view, "buffer", 1000), whole(view, "byteOffset", far, 0), whole(view, "byteLength", far));
    const std::size_t at = grow(own.size());
    std::copy(own.begin(), own.end(), binary_.begin() + static_cast<std::ptrdiff_t>(at));
    view["byteOffset"] = at;
  }

  void unpackView(json& view, const json& packed, const char* extension) {
    const std::uint64_t far = given_.size();
    const std::string_view from =
        bytesAt(whole(packed, "buffer", 1000), whole(packed, "byteOffset", far, 0), whole(packed, "byteLength", far));
    const std::size_t count = whole(packed, "count", 8 * kMaxMeshVertices);
    const std::size_t stride = whole(packed, "byteStride", 256);
    const std::string mode = packed.value("mode", ""), filter = packed.value("filter", "NONE");
    const bool is_vertices = mode == "ATTRIBUTES";
    if (!(is_vertices ? stride % 4 == 0 && stride > 0 : stride == 2 || stride == 4) ||
        (mode == "TRIANGLES" && count % 3 != 0))
      fail("found meshopt data of an unknown layout");
    // The encoder needs two bits for sixteen bytes of a vertex stream at least, and a byte for a triangle.
    if (std::uint64_t{count} * stride > 64 * std::uint64_t{from.size()} + 1024)
      fail("found meshopt data that is cut off");
    const std::size_t at = grow(std::uint64_t{count} * stride);
    const auto* data = reinterpret_cast<const unsigned char*>(from.data());
    char* to = binary_.data() + at;
    int problem = 0;
    if (is_vertices)
      problem = meshopt_decodeVertexBuffer(to, count, stride, data, from.size());
    else if (mode == "TRIANGLES")
      problem = meshopt_decodeIndexBuffer(to, count, stride, data, from.size());
    else if (mode == "INDICES")
      problem = meshopt_decodeIndexSequence(to, count, stride, data, from.size());
    else
      fail(fmt::format("found meshopt data of the unknown mode '{}'", printable(mode, 40)));
    if (problem != 0 && is_vertices && !from.empty() && (from[0] & 0x0f) != 0)
      fail("found meshopt data of a younger version; expected version 0 (gltfpack -c)");
    if (problem != 0) fail("found meshopt data that is damaged");
    if (filter == "OCTAHEDRAL" && is_vertices && (stride == 4 || stride == 8))
      meshopt_decodeFilterOct(to, count, stride);
    else if (filter == "QUATERNION" && is_vertices && stride == 8)
      meshopt_decodeFilterQuat(to, count, stride);
    else if (filter == "EXPONENTIAL" && is_vertices)
      meshopt_decodeFilterExp(to, count, stride);
    else if (filter != "NONE")
      fail(fmt::format("found the unknown meshopt filter '{}'", printable(filter, 40)));
    view["buffer"] = 0;
    view["byteOffset"] = at;
    view["byteLength"] = count * stride;
    if (is_vertices) view["byteStride"] = stride;
    view["extensions"].erase(extension);
    if (view["extensions"].empty()) view.erase("extensions");
  }

  json& accessorAt(const json& number) {
    json& accessors = root_.at("accessors");
    if (!number.is_number_unsigned() || number.get<std::uint64_t>() >= accessors.size())
      fail("names an accessor that it does not hold");
    return accessors[number.get<std::size_t>()];
  }

  /// Gives an accessor plain data of its own.
  void fill(json& accessor, std::size_t count, int component, std::size_t bytes, std::size_t at) {
    json& views = root_.at("bufferViews");
    accessor["bufferView"] = views.size();
    accessor["byteOffset"] = 0;
    accessor["count"] = count;
    accessor["componentType"] = component;
    accessor.erase("normalized");
    views.push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes}});
  }

  void unpackPrimitive(json& primitive, const json& packed) {
    const json& views = root_.at("bufferViews");
    const std::uint64_t number = whole(packed, "bufferView", views.size() - 1);
    const json& view = views[number];
    const std::string data =
        binary_.substr(whole(view, "byteOffset", binary_.size()), whole(view, "byteLength", binary_.size()));
    draco::DecoderBuffer buffer;
    buffer.Init(data.data(), data.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) fail("found Draco data that is damaged: " + printable(decoded.status().error_msg_string(), 80));
    const draco::Mesh& mesh = *decoded.value();
    const std::uint32_t points = mesh.num_points();
    const std::size_t corners = 3 * std::size_t{mesh.num_faces()};
    if (points > kMaxMeshVertices || corners > 3 * kMaxMeshTriangles) fail("found more Draco data than a head has");
    for (const auto& [name, id] : packed.at("attributes").items()) {
      if (!id.is_number_unsigned()) fail("found a Draco attribute without a number");
      const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(id.get<std::uint32_t>());
      const auto own = primitive.at("attributes").find(name);
      if (attribute == nullptr || own == primitive.at("attributes").end())
        fail("names a Draco attribute that it lacks");
      unpackAttribute(accessorAt(*own), *attribute, points);
      if (name == "WEIGHTS_0" && !primitive["attributes"].contains("WEIGHTS_1")) makeSharesWhole(accessorAt(*own));
    }
    if (const auto indices = primitive.find("indices"); indices != primitive.end()) {
      const std::size_t at = grow(corners * 4);
      auto* to = reinterpret_cast<std::uint32_t*>(binary_.data() + at);
      for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face) {
        for (std::size_t k = 0; k < 3; ++k) *to++ = mesh.face(face)[k].value();
      }
      fill(accessorAt(*indices), corners, kUnsignedInt, corners * 4, at);
    }
    primitive["extensions"].erase(kDraco);
    if (primitive["extensions"].empty()) primitive.erase("extensions");
  }

  void unpackAttribute(json& accessor, const draco::PointAttribute& attribute, std::uint32_t points) {
    constexpr int kUnsignedShort = 5123;
    const std::string type = accessor.value("type", "");
    const std::size_t width = type == "SCALAR" ? 1U
                              : type == "VEC2" ? 2U
                              : type == "VEC3" ? 3U
                              : type == "VEC4" ? 4U
                                               : 0U;
    if (width == 0 || attribute.num_components() != static_cast<int>(width))
      fail("found a Draco attribute of another width");
    const int component = accessor.value("componentType", kFloat);
    // Joints stay whole numbers; all else is read as real ones, and shares as such.
    const bool is_joints = component != kFloat && !accessor.value("normalized", false) && width == 4;
    const double share = accessor.value("normalized", false) && !attribute.normalized()
                             ? (component == 5121             ? 255.0
                                : component == kUnsignedShort ? 65535.0
                                : component == 5120           ? 127.0
                                                              : 32767.0)
                             : 1.0;
    const std::size_t bytes = std::size_t{points} * width * (is_joints ? 2 : 4);
    const std::size_t at = grow(bytes);
    std::array<float, 4> values{};
    for (draco::PointIndex point(0); point < points; ++point) {
      if (!attribute.ConvertValue<float>(attribute.mapped_index(point), static_cast<std::int8_t>(width), values.data()))
        fail("found a Draco attribute that cannot be read");
      for (std::size_t k = 0; k < width; ++k) {
        const std::size_t place = at + (point.value() * width + k) * (is_joints ? 2 : 4);
        const auto joint = static_cast<std::uint16_t>(std::clamp(values[k], 0.0F, 65535.0F));
        const float value = asFloat(static_cast<double>(values[k]) / share);
        if (is_joints)
          std::memcpy(binary_.data() + place, &joint, 2);
        else
          std::memcpy(binary_.data() + place, &value, 4);
      }
    }
    fill(accessor, points, is_joints ? kUnsignedShort : kFloat, bytes, at);
    if (accessor.contains("min") && !is_joints) setBounds(accessor, width);
  }

  /// The numbers of an accessor that fill() has given floats of `width`.
  [[nodiscard]] std::span<float> floatsOf(const json& accessor, std::size_t width) {
    const json& view = root_.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
    return {reinterpret_cast<float*>(binary_.data() + view.at("byteOffset").get<std::size_t>()),
            accessor.at("count").get<std::size_t>() * width};
  }

  /// What was told before packing is no more than near to what is unpacked.
  void setBounds(json& accessor, std::size_t width) {
    const std::span<const float> values = floatsOf(accessor, width);
    if (values.empty()) return;
    std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width)), high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % width] = std::min(low[i % width], values[i]);
      high[i % width] = std::max(high[i % width], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }

  /// Packed weights add up to nearly one.
  void makeSharesWhole(json& accessor) {
    if (accessor.at("componentType") != kFloat || accessor.value("type", "") != "VEC4") return;
    const std::span<float> weights = floatsOf(accessor, 4);
    for (std::size_t i = 0; i + 3 < weights.size(); i += 4) {
      const float sum = weights[i] + weights[i + 1] + weights[i + 2] + weights[i + 3];
      for (std::size_t k = 0; sum > 0 && k < 4; ++k) weights[i + k] /= sum;
    }
  }

  json root_;
  std::string_view given_;
  std::string_view file_;
  std::string binary_;
};

}  // namespace

std::string unpackedGlb(std::string_view glb, std::string_view file) {
  // Most files hold neither word; their JSON is not read twice.
  if (glb.find("_meshopt_compression") == std::string_view::npos && glb.find(kDraco) == std::string_view::npos)
    return {};
  const GlbChunks chunks = glbChunks(glb, file);
  json root = looseJson(chunks.json);
  if (!root.is_object() || (!usesMeshopt(root) && !uses(root, kDraco))) return {};
  try {
    return Unpacker(std::move(root), chunks.binary, file).unpack();
  } catch (const json::exception&) {
    throw InputError(std::string(file), "", "holds compressed data that its JSON does not describe");
  }
}

std::string withoutDraco(std::string glb, std::string_view file) {
  if (glb.find(kDraco) == std::string::npos) return glb;
  std::string plain = unpackedGlb(glb, file);
  return plain.empty() ? glb : plain;
}

}  // namespace mouthpiece
