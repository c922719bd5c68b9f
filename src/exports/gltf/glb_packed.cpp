// What a packed GLB holds: whole numbers (KHR_mesh_quantization), packed by meshoptimizer (EXT_meshopt_compression).
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "base/index.h"
#include "exports/gltf/glb_model.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

/// Places are multiples of this power of two, in metres: 15 micrometres. Texture coordinates, of this.
constexpr int kPlaceExponent = -16, kTextureExponent = -15;
constexpr double kMostShort = 32'767, kMostByte = 127;
/// A turn of a normal is told in steps of two: half a degree is not seen, and what is even packs better.
constexpr double kTurnStep = 2;
/// meshoptimizer's largest row of a vertex buffer, bytes.
constexpr std::size_t kLongestRow = 256;
/// A view that several accessors share is packed when it is this long, so that what waits takes little room.
constexpr std::size_t kLongestView = 1 << 21;
/// Rows of whole vec3 in 8 and 16 bits, each filled up to four.
constexpr std::size_t kNarrowRow = 4, kWideRow = 8;

std::string packedVertices(const void* rows, std::size_t count, std::size_t stride) {
  // Not a string that is shortened: the bound is ten times what is needed, and a string would write to all of it.
  const std::size_t most = meshopt_encodeVertexBufferBound(count, stride);
  const std::unique_ptr<unsigned char[]> packed(new unsigned char[most]);
  const std::size_t size = meshopt_encodeVertexBuffer(packed.get(), most, rows, count, stride);
  return {reinterpret_cast<const char*>(packed.get()), size};
}

/// `count` rows of four, zero but for those of `values` (three each) at `indices`; without indices all in turn.
template <typename Number>
void appendRows(std::span<const std::int32_t> values, std::span<const std::uint32_t> indices, std::size_t count,
                std::string& bytes) {
  const std::size_t before = bytes.size();
  bytes.resize(before + count * 4 * sizeof(Number), '\0');
  for (std::size_t i = 0; 3 * i < values.size(); ++i) {
    const std::array<Number, 4> row{static_cast<Number>(values[3 * i]), static_cast<Number>(values[3 * i + 1]),
                                    static_cast<Number>(values[3 * i + 2]), 0};
    const std::size_t place = indices.empty() ? i : std::size_t{indices[i]};
    std::memcpy(bytes.data() + before + place * sizeof row, row.data(), sizeof row);
  }
}

std::int32_t whole(double value, double most) {
  return static_cast<std::int32_t>(std::lround(std::clamp(value, -most, most)));
}

/// The same of a number of at most 50 bits, to which a half can be added without rounding.
std::int32_t wholeOfShort(double value, double most) {
  const double within = std::clamp(value, -most, most);
  return static_cast<std::int32_t>(within + std::copysign(0.5, within));
}

/// The extension's exponential filter with one exponent for all: whole multiples of a power of two, 24 bits each, which
/// come back as floats.
std::vector<std::uint32_t> exponentialFilter(std::span<const float> values, int exponent) {
  constexpr double kMost = (1 << 23) - 1;
  std::vector<std::uint32_t> filtered;
  filtered.reserve(values.size());
  const std::uint32_t high = static_cast<std::uint32_t>(exponent & 0xFF) << 24U;
  for (const float value : values)
    filtered.push_back(
        high |
        (static_cast<std::uint32_t>(whole(std::ldexp(static_cast<double>(value), -exponent), kMost)) & 0x00FFFFFFU));
  return filtered;
}

}  // namespace

void GlbModel::pack(const std::array<double, 3>& lowest, const std::array<double, 3>& highest) {
  is_packed_ = true;
  double reach = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    place_origin_[axis] = (lowest[axis] + highest[axis]) / 2;
    reach = std::max(reach, (highest[axis] - lowest[axis]) / 2);
  }
  place_unit_ = std::ldexp(1.0, kPlaceExponent);
  while (reach > kMostShort * place_unit_) place_unit_ *= 2;  // a head of over a metre
}

