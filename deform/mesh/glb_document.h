#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// A GLB whose accessors get other data; what nothing shows any more is dropped.
class GlbDocument {
 public:
  /// Throws InputError that begins with `file` for a damaged file, or one whose data lies outside of it.
  GlbDocument(std::string_view glb, std::string_view file);

  [[nodiscard]] nlohmann::json& root() { return root_; }

  /// Tells of one place that names `accessor` and will name what is put for it.
  void claim(std::size_t accessor) { ++claimed_[accessor]; }

  /// Puts `bytes` of `accessor`'s shape where the accessor `old` is, or beside it where something that claim() was not
  /// told of names it, too. Gives its number. `target`, `stride`: 0 for none.
  std::size_t putAccessor(std::size_t old, nlohmann::json accessor, const std::string& bytes, int target,
                          std::size_t stride);
  /// The same for elements that are mostly zero: those that are not, and where they stand.
  std::size_t putSparse(std::size_t old, nlohmann::json accessor, const std::vector<std::uint32_t>& places,
                        const std::string& values);
  /// A new one.
  std::size_t addAccessor(nlohmann::json accessor, const std::string& bytes, int target);

  /// The file, without what nothing shows; leaves this empty.
  [[nodiscard]] std::string bytes();

 private:
  std::size_t putView(const std::string& bytes, int target, std::size_t stride);
  std::size_t keep(std::size_t old, nlohmann::json accessor);
  void dropUnseenViews();
  void dropUnseenBytes();

  nlohmann::json root_;
  std::string binary_;
  std::map<std::size_t, int> uses_, claimed_;  ///< of accessors
};

/// Numbers as a GLB holds them.
template <typename T>
std::string bytesOf(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

}  // namespace mouthpiece
