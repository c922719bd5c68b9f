#include "exports/gltf/glb_chunks.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;
constexpr int kArrayBuffer = 34962;

std::uint32_t wordAt(std::string_view bytes, std::size_t at) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + at, 4);
  return word;
}

void appendWord(std::string& bytes, std::size_t word) {
  MOUTHPIECE_EXPECT(word <= std::numeric_limits<std::uint32_t>::max());
  const auto narrow = static_cast<std::uint32_t>(word);
  bytes.append(reinterpret_cast<const char*>(&narrow), 4);
}

}  // namespace

GlbChunks glbChunks(std::string_view glb, const std::string& file) {
  const auto fail = [&](std::string_view what) { throw InputError(file, "", what); };
  if (glb.size() < 20 || !glb.starts_with("glTF") || wordAt(glb, 16) != kJsonChunk)
    fail("found no GLB; expected one with a JSON chunk");
  const std::size_t json_size = wordAt(glb, 12);
  if (json_size > glb.size() - 20) fail("is cut off within its JSON chunk");
  GlbChunks chunks;
  chunks.root = json::parse(glb.substr(20, json_size), nullptr, false);
  if (!chunks.root.is_object()) fail("holds a JSON chunk that is no object");
  const std::size_t next = 20 + json_size;
  if (glb.size() - next >= 8 && wordAt(glb, next + 4) == kBinaryChunk) {
    const std::size_t size = wordAt(glb, next);
    if (size > glb.size() - next - 8) fail("is cut off within its binary chunk");
    chunks.binary = glb.substr(next + 8, size);
  }
  return chunks;
}

bool GlbChunks::hasList(const char* key) const {
  const auto entry = root.find(key);
  return entry != root.end() && entry->is_array() && !entry->empty();
}

std::size_t GlbChunks::addFloats(std::span<const float> values, std::size_t width, bool with_bounds) {
  binary.append((4 - binary.size() % 4) % 4, '\0');
  const std::size_t offset = binary.size();
  binary.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", values.size_bytes()}});
  if (width == 3) root["bufferViews"].back()["target"] = kArrayBuffer;
  root["buffers"][0]["byteLength"] = binary.size();
  json accessor{{"bufferView", root["bufferViews"].size() - 1},
                {"componentType", kFloat},
                {"count", values.size() / width},
                {"type", width == 3 ? "VEC3" : "SCALAR"}};
  if (with_bounds) {
    std::vector<float> low(width, std::numeric_limits<float>::max());
    std::vector<float> high(width, std::numeric_limits<float>::lowest());
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % width] = std::min(low[i % width], values[i]);
      high[i % width] = std::max(high[i % width], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }
  root["accessors"].push_back(std::move(accessor));
  return root["accessors"].size() - 1;
}

std::size_t GlbChunks::addMostlyZeroVec3(std::span<const float> values) {
  std::vector<std::uint32_t> indices;
  std::vector<float> kept;
  for (std::size_t i = 0; i < values.size(); i += 3) {
    if (values[i] == 0 && values[i + 1] == 0 && values[i + 2] == 0) continue;
    indices.push_back(static_cast<std::uint32_t>(i / 3));
    kept.insert(kept.end(), values.begin() + static_cast<std::ptrdiff_t>(i),
                values.begin() + static_cast<std::ptrdiff_t>(i + 3));
  }
  // A sparse accessor must hold something.
  if (indices.empty()) {
    indices.push_back(0);
    kept.assign(3, 0.0F);
  }
  if (4 * kept.size() + 4 * indices.size() >= values.size_bytes()) return addFloats(values, 3, true);
  const std::size_t accessor = addFloats(kept, 3, true);
  json& entry = root["accessors"][accessor];
  const std::size_t values_view = entry["bufferView"].get<std::size_t>();
  const std::size_t offset = binary.size();
  binary.append(reinterpret_cast<const char*>(indices.data()), 4 * indices.size());
  root["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", 4 * indices.size()}});
  root["buffers"][0]["byteLength"] = binary.size();
  if (3 * indices.size() < values.size()) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      entry["min"][axis] = std::min(entry["min"][axis].get<float>(), 0.0F);
      entry["max"][axis] = std::max(entry["max"][axis].get<float>(), 0.0F);
    }
  }
  root["bufferViews"][values_view].erase("target");  // only whole attributes have one
  entry.erase("bufferView");
  entry["count"] = values.size() / 3;
  entry["sparse"] = {{"count", indices.size()},
                     {"indices", {{"bufferView", root["bufferViews"].size() - 1}, {"componentType", kUnsignedInt}}},
                     {"values", {{"bufferView", values_view}}}};
  return accessor;
}

std::string GlbChunks::toBytes() const {
  std::string text = root.dump(-1, ' ', false, json::error_handler_t::replace);
  text.append((4 - text.size() % 4) % 4, ' ');
  const std::size_t padding = (4 - binary.size() % 4) % 4;
  std::string glb = "glTF";
  appendWord(glb, 2);
  appendWord(glb, 28 + text.size() + binary.size() + padding);
  appendWord(glb, text.size());
  appendWord(glb, kJsonChunk);
  glb += text;
  appendWord(glb, binary.size() + padding);
  appendWord(glb, kBinaryChunk);
  glb += binary;
  return glb.append(padding, '\0');
}

}  // namespace mouthpiece