std::size_t GlbModel::addPackedView(std::string_view packed, std::size_t count, std::size_t stride, const char* mode,
                                    const char* filter, int target) {
  binary_.append((4 - binary_.size() % 4) % 4, '\0');
  unpacked_bytes_ += (4 - unpacked_bytes_ % 4) % 4;
  json how{{"buffer", 0},
           {"byteOffset", binary_.size()},
           {"byteLength", packed.size()},
           {"byteStride", stride},
           {"count", count},
           {"mode", mode}};
  if (filter != nullptr) how["filter"] = filter;
  json view{{"buffer", 1},
            {"byteOffset", unpacked_bytes_},
            {"byteLength", count * stride},
            {"extensions", {{"EXT_meshopt_compression", std::move(how)}}}};
  if (target == gltf::kArrayBuffer) view["byteStride"] = stride;
  if (target != gltf::kNoTarget) view["target"] = target;
  binary_.append(packed);
  unpacked_bytes_ += count * stride;
  json& views = root["bufferViews"];
  // A null that shall become a list is left half made, and cannot be destroyed, where memory is short
  // (nlohmann 3.11.2).
  if (views.is_null()) views = json::array();
  views.push_back(std::move(view));
  return views.size() - 1;
}

std::size_t GlbModel::addWholeVec3(std::span<const std::int32_t> values, std::span<const std::uint32_t> indices,
                                   std::size_t count, bool is_normalised) {
  const bool has_zeros = values.size() < 3 * count;
  constexpr std::int32_t kFarthest = std::numeric_limits<std::int32_t>::max();
  std::array<std::int32_t, 3> low, high;
  low.fill(has_zeros ? 0 : kFarthest);
  high.fill(has_zeros ? 0 : -kFarthest);
  for (std::size_t i = 0; i < values.size(); i += 3) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], values[i + axis]);
      high[axis] = std::max(high[axis], values[i + axis]);
    }
  }
  const bool is_narrow = *std::min_element(low.begin(), low.end()) >= -static_cast<std::int32_t>(kMostByte) &&
                         *std::max_element(high.begin(), high.end()) <= static_cast<std::int32_t>(kMostByte);
  const std::size_t stride = is_narrow ? kNarrowRow : kWideRow;
  SharedView& shared = shared_views_[stride];
  if (shared.bytes.size() >= kLongestView) closeSharedView(stride, shared);
  const std::size_t accessor = addAccessor(is_narrow ? gltf::kByte : gltf::kShort, GlbType::kVec3, count);
  json& added = root["accessors"][accessor];
  added["byteOffset"] = shared.bytes.size();
  if (is_normalised) {
    added["normalized"] = true;
  } else {
    added["min"] = low;
    added["max"] = high;
  }
  is_narrow ? appendRows<std::int8_t>(values, indices, count, shared.bytes)
            : appendRows<std::int16_t>(values, indices, count, shared.bytes);
  shared.accessors.push_back(accessor);
  return accessor;
}

std::size_t GlbModel::addPackedTarget(std::span<const std::uint32_t> indices, std::span<const float> values,
                                      std::size_t count, GlbUse use) {
  std::vector<std::int32_t> numbers(values.size());
  if (use == GlbUse::kMove) {
    const double units_a_metre = 1 / place_unit_;  // exact: a power of two
    for (std::size_t i = 0; i < values.size(); ++i)
      numbers[i] = wholeOfShort(static_cast<double>(values[i]) * units_a_metre, kMostShort);
    return addWholeVec3(numbers, indices, count, false);
  }
  const bool is_in_range = std::all_of(values.begin(), values.end(), [](float v) { return std::abs(v) <= 1; });
  if (use == GlbUse::kTurn && is_in_range) {
    for (std::size_t i = 0; i < values.size(); ++i)
      numbers[i] = static_cast<std::int32_t>(kTurnStep) *
                   wholeOfShort(kMostByte / kTurnStep * static_cast<double>(values[i]), kMostByte / kTurnStep - 0.5);
    return addWholeVec3(numbers, indices, count, true);
  }
  std::vector<float> all(3 * count, 0.0F);
  for (std::size_t i = 0; i < indices.size(); ++i) std::copy_n(&values[3 * i], 3, &all[3 * std::size_t{indices[i]}]);
  return addPackedAttribute(all, GlbType::kVec3, use);
}

