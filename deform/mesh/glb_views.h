#pragma once

#include <tiny_gltf.h>

#include <Eigen/Core>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// The accessors of a GLB as numbers; every index, offset and count is checked. Each throws InputError.
class GlbViews {
 public:
  using Numbers = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Both must outlive it; `file` is for messages.
  GlbViews(const tinygltf::Model& model, std::string_view file) : model_(model), file_(file) {}

  [[nodiscard]] const tinygltf::Accessor& accessorAt(int index) const;
  /// Elements x components of an accessor of one of tinygltf's `types`, sparse parts filled in; whole numbers of a
  /// normalised one are shares of their type's largest. What is not finite stays so.
  [[nodiscard]] Numbers numbers(int index, std::initializer_list<int> types) const;
  /// The same for whole numbers, elements x components in a row.
  [[nodiscard]] std::vector<std::uint32_t> wholes(int index, std::initializer_list<int> types) const;

 private:
  struct Elements {
    const unsigned char* data = nullptr;
    std::size_t count = 0, stride = 0;
    int component = 0;
  };
  [[noreturn]] void fail(std::string_view what) const;
  const tinygltf::Accessor& checked(int index, std::initializer_list<int> types) const;
  [[nodiscard]] std::span<const unsigned char> bytesOf(int view) const;
  [[nodiscard]] Elements plain(const tinygltf::Accessor& accessor) const;
  [[nodiscard]] Elements packed(int view, int offset, int component, std::size_t width, std::size_t count) const;
  [[nodiscard]] std::size_t indexAt(const Elements& elements, std::size_t i) const;
  /// Calls `take(element, component, place)` for every number, those of the sparse part last.
  template <typename Take>
  void each(const tinygltf::Accessor& accessor, const Take& take) const;

  const tinygltf::Model& model_;
  std::string_view file_;
};

}  // namespace mouthpiece
