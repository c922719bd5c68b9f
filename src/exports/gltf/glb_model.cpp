#include "exports/gltf/glb_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "base/json_text.h"
#include "deform/mesh/glb_chunks.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

using namespace gltf;  // NOLINT(google-build-using-namespace): numbers alone
constexpr std::array<const char*, 5> kTypeNames{"", "SCALAR", "VEC2", "VEC3", "VEC4"};

std::size_t widthOf(GlbType type) { return static_cast<std::size_t>(type); }

template <typename T>
std::string_view bytesOf(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// `indices` in 16 bits where 65535, the primitive restart value, cannot be among them; else as they are.
struct Indices {
  Indices(std::span<const std::uint32_t> indices, std::size_t vertex_count) : wide(indices) {
    is_narrow = vertex_count <= std::numeric_limits<std::uint16_t>::max();
    if (is_narrow) narrow.assign(indices.begin(), indices.end());
  }
  [[nodiscard]] std::string_view bytes() const {
    return is_narrow ? bytesOf(std::span<const std::uint16_t>(narrow)) : bytesOf(wide);
  }
  [[nodiscard]] int component() const { return is_narrow ? kUnsignedShort : kUnsignedInt; }

  std::span<const std::uint32_t> wide;
  std::vector<std::uint16_t> narrow;
  bool is_narrow = false;
};

/// "speech_00" and so on: what glbWithShapes() calls its targets.
bool isSpeechName(const json& name) {
  if (!name.is_string()) return false;
  const std::string& text = name.get_ref<const std::string&>();
  return text.size() > 7 && text.starts_with("speech_") &&
         std::all_of(text.begin() + 7, text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Every whole number in an extension may be the number of an accessor or view.
void numbersIn(const json& value, std::set<std::size_t>& numbers) {
  if (value.is_number_unsigned()) numbers.insert(value.get<std::size_t>());
  if (value.is_structured()) {
    for (const json& entry : value) numbersIn(entry, numbers);
  }
}
void numbersInExtensions(const json& value, std::set<std::size_t>& numbers) {
  if (value.is_object()) {
    for (const auto& [key, entry] : value.items()) {
      if (key == "extensions")
        numbersIn(entry, numbers);
      else if (key != "extras")
        numbersInExtensions(entry, numbers);
    }
  } else if (value.is_array()) {
    for (const json& entry : value) numbersInExtensions(entry, numbers);
  }
}

void collect(const json& number, std::set<std::size_t>& numbers) {
  if (number.is_number_unsigned()) numbers.insert(number.get<std::size_t>());
}

std::set<std::size_t> usedAccessors(const json& root) {
  std::set<std::size_t> used;
  numbersInExtensions(root, used);
  for (const json& mesh : root.value("meshes", json::array())) {
    for (const json& primitive : mesh.value("primitives", json::array())) {
      for (const json& attribute : primitive.value("attributes", json::object())) collect(attribute, used);
      collect(primitive.value("indices", json()), used);
      for (const json& target : primitive.value("targets", json::array())) {
        for (const json& attribute : target) collect(attribute, used);
      }
    }
  }
  for (const json& skin : root.value("skins", json::array())) collect(skin.value("inverseBindMatrices", json()), used);
  for (const json& animation : root.value("animations", json::array())) {
    for (const json& sampler : animation.value("samplers", json::array())) {
      collect(sampler.value("input", json()), used);
      collect(sampler.value("output", json()), used);
    }
  }
  return used;
}

std::set<std::size_t> viewsOf(const json& accessor) {
  std::set<std::size_t> views;
  collect(accessor.value("bufferView", json()), views);
  if (const auto sparse = accessor.find("sparse"); sparse != accessor.end()) {
    for (const char* part : {"indices", "values"}) collect(sparse->at(part).value("bufferView", json()), views);
  }
  return views;
}

std::set<std::size_t> usedViews(const json& root, const std::set<std::size_t>& without_accessors) {
  std::set<std::size_t> used;
  numbersInExtensions(root, used);
  const json& accessors = root.at("accessors");
  for (std::size_t i = 0; i < accessors.size(); ++i) {
    if (!without_accessors.contains(i)) used.merge(viewsOf(accessors[i]));
  }
  for (const json& image : root.value("images", json::array())) collect(image.value("bufferView", json()), used);
  return used;
}

/// The list `key` of `root`, made where it is missing.
json& listOf(json& root, const char* key) {
  json& list = root[key];
  if (!list.is_array()) list = json::array();
  return list;
}

/// The same to look through: none where it is missing.
std::span<json> entriesOf(json& root, const char* key) {
  const auto list = root.find(key);
  if (list == root.end() || !list->is_array()) return {};
  return list->get_ref<json::array_t&>();
}

/// Puts `entry` at a number that is free, or at the list's end.
std::size_t put(json& list, std::vector<std::size_t>& free, json entry) {
  if (free.empty()) {
    list.push_back(std::move(entry));
    return list.size() - 1;
  }
  const std::size_t number = free.back();
  free.pop_back();
  list.at(number) = std::move(entry);
  return number;
}

}  // namespace

GlbModel::GlbModel(std::string_view glb, const std::string& file) {
  const GlbChunks chunks = glbChunks(glb, file);
  root = looseJson(chunks.json);
  if (!root.is_object()) throw InputError(file, "", "is no GLB that can be read: its JSON is damaged");
  const auto buffers = root.find("buffers");
  const bool is_own = buffers != root.end() && buffers->is_array() && !buffers->empty() && buffers->at(0).is_object() &&
                      !buffers->at(0).contains("uri");
  if (is_own) binary_ = chunks.binary;
}

std::size_t GlbModel::addView(std::string_view bytes, int target, std::size_t stride) {
  binary_.append((4 - binary_.size() % 4) % 4, '\0');
  json view{{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
  if (stride != 0) view["byteStride"] = stride;
  if (target != kNoTarget) view["target"] = target;
  binary_.append(bytes);
  return put(listOf(root, "bufferViews"), free_views_, std::move(view));
}

std::size_t GlbModel::addAccessor(int component, GlbType type, std::size_t count) {
  return put(listOf(root, "accessors"), free_accessors_,
             {{"componentType", component}, {"count", count}, {"type", kTypeNames[widthOf(type)]}});
}

void GlbModel::setBounds(std::size_t accessor, std::span<const float> values, bool has_zeros) {
  json& bounded = root["accessors"][accessor];
  const std::string type = bounded["type"];
  const std::size_t width = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : 3;
  std::array<float, 3> low, high;
  low.fill(has_zeros ? 0 : std::numeric_limits<float>::max());
  high.fill(has_zeros ? 0 : std::numeric_limits<float>::lowest());
  for (std::size_t i = 0; i < values.size(); i += width) {
    for (std::size_t axis = 0; axis < width; ++axis) {
      low[axis] = std::min(low[axis], values[i + axis]);
      high[axis] = std::max(high[axis], values[i + axis]);
    }
  }
  bounded["min"] = std::vector<double>(low.begin(), low.begin() + signedIndex(width));
  bounded["max"] = std::vector<double>(high.begin(), high.begin() + signedIndex(width));
}

std::size_t GlbModel::addAttribute(std::span<const float> values, GlbType type, GlbUse use) {
  if (is_packed_) return addPackedAttribute(values, type, use);
  const std::size_t view = addView(bytesOf(values), kArrayBuffer, widthOf(type) * sizeof(float));
  const std::size_t accessor = addAccessor(kFloat, type, values.size() / widthOf(type));
  root["accessors"][accessor]["bufferView"] = view;
  if (use == GlbUse::kPlace || use == GlbUse::kMove) setBounds(accessor, values, false);
  return accessor;
}

std::size_t GlbModel::addColors(std::span<const std::uint16_t> rgba) {
  if (is_packed_) return addPackedColors(rgba);
  const std::size_t view = addView(bytesOf(rgba), kArrayBuffer, 8);
  const std::size_t accessor = addAccessor(kUnsignedShort, GlbType::kVec4, rgba.size() / 4);
  root["accessors"][accessor]["bufferView"] = view;
  root["accessors"][accessor]["normalized"] = true;
  return accessor;
}

std::size_t GlbModel::addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
  if (is_packed_) return addPackedIndices(indices, vertex_count);
  const Indices stored(indices, vertex_count);
  const std::size_t view = addView(stored.bytes(), kElementArrayBuffer);
  const std::size_t accessor = addAccessor(stored.component(), GlbType::kScalar, indices.size());
  root["accessors"][accessor]["bufferView"] = view;
  return accessor;
}

std::size_t GlbModel::addScalars(std::span<const float> values, bool with_bounds) {
  const std::size_t view = addView(bytesOf(values), kNoTarget);
  const std::size_t accessor = addAccessor(kFloat, GlbType::kScalar, values.size());
  root["accessors"][accessor]["bufferView"] = view;
  if (with_bounds) setBounds(accessor, values, false);
  return accessor;
}

std::size_t GlbModel::addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values,
                                        std::size_t count, GlbUse use) {
  MOUTHPIECE_EXPECT(values.size() == 3 * indices.size() && indices.size() <= count);
  if (indices.empty()) {
    const auto known = zeros_by_count_.find(count);
    if (known != zeros_by_count_.end()) return known->second;
    const std::size_t accessor = addAccessor(kFloat, GlbType::kVec3, count);
    setBounds(accessor, {}, true);
    // Nothing at all would do by the specification, and Assimp 5.2 refuses the file: the first is told to be zero.
    if (!zero_) {
      const std::array<float, 3> zero{};
      const std::size_t first = addView(std::string_view("\0\0", 2), kNoTarget);
      zero_ = {{"count", 1},
               {"indices", {{"bufferView", first}, {"componentType", kUnsignedShort}}},
               {"values", {{"bufferView", addView(bytesOf(std::span<const float>(zero)), kNoTarget)}}}};
    }
    root["accessors"][accessor]["sparse"] = *zero_;
    return zeros_by_count_[count] = accessor;
  }
  if (is_packed_) return addPackedTarget(indices, values, count, use);
  const Indices stored(indices, count);
  if (values.size_bytes() + stored.bytes().size() >= 3 * count * sizeof(float)) {
    std::vector<float> all(3 * count, 0.0F);
    for (std::size_t i = 0; i < indices.size(); ++i) std::copy_n(&values[3 * i], 3, &all[3 * std::size_t{indices[i]}]);
    return addAttribute(all, GlbType::kVec3, use);
  }
  const std::size_t accessor = addAccessor(kFloat, GlbType::kVec3, count);
  if (use == GlbUse::kMove) setBounds(accessor, values, indices.size() < count);
  const std::size_t index_view = addView(stored.bytes(), kNoTarget), value_view = addView(bytesOf(values), kNoTarget);
  root["accessors"][accessor]["sparse"] = {
      {"count", indices.size()},
      {"indices", {{"bufferView", index_view}, {"componentType", stored.component()}}},
      {"values", {{"bufferView", value_view}}}};
  return accessor;
}

void GlbModel::addSpeech(std::size_t frame_count, double frame_rate_hz, const std::vector<SpeechTrack>& tracks) {
  std::vector<float> times(frame_count);
  for (std::size_t f = 0; f < frame_count; ++f) times[f] = asFloat(asReal(f) / frame_rate_hz);
  const std::size_t input = addScalars(times, true);
  json speech{{"name", "speech"}, {"samplers", json::array()}, {"channels", json::array()}};
  for (const SpeechTrack& track : tracks) {
    const std::size_t output = is_packed_ ? addPackedWeights(track.weights, track.weights.size() / frame_count)
                                          : addScalars(track.weights, false);
    speech["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
    for (const std::size_t node : track.nodes) {
      speech["channels"].push_back(
          {{"sampler", speech["samplers"].size() - 1}, {"target", {{"node", node}, {"path", "weights"}}}});
    }
  }
  listOf(root, "animations").push_back(std::move(speech));
}

std::map<std::size_t, std::size_t> GlbModel::removeSpeech() {
  std::map<std::size_t, std::size_t> removed;
  std::set<std::size_t> orphans;
  if (const auto animations = root.find("animations"); animations != root.end() && animations->is_array()) {
    for (auto animation = animations->begin(); animation != animations->end();) {
      if (animation->value("name", "") != "speech") {
        ++animation;
        continue;
      }
      for (const json& sampler : animation->at("samplers")) {
        for (const char* end : {"input", "output"}) collect(sampler.at(end), orphans);
      }
      animation = animations->erase(animation);
    }
    if (animations->empty()) root.erase(animations);
  }
  for (json& mesh : entriesOf(root, "meshes")) {
    const auto number = unsignedIndex(&mesh - entriesOf(root, "meshes").data());
    const auto extras = mesh.find("extras");
    if (extras == mesh.end() || !extras->is_object() || !extras->contains("targetNames")) continue;
    json& names = (*extras)["targetNames"];
    std::size_t kept = names.size();
    while (kept > 0 && isSpeechName(names[kept - 1])) --kept;
    if (kept == names.size()) continue;
    const auto cut = [kept](json& owner, const char* key) {
      const auto list = owner.find(key);
      if (list == owner.end() || !list->is_array() || list->size() <= kept) return;
      list->erase(list->begin() + signedIndex(kept), list->end());
      if (list->empty()) owner.erase(list);
    };
    for (json& primitive : mesh.at("primitives")) {
      const auto targets = primitive.find("targets");
      for (std::size_t k = kept; targets != primitive.end() && k < targets->size(); ++k) {
        for (const json& attribute : (*targets)[k]) collect(attribute, orphans);
      }
      cut(primitive, "targets");
    }
    removed[number] = names.size() - kept;
    cut(mesh, "weights");
    for (json& node : entriesOf(root, "nodes")) {
      if (node.value("mesh", json()) == json(number)) cut(node, "weights");
    }
    cut(*extras, "targetNames");
    if (extras->empty()) mesh.erase(extras);
  }
  free(orphans);
  return removed;
}

/// What nothing else uses: accessors, and the views of these.
void GlbModel::free(const std::set<std::size_t>& accessors) {
  const std::set<std::size_t> in_use = usedAccessors(root);
  std::set<std::size_t> freed(free_accessors_.begin(), free_accessors_.end());
  for (const std::size_t accessor : accessors) {
    if (!in_use.contains(accessor) && accessor < listOf(root, "accessors").size()) freed.insert(accessor);
  }
  if (freed.empty()) return;
  const std::set<std::size_t> used = usedViews(root, freed);
  std::set<std::size_t> views(free_views_.begin(), free_views_.end());
  for (const std::size_t accessor : freed) {
    for (const std::size_t view : viewsOf(root["accessors"][accessor])) {
      if (!used.contains(view) && view < root["bufferViews"].size()) views.insert(view);
    }
  }
  // The last ones go; what stands between others is used again for new data, from the front.
  const auto drop = [](json& list, std::vector<std::size_t> free) {
    std::sort(free.begin(), free.end());
    while (!free.empty() && free.back() + 1 == list.size()) {
      list.erase(list.size() - 1);
      free.pop_back();
    }
    std::reverse(free.begin(), free.end());
    return free;
  };
  free_accessors_ = drop(root["accessors"], {freed.begin(), freed.end()});
  free_views_ = drop(root["bufferViews"], {views.begin(), views.end()});
  for (const std::size_t accessor : free_accessors_)
    root["accessors"][accessor] = {{"componentType", kFloat}, {"count", 1}, {"type", "SCALAR"}};
  for (const std::size_t view : free_views_) root["bufferViews"][view] = {{"buffer", 0}, {"byteLength", 4}};
  has_holes_ = true;
}

void GlbModel::widenWeights(const KeyReader& keysOf, const std::map<std::size_t, Widening>& nodes) {
  std::set<std::size_t> orphans;
  for (json& animation : entriesOf(root, "animations")) {
    for (json& channel : animation.at("channels")) {
      const json& target = channel.at("target");
      if (target.value("path", "") != "weights" || !target.contains("node")) continue;
      const auto widened = nodes.find(target["node"].get<std::size_t>());
      if (widened == nodes.end()) continue;
      json sampler = animation.at("samplers").at(channel.at("sampler").get<std::size_t>());
      const std::size_t output = sampler.at("output").get<std::size_t>();
      const std::vector<float> keys = keysOf(output);
      std::vector<float> wide;
      const std::size_t own = widened->second.targets, stride = own + widened->second.removed;
      for (std::size_t first = 0; stride > 0 && first + stride <= keys.size(); first += stride) {
        wide.insert(wide.end(), keys.begin() + signedIndex(first), keys.begin() + signedIndex(first + own));
        wide.insert(wide.end(), widened->second.added, 0.0F);
      }
      orphans.insert(output);
      sampler["output"] = addScalars(wide, false);
      // A sampler that only this channel follows is changed, one that others share is not.
      const json number = channel["sampler"];
      const auto& channels = animation["channels"];
      if (std::count_if(channels.begin(), channels.end(),
                        [&](const json& other) { return other.value("sampler", json()) == number; }) == 1) {
        animation["samplers"][number.get<std::size_t>()] = std::move(sampler);
      } else {
        channel["sampler"] = animation["samplers"].size();
        animation["samplers"].push_back(std::move(sampler));
      }
    }
  }
  free(orphans);
}

/// Moves what views show together, each on a multiple of four bytes; where an extension shows data of its own, nothing
/// is moved.
void GlbModel::compact() {
  struct Range {
    std::size_t begin, end, now = 0;
  };
  std::vector<json*> places;  // objects with buffer, byteOffset, byteLength
  for (json& view : entriesOf(root, "bufferViews")) {
    if (view.value("buffer", 0) == 0) places.push_back(&view);
    const auto extensions = view.find("extensions");
    if (extensions == view.end()) continue;
    for (auto& [name, extension] : extensions->items()) {
      if (name != "EXT_meshopt_compression" && name != "KHR_meshopt_compression") return;
      if (extension.value("buffer", 0) == 0) places.push_back(&extension);
    }
  }
  const auto rangeOf = [](const json& place) {
    const std::size_t begin = place.value("byteOffset", std::size_t{0});
    return Range{begin, begin + place.at("byteLength").get<std::size_t>()};
  };
  std::vector<Range> ranges;
  for (const json* place : places) ranges.push_back(rangeOf(*place));
  std::sort(ranges.begin(), ranges.end(), [](const Range& a, const Range& b) { return a.begin < b.begin; });
  std::vector<Range> merged;
  for (const Range& range : ranges) {
    if (range.end > binary_.size()) return;
    if (merged.empty() || range.begin > merged.back().end) merged.push_back(range);
    merged.back().end = std::max(merged.back().end, range.end);
  }
  std::string moved;
  for (Range& range : merged) {
    // The same place within eight bytes: whatever was aligned stays so.
    moved.append((8 + range.begin % 8 - moved.size() % 8) % 8, '\0');
    range.now = moved.size();
    moved.append(binary_, range.begin, range.end - range.begin);
  }
  for (json* place : places) {
    const std::size_t begin = rangeOf(*place).begin;
    const auto range = std::upper_bound(merged.begin(), merged.end(), begin,
                                        [](std::size_t at, const Range& r) { return at < r.begin; }) -
                       1;
    (*place)["byteOffset"] = range->now + begin - range->begin;
  }
  binary_ = std::move(moved);
}

std::string GlbModel::toBytes() && {
  closeSharedViews();
  if (has_holes_) compact();
  binary_.append((4 - binary_.size() % 4) % 4, '\0');
  if (!binary_.empty()) {
    json& buffers = listOf(root, "buffers");
    if (buffers.empty()) buffers.push_back(json::object());
    buffers[0]["byteLength"] = binary_.size();
    if (unpacked_bytes_ > 0) {
      constexpr const char* kMeshopt = "EXT_meshopt_compression";
      buffers.push_back({{"byteLength", unpacked_bytes_}, {"extensions", {{kMeshopt, {{"fallback", true}}}}}});
      root["extensionsUsed"] = root["extensionsRequired"] = {kMeshopt, "KHR_mesh_quantization"};
    }
  }
  return glbOf(jsonText(root), std::move(binary_));
}

}  // namespace mouthpiece