std::size_t GlbModel::addPackedAttribute(std::span<const float> values, GlbType type, GlbUse use) {
  const bool is_in_range = std::all_of(values.begin(), values.end(), [](float v) { return std::abs(v) <= 1; });
  if (use == GlbUse::kPlace || (use == GlbUse::kNormal && is_in_range)) {
    std::vector<std::int32_t> numbers(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double value = static_cast<double>(values[i]);
      numbers[i] = use == GlbUse::kPlace ? whole((value - place_origin_[i % 3]) / place_unit_, kMostShort)
                                         : whole(kMostByte * value, kMostByte);
    }
    return addWholeVec3(numbers, {}, values.size() / 3, use == GlbUse::kNormal);
  }
  const std::size_t width = static_cast<std::size_t>(type), count = values.size() / width;
  const int exponent = use == GlbUse::kOther ? kTextureExponent : -6;
  const std::string packed = packedVertices(exponentialFilter(values, exponent).data(), count, 4 * width);
  const std::size_t view = addPackedView(packed, count, 4 * width, "ATTRIBUTES", "EXPONENTIAL", gltf::kArrayBuffer);
  const std::size_t accessor = addAccessor(gltf::kFloat, type, count);
  root["accessors"][accessor]["bufferView"] = view;
  return accessor;
}

std::size_t GlbModel::addPackedColors(std::span<const std::uint16_t> rgba) {
  // Twelve bits of a linear colour are finer than eight of a screen's.
  std::vector<std::uint16_t> rounded(rgba.begin(), rgba.end());
  for (std::uint16_t& channel : rounded) channel = static_cast<std::uint16_t>((channel & 0xFFF0U) | (channel >> 12U));
  const std::size_t count = rgba.size() / 4;
  const std::size_t view =
      addPackedView(packedVertices(rounded.data(), count, 8), count, 8, "ATTRIBUTES", nullptr, gltf::kArrayBuffer);
  const std::size_t accessor = addAccessor(gltf::kUnsignedShort, GlbType::kVec4, count);
  root["accessors"][accessor]["bufferView"] = view;
  root["accessors"][accessor]["normalized"] = true;
  return accessor;
}

std::size_t GlbModel::addPackedIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
  const bool is_narrow = vertex_count <= std::numeric_limits<std::uint16_t>::max();
  std::string packed(meshopt_encodeIndexBufferBound(indices.size(), vertex_count), '\0');
  packed.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(packed.data()), packed.size(),
                                          indices.data(), indices.size()));
  const std::size_t view =
      addPackedView(packed, indices.size(), is_narrow ? 2 : 4, "TRIANGLES", nullptr, gltf::kElementArrayBuffer);
  const std::size_t accessor =
      addAccessor(is_narrow ? gltf::kUnsignedShort : gltf::kUnsignedInt, GlbType::kScalar, indices.size());
  root["accessors"][accessor]["bufferView"] = view;
  return accessor;
}

std::size_t GlbModel::addPackedWeights(std::span<const float> values, std::size_t a_frame) {
  // A row is a frame, so that what packs is what changes; where no row of fours will do, two frames, or two weights.
  std::size_t row = a_frame % 2 == 0 ? a_frame : 2 * a_frame;
  if (2 * row > kLongestRow) row = 2;
  std::vector<std::uint16_t> numbers;
  for (const float value : values)
    numbers.push_back(static_cast<std::uint16_t>(whole(65'535 * static_cast<double>(value), 65'535)));
  const std::size_t accessor = addAccessor(gltf::kUnsignedShort, GlbType::kScalar, numbers.size());
  numbers.resize((numbers.size() + row - 1) / row * row, 0);
  const std::size_t count = numbers.size() / row;
  root["accessors"][accessor]["bufferView"] = addPackedView(packedVertices(numbers.data(), count, 2 * row), count,
                                                            2 * row, "ATTRIBUTES", nullptr, gltf::kNoTarget);
  root["accessors"][accessor]["normalized"] = true;
  return accessor;
}

void GlbModel::closeSharedView(std::size_t stride, SharedView& shared) {
  if (shared.accessors.empty()) return;
  const std::size_t count = shared.bytes.size() / stride;
  const std::size_t view = addPackedView(packedVertices(shared.bytes.data(), count, stride), count, stride,
                                         "ATTRIBUTES", nullptr, gltf::kArrayBuffer);
  for (const std::size_t accessor : shared.accessors) root["accessors"][accessor]["bufferView"] = view;
  shared.bytes.clear();
  shared.accessors.clear();
}

void GlbModel::closeSharedViews() {
  for (auto& [stride, shared] : shared_views_) closeSharedView(stride, shared);
  shared_views_.clear();
}

}  // namespace mouthpiece
