#include "exports/gltf/glb_buffer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

// glTF 2.0, sections 3.6.2.2 and 5.11.5.
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kNoTarget = 0;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;

template <typename T>
std::string_view bytesOf(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

template <typename T>
std::string_view bytesOf(const std::vector<T>& values) {
  return bytesOf(std::span<const T>(values));
}

void addBounds(json& accessor, std::span<const float> values, std::size_t width, bool has_zeros = false) {
  std::array<float, 3> low;
  std::array<float, 3> high;
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  if (has_zeros) {
    low.fill(0);
    high.fill(0);
  }
  for (std::size_t i = 0; i < values.size(); i += width) {
    for (std::size_t axis = 0; axis < width; ++axis) {
      low[axis] = std::min(low[axis], values[i + axis]);
      high[axis] = std::max(high[axis], values[i + axis]);
    }
  }
  accessor["min"] = std::vector<float>(low.begin(), low.begin() + static_cast<std::ptrdiff_t>(width));
  accessor["max"] = std::vector<float>(high.begin(), high.begin() + static_cast<std::ptrdiff_t>(width));
}

void appendLittleEndian(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift));
}

}  // namespace

std::size_t GlbBuffer::appendAligned(std::string_view bytes) {
  const std::size_t offset = bytes_.size();
  bytes_.append(bytes);
  bytes_.append((4 - bytes_.size() % 4) % 4, '\0');
  return offset;
}

std::size_t GlbBuffer::addView(std::string_view bytes, int target, std::size_t stride) {
  json view{{"buffer", 0}, {"byteOffset", appendAligned(bytes)}, {"byteLength", bytes.size()}};
  if (target != kNoTarget) view["target"] = target;
  if (stride != 0) view["byteStride"] = stride;
  views_.push_back(std::move(view));
  return views_.size() - 1;
}

std::size_t GlbBuffer::addAccessor(json accessor) {
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

std::size_t GlbBuffer::addVec3(std::span<const float> values, bool with_bounds) {
  json accessor{{"bufferView", addView(bytesOf(values), kArrayBuffer, 12)},
                {"componentType", kFloat},
                {"count", values.size() / 3},
                {"type", "VEC3"}};
  if (with_bounds) addBounds(accessor, values, 3);
  return addAccessor(std::move(accessor));
}

std::size_t GlbBuffer::addVec2(std::span<const float> values) {
  return addAccessor({{"bufferView", addView(bytesOf(values), kArrayBuffer, 8)},
                      {"componentType", kFloat},
                      {"count", values.size() / 2},
                      {"type", "VEC2"}});
}

std::size_t GlbBuffer::addColors(std::span<const std::uint16_t> rgba) {
  return addAccessor({{"bufferView", addView(bytesOf(rgba), kArrayBuffer, 8)},
                      {"componentType", kUnsignedShort},
                      {"normalized", true},
                      {"count", rgba.size() / 4},
                      {"type", "VEC4"}});
}

std::size_t GlbBuffer::addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
  // 65535 itself is the primitive restart value and must not be used.
  const bool is_short = vertex_count <= std::numeric_limits<std::uint16_t>::max();
  const std::vector<std::uint16_t> narrow =
      is_short ? std::vector<std::uint16_t>(indices.begin(), indices.end()) : std::vector<std::uint16_t>();
  const std::string_view bytes = is_short ? bytesOf(narrow) : bytesOf(indices);
  return addAccessor({{"bufferView", addView(bytes, kElementArrayBuffer, 0)},
                      {"componentType", is_short ? kUnsignedShort : kUnsignedInt},
                      {"count", indices.size()},
                      {"type", "SCALAR"}});
}

std::size_t GlbBuffer::addScalars(std::span<const float> values, bool with_bounds) {
  json accessor{{"bufferView", addView(bytesOf(values), kNoTarget, 0)},
                {"componentType", kFloat},
                {"count", values.size()},
                {"type", "SCALAR"}};
  if (with_bounds) addBounds(accessor, values, 1);
  return addAccessor(std::move(accessor));
}

std::size_t GlbBuffer::addZeroVec3(std::size_t count) {
  const auto [known, is_new] = zeros_by_count_.try_emplace(count, accessors_.size());
  if (is_new) {
    const std::vector<float> zero(3, 0.0F);
    addAccessor({{"componentType", kFloat}, {"count", count}, {"type", "VEC3"}, {"min", zero}, {"max", zero}});
  }
  return known->second;
}

std::size_t GlbBuffer::addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values,
                                         std::size_t count, bool with_bounds) {
  MOUTHPIECE_EXPECT(values.size() == 3 * indices.size() && indices.size() <= count);
  if (indices.empty()) return addZeroVec3(count);
  const bool is_short = count <= std::numeric_limits<std::uint16_t>::max();
  if (values.size_bytes() + indices.size() * (is_short ? 2 : 4) >= 3 * count * sizeof(float)) {
    std::vector<float> all(3 * count, 0.0F);
    for (std::size_t i = 0; i < indices.size(); ++i)
      std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, all.begin() + 3 * indices[i]);
    return addVec3(all, with_bounds);
  }
  json accessor{{"componentType", kFloat}, {"count", count}, {"type", "VEC3"}};
  if (with_bounds) addBounds(accessor, values, 3, indices.size() < count);
  const std::vector<std::uint16_t> narrow =
      is_short ? std::vector<std::uint16_t>(indices.begin(), indices.end()) : std::vector<std::uint16_t>();
  const std::size_t index_view = addView(is_short ? bytesOf(narrow) : bytesOf(indices), kNoTarget, 0);
  accessor["sparse"] = {
      {"count", indices.size()},
      {"indices", {{"bufferView", index_view}, {"componentType", is_short ? kUnsignedShort : kUnsignedInt}}},
      {"values", {{"bufferView", addView(bytesOf(values), kNoTarget, 0)}}}};
  return addAccessor(std::move(accessor));
}

std::string GlbBuffer::toGlb(json root) && {
  const std::size_t data_bytes = bytes_.size();
  root["accessors"] = std::move(accessors_);
  root["bufferViews"] = std::move(views_);
  root["buffers"] = json::array({{{"byteLength", data_bytes}}});
  std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
  text.append((4 - text.size() % 4) % 4, ' ');

  constexpr std::size_t kHeaderBytes = 12 + 8 + 8;
  const std::size_t total = kHeaderBytes + text.size() + data_bytes;
  MOUTHPIECE_EXPECT(total <= std::numeric_limits<std::uint32_t>::max());
  std::string head;
  head.reserve(total - data_bytes);
  head.append("glTF");
  appendLittleEndian(head, 2);
  appendLittleEndian(head, static_cast<std::uint32_t>(total));
  appendLittleEndian(head, static_cast<std::uint32_t>(text.size()));
  head.append("JSON");
  head.append(text);
  appendLittleEndian(head, static_cast<std::uint32_t>(data_bytes));
  head.append("BIN\0", 4);
  bytes_.insert(0, head);  // in place where there is room: of a long line a copy would be the largest of all
  return std::move(bytes_);
}

}  // namespace mouthpiece
