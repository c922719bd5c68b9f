#include "exports/gltf/glb_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <sstream>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr int kNoTarget = 0;

/// glTF's lists are numbered by int.
int numberOfLast(const auto& list) { return static_cast<int>(list.size()) - 1; }

/// Floats of one element: 1, 2, 3.
std::size_t widthOf(int type) {
  return type == TINYGLTF_TYPE_SCALAR ? 1 : unsignedIndex(type);  // VEC2 is 2, VEC3 is 3
}

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
  [[nodiscard]] int component() const {
    return is_narrow ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  }

  std::span<const std::uint32_t> wide;
  std::vector<std::uint16_t> narrow;
  bool is_narrow = false;
};

void appendWord(std::string& bytes, std::size_t word) {
  MOUTHPIECE_EXPECT(word <= std::numeric_limits<std::uint32_t>::max());
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(word >> shift));
}

/// A GLB stands alone: whatever else it names is not opened.
tinygltf::FsCallbacks noFiles() {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string&, void*) { return false; };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>*, std::string*, const std::string&, void*) { return false; };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  return callbacks;
}

bool keepImageUndecoded(tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int,
                        void*) {
  return true;
}

}  // namespace

GlbModel::GlbModel(std::string_view glb, const std::string& file) {
  const auto fail = [&](std::string_view what) { throw InputError(file, "", what); };
  if (glb.size() < 20 || !glb.starts_with("glTF")) fail("found no 'glTF' at the start; expected a GLB file");
  if (glb.size() > std::numeric_limits<std::uint32_t>::max()) fail("is larger than 4 GB");
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keepImageUndecoded, nullptr);
  loader.SetFsCallbacks(noFiles());
  std::string error, warning;
  bool is_loaded = false;
  try {
    is_loaded = loader.LoadBinaryFromMemory(&gltf, &error, &warning, reinterpret_cast<const unsigned char*>(glb.data()),
                                            static_cast<unsigned int>(glb.size()), "");
  } catch (const std::exception& problem) {
    error = problem.what();
  }
  if (!is_loaded) fail(fmt::format("is no GLB that can be read: {}", printable(error, 160)));
  if (gltf.buffers.size() > 1 || (gltf.buffers.size() == 1 && !gltf.buffers[0].uri.empty())) return;
  if (!gltf.buffers.empty()) binary_.assign(gltf.buffers[0].data.begin(), gltf.buffers[0].data.end());
  gltf.buffers.clear();
}

int GlbModel::addView(std::string_view bytes, int target, std::size_t stride) {
  binary_.append((4 - binary_.size() % 4) % 4, '\0');
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = binary_.size();
  view.byteLength = bytes.size();
  view.byteStride = stride;
  view.target = target;
  binary_.append(bytes);
  gltf.bufferViews.push_back(std::move(view));
  return numberOfLast(gltf.bufferViews);
}

int GlbModel::addAccessor(int view, int component, int type, std::size_t count) {
  tinygltf::Accessor accessor;
  accessor.bufferView = view;
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  gltf.accessors.push_back(std::move(accessor));
  return numberOfLast(gltf.accessors);
}

void GlbModel::setBounds(int accessor, std::span<const float> values, bool has_zeros) {
  tinygltf::Accessor& bounded = gltf.accessors[unsignedIndex(accessor)];
  const std::size_t width = widthOf(bounded.type);
  std::array<float, 3> low, high;
  low.fill(has_zeros ? 0 : std::numeric_limits<float>::max());
  high.fill(has_zeros ? 0 : std::numeric_limits<float>::lowest());
  for (std::size_t i = 0; i < values.size(); i += width) {
    for (std::size_t axis = 0; axis < width; ++axis) {
      low[axis] = std::min(low[axis], values[i + axis]);
      high[axis] = std::max(high[axis], values[i + axis]);
    }
  }
  bounded.minValues.assign(low.begin(), low.begin() + signedIndex(width));
  bounded.maxValues.assign(high.begin(), high.begin() + signedIndex(width));
}

int GlbModel::addAttribute(std::span<const float> values, int type, bool with_bounds) {
  const std::size_t width = widthOf(type);
  const int view = addView(bytesOf(values), TINYGLTF_TARGET_ARRAY_BUFFER, width * sizeof(float));
  const int accessor = addAccessor(view, TINYGLTF_COMPONENT_TYPE_FLOAT, type, values.size() / width);
  if (with_bounds) setBounds(accessor, values, false);
  return accessor;
}

int GlbModel::addColors(std::span<const std::uint16_t> rgba) {
  const int view = addView(bytesOf(rgba), TINYGLTF_TARGET_ARRAY_BUFFER, 8);
  const int accessor =
      addAccessor(view, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4, rgba.size() / 4);
  gltf.accessors.back().normalized = true;
  return accessor;
}

