#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

namespace tinygltf {
class Model;
}

namespace mouthpiece {

/// Elements of a GLB's buffer, all of whose bytes are there.
struct GlbView {
  const unsigned char* data = nullptr;
  std::size_t count = 0;
  std::size_t stride = 0;
  int component = 0;  ///< tinygltf's number of the type of one component

  /// Component k of element i as a number; whole numbers are shares of their type's largest. Not finite: 0.
  [[nodiscard]] float channel(std::size_t i, std::size_t k) const;
};

/// A GLB's accessors and buffer views, every index, offset and count of which is checked. Each throws InputError.
class GlbViews {
 public:
  /// Both must outlive it; `file` is for messages.
  GlbViews(const tinygltf::Model& model, std::string_view file) : model_(model), file_(file) {}

  /// A plain accessor of tinygltf's `type`.
  [[nodiscard]] GlbView accessor(int index, int type) const;
  /// The type that an accessor says it has.
  [[nodiscard]] int typeOf(int index) const;
  /// `count` vec3 floats of an accessor that may be sparse: what it leaves out is zero.
  [[nodiscard]] std::vector<float> mostlyZeroVec3(int index, std::size_t count) const;
  /// Element i of a view of whole numbers.
  [[nodiscard]] std::size_t indexAt(const GlbView& view, std::size_t i) const;

 private:
  [[noreturn]] void fail(std::string_view what) const;
  [[nodiscard]] std::span<const unsigned char> bytesOf(int view_index) const;
  [[nodiscard]] GlbView plainPart(int index) const;
  [[nodiscard]] GlbView packed(int view_index, std::size_t offset, int component, std::size_t width,
                               std::size_t count) const;

  const tinygltf::Model& model_;
  std::string_view file_;
};

}  // namespace mouthpiece
