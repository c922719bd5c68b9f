#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace mouthpiece {

/// The two chunks of a GLB, to add to one that was given.
struct GlbChunks {
  nlohmann::json root;  ///< an object
  std::string binary;

  /// Appends floats, `width` (1 or 3) an element, to the first buffer; the new accessor's number.
  std::size_t addFloats(std::span<const float> values, std::size_t width, bool with_bounds);
  /// The same for vec3 values most of which are zero: stored sparse where that is smaller.
  std::size_t addMostlyZeroVec3(std::span<const float> values);
  /// Whether `root` has a list of that name that is not empty.
  [[nodiscard]] bool hasList(const char* key) const;
  [[nodiscard]] std::string toBytes() const;
};

/// Takes a GLB apart; throws InputError that begins with `file` when its chunks are damaged.
GlbChunks glbChunks(std::string_view glb, const std::string& file);

}  // namespace mouthpiece