int GlbModel::addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count) {
  const Indices stored(indices, vertex_count);
  const int view = addView(stored.bytes(), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  return addAccessor(view, stored.component(), TINYGLTF_TYPE_SCALAR, indices.size());
}

int GlbModel::addScalars(std::span<const float> values, bool with_bounds) {
  const int view = addView(bytesOf(values), kNoTarget);
  const int accessor = addAccessor(view, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR, values.size());
  if (with_bounds) setBounds(accessor, values, false);
  return accessor;
}

int GlbModel::addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values,
                                std::size_t count, bool with_bounds) {
  MOUTHPIECE_EXPECT(values.size() == 3 * indices.size() && indices.size() <= count);
  const auto addWithoutData = [&] { return addAccessor(-1, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, count); };
  if (indices.empty()) {
    const auto [known, is_new] = zeros_by_count_.try_emplace(count, numberOfLast(gltf.accessors) + 1);
    if (is_new) setBounds(addWithoutData(), {}, true);
    return known->second;
  }
  const Indices stored(indices, count);
  if (values.size_bytes() + stored.bytes().size() >= 3 * count * sizeof(float)) {
    std::vector<float> all(3 * count, 0.0F);
    for (std::size_t i = 0; i < indices.size(); ++i) std::copy_n(&values[3 * i], 3, &all[3 * std::size_t{indices[i]}]);
    return addAttribute(all, TINYGLTF_TYPE_VEC3, with_bounds);
  }
  const int accessor = addWithoutData();
  if (with_bounds) setBounds(accessor, values, indices.size() < count);
  auto& sparse = gltf.accessors.back().sparse;
  sparse.isSparse = true;
  sparse.count = static_cast<int>(indices.size());
  sparse.indices = {0, addView(stored.bytes(), kNoTarget), stored.component()};
  sparse.values = {addView(bytesOf(values), kNoTarget), 0};
  return accessor;
}

void GlbModel::setSpeech(std::size_t frame_count, double frame_rate_hz, const std::vector<SpeechTrack>& tracks) {
  std::vector<float> times(frame_count);
  for (std::size_t f = 0; f < frame_count; ++f) times[f] = asFloat(asReal(f) / frame_rate_hz);
  const int input = addScalars(times, true);
  tinygltf::Animation speech;
  speech.name = "speech";
  for (const SpeechTrack& track : tracks) {
    tinygltf::AnimationSampler sampler;
    sampler.input = input;
    sampler.output = addScalars(track.weights, false);
    sampler.interpolation = "LINEAR";
    speech.samplers.push_back(std::move(sampler));
    for (const int node : track.nodes) {
      tinygltf::AnimationChannel channel;
      channel.sampler = numberOfLast(speech.samplers);
      channel.target_node = node;
      channel.target_path = "weights";
      speech.channels.push_back(std::move(channel));
    }
  }
  gltf.animations = {std::move(speech)};
}

void GlbModel::nameTargets(tinygltf::Mesh& mesh, std::size_t count) {
  mesh.weights.assign(count, 0.0);
  tinygltf::Value::Array names;
  for (std::size_t k = 0; k < count; ++k) names.emplace_back(fmt::format("shape_{:02}", k));
  // What Blender, three.js and others read them from.
  auto extras = mesh.extras.IsObject() ? mesh.extras.Get<tinygltf::Value::Object>() : tinygltf::Value::Object();
  extras["targetNames"] = tinygltf::Value(std::move(names));
  mesh.extras = tinygltf::Value(std::move(extras));
}

std::string GlbModel::toBytes() && {
  tinygltf::TinyGLTF writer;
  writer.SetImageWriter(nullptr, nullptr);
  std::ostringstream stream;
  writer.WriteGltfSceneToStream(&gltf, stream, false, false);
  std::string json = std::move(stream).str();
  binary_.append((4 - binary_.size() % 4) % 4, '\0');
  // The model's text begins with its accessors; the buffer, which the model does not hold, goes before them.
  json.insert(1, fmt::format("\"buffers\":[{{\"byteLength\":{}}}],", binary_.size()));
  json.append((4 - json.size() % 4) % 4, ' ');

  constexpr std::size_t kHeaderBytes = 12 + 8 + 8;
  std::string head = "glTF";
  appendWord(head, 2);
  appendWord(head, kHeaderBytes + json.size() + binary_.size());
  appendWord(head, json.size());
  head.append("JSON").append(json);
  appendWord(head, binary_.size());
  head.append("BIN\0", 4);
  binary_.insert(0, head);  // in place where there is room: of a long line a copy would be the largest of all
  return std::move(binary_);
}

}  // namespace mouthpiece
