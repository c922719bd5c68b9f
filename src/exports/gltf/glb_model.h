#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// glTF's numbers of components and of what a view is for.
namespace gltf {
inline constexpr int kByte = 5120, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
inline constexpr int kNoTarget = 0, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
}  // namespace gltf

/// glTF's numbers of what an accessor holds.
enum class GlbType { kScalar = 1, kVec2 = 2, kVec3 = 3, kVec4 = 4 };
/// What a vertex attribute is, and so how it is packed: a place or a normal, what a shape adds to these, or anything.
enum class GlbUse { kPlace, kMove, kNormal, kTurn, kOther };

/// Weights that the nodes follow, frame after frame, each with a value for every morph target.
struct SpeechTrack {
  std::span<const float> weights;
  std::vector<std::size_t> nodes;
};

/// A GLB's JSON, all of it, and the binary chunk beside it: what is not changed here goes out as it came in, whatever
/// extension it belongs to (docs/decisions/0009-gltf.md).
class GlbModel {
 public:
  GlbModel() = default;
  /// Takes a GLB apart. Throws InputError that begins with `file` for what is damaged.
  GlbModel(std::string_view glb, const std::string& file);

  nlohmann::json root = nlohmann::json::object();  ///< `buffers` without the binary chunk's length

  /// What is added from now on is packed (EXT_meshopt_compression, KHR_mesh_quantization): places become whole
  /// multiples of placeUnit() from placeOrigin(), to be undone by the node that shows them. `lowest` and `highest`: of
  /// all places in metres. Only in a model of our own, from its beginning.
  void pack(const std::array<double, 3>& lowest, const std::array<double, 3>& highest);
  [[nodiscard]] bool isPacked() const { return is_packed_; }
  [[nodiscard]] double placeUnit() const { return place_unit_; }
  [[nodiscard]] const std::array<double, 3>& placeOrigin() const { return place_origin_; }
  /// Each returns the new accessor's number. Attributes (kVec2 or kVec3) are vertex data, one bufferView each.
  std::size_t addAttribute(std::span<const float> values, GlbType type, GlbUse use);
  std::size_t addColors(std::span<const std::uint16_t> rgba);
  std::size_t addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count);
  /// `count` vec3 values, zero but for `values` (three each) at `indices` (rising): stored sparse where that is
  /// smaller; all-zero ones of a count share one accessor without data.
  std::size_t addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values,
                                std::size_t count, GlbUse use);

  /// An animation called "speech" after those that are there: a key a frame.
  void addSpeech(std::size_t frame_count, double frame_rate_hz, const std::vector<SpeechTrack>& tracks);
  /// What the first scene shows turns about `pivot_m` (metres): a quaternion (x y z w) a frame of the speech added
  /// last.
  void addHead(std::span<const std::array<float, 4>> rotations, const std::array<double, 3>& pivot_m);
  /// Takes away what an earlier run has added: the animation "speech", and morph targets called speech_00 and so on.
  /// Returns how many targets each mesh has lost that had some; widenWeights() is to be told.
  std::map<std::size_t, std::size_t> removeSpeech();
  /// A mesh keeps `targets` morph targets, has lost `removed` after them and gets `added` ones.
  struct Widening {
    std::size_t targets = 0, removed = 0, added = 0;
  };
  using KeyReader = std::function<std::vector<float>(std::size_t accessor)>;
  /// Makes the keys of the animations of these nodes' weights fit, the added ones at rest. `keysOf`: what an accessor
  /// of the given file holds.
  void widenWeights(const KeyReader& keysOf, const std::map<std::size_t, Widening>& nodes);

  /// Whether vertices can be added to: the file's first buffer is its binary chunk.
  [[nodiscard]] bool hasData() const { return !binary_.empty(); }
  /// Address space for `bytes` of data, so that a large chunk is not copied as it grows.
  void reserve(std::size_t bytes) { binary_.reserve(bytes); }
  /// The file. Takes the data with it.
  [[nodiscard]] std::string toBytes() &&;

 private:
  void free(const std::set<std::size_t>& accessors);
  void compact();
  std::size_t addScalars(std::span<const float> values, bool with_bounds);
  std::size_t addView(std::string_view bytes, int target, std::size_t stride = 0);
  std::size_t addAccessor(int component, GlbType type, std::size_t count);
  /// The least and the largest of each component; of zeros too where there are some beside `values`.
  void setBounds(std::size_t accessor, std::span<const float> values, bool has_zeros);

  // glb_packed.cpp
  std::size_t addPackedAttribute(std::span<const float> values, GlbType type, GlbUse use);
  /// addMostlyZeroVec3() with something in it.
  std::size_t addPackedTarget(std::span<const std::uint32_t> indices, std::span<const float> values, std::size_t count,
                              GlbUse use);
  /// `count` whole vec3 beside others of their width in one view: `values`, three each, at `indices`, zeros between
  /// them; without indices all.
  std::size_t addWholeVec3(std::span<const std::int32_t> values, std::span<const std::uint32_t> indices,
                           std::size_t count, bool is_normalised);
  std::size_t addPackedColors(std::span<const std::uint16_t> rgba);
  std::size_t addPackedIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count);
  std::size_t addPackedWeights(std::span<const float> values, std::size_t a_frame);
  std::size_t addPackedView(std::string_view packed, std::size_t count, std::size_t stride, const char* mode,
                            const char* filter, int target);
  struct SharedView;
  /// Packs the views that several accessors share.
  void closeSharedView(std::size_t stride, SharedView& shared);
  void closeSharedViews();

  std::string binary_;
  bool is_packed_ = false;
  double place_unit_ = 1;
  std::array<double, 3> place_origin_{};
  std::size_t unpacked_bytes_ = 0;  ///< of what is packed, one view after another
  /// Whole numbers of one width that wait for their view, and the accessors that show them.
  struct SharedView {
    std::string bytes;
    std::vector<std::size_t> accessors;
  };
  std::map<std::size_t, SharedView> shared_views_;  ///< by the stride
  std::map<std::size_t, std::size_t> zeros_by_count_;
  std::optional<nlohmann::json> zero_;                    ///< what accessors without a value in them have as `sparse`
  std::vector<std::size_t> free_accessors_, free_views_;  ///< numbers that nothing names any more, to be used again
  bool has_holes_ = false;                                ///< the chunk holds data that no view shows
};

}  // namespace mouthpiece
