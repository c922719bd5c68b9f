#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The binary chunk of a GLB and the JSON that describes it, grown together.
class GlbBuffer {
 public:
  /// Each returns the new accessor's index. Attributes are vertex data, one bufferView each.
  std::size_t addVec3(std::span<const float> values, bool with_bounds);
  std::size_t addVec2(std::span<const float> values);
  std::size_t addColors(std::span<const std::uint16_t> rgba);
  std::size_t addIndices(std::span<const std::uint32_t> indices, std::size_t vertex_count);
  std::size_t addScalars(std::span<const float> values, bool with_bounds);
  /// `count` vec3 values, zero but for `values` (three each) at `indices` (rising): stored sparse where that is
  /// smaller; all-zero ones of a count share one accessor without data.
  std::size_t addMostlyZeroVec3(std::span<const std::uint32_t> indices, std::span<const float> values,
                                std::size_t count, bool with_bounds);

  [[nodiscard]] const nlohmann::json& accessor(std::size_t index) const { return accessors_[index]; }

  /// Address space for `bytes` of data, so that a large buffer is not copied as it grows.
  void reserve(std::size_t bytes) { bytes_.reserve(bytes); }

  /// `root` (asset, scene, nodes ...) with accessors, bufferViews and the buffer, as one GLB. Takes the data with it.
  [[nodiscard]] std::string toGlb(nlohmann::json root) &&;

 private:
  std::size_t addZeroVec3(std::size_t count);
  std::size_t addView(std::string_view bytes, int target, std::size_t stride);
  std::size_t addAccessor(nlohmann::json accessor);
  std::size_t appendAligned(std::string_view bytes);

  std::string bytes_;
  std::map<std::size_t, std::size_t> zeros_by_count_;
  nlohmann::json accessors_ = nlohmann::json::array();
  nlohmann::json views_ = nlohmann::json::array();
};

}  // namespace mouthpiece
