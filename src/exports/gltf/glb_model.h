#pragma once

#include <tiny_gltf.h>

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// Weights that the nodes follow, frame after frame, each with a value for every morph target.
struct SpeechTrack {
  std::span<const float> weights;
  std::vector<int> nodes;
};

/// tinygltf's model of a GLB, and the binary chunk beside it: tinygltf's own writer of binary files would hold the chunk
/// three times (docs/decisions/0009-gltf.md).
class GlbModel {
 public:
  GlbModel() = default;
  /// Takes a GLB apart. Throws InputError that begins with `file` for what is damaged or keeps data outside.
  GlbModel(std::string_view glb, const std::string& file);

  tinygltf::Model gltf;  ///< without `buffers`

  /// Each returns the new accessor's number. Attributes (VEC2 or VEC3) are vertex data, one bufferView each.
  int addAttribute(std::span<const float> values, int type, bool with_bounds);
  int addColors(std::span<const std::uint16_t> rgba);
  int addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count);
  /// `count` vec3 values, zero but for `values` (three each) at `indices` (rising): stored sparse where that is
  /// smaller; all-zero ones of a count share one accessor without data.
  int addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values, std::size_t count,
                        bool with_bounds);

  /// The one animation, "speech", in the place of what there was: a key a frame.
  void setSpeech(std::size_t frame_count, double frame_rate_hz, const std::vector<SpeechTrack>& tracks);
  /// Rest weights and names (shape_00 ...) for `count` targets.
  static void nameTargets(tinygltf::Mesh& mesh, std::size_t count);

  [[nodiscard]] bool hasData() const { return !binary_.empty(); }
  /// Address space for `bytes` of data, so that a large chunk is not copied as it grows.
  void reserve(std::size_t bytes) { binary_.reserve(bytes); }
  /// The file. Takes the data with it.
  [[nodiscard]] std::string toBytes() &&;

 private:
  int addScalars(std::span<const float> values, bool with_bounds);
  int addView(std::string_view bytes, int target, std::size_t stride = 0);
  int addAccessor(int view, int component, int type, std::size_t count);
  /// The least and the largest of each component; of zeros too where there are some beside `values`.
  void setBounds(int accessor, std::span<const float> values, bool has_zeros);

  std::string binary_;
  std::map<std::size_t, int> zeros_by_count_;
};

}  // namespace mouthpiece
