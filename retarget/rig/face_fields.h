#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

inline constexpr std::size_t kMaxFaceText = 4096;  ///< bytes of a name in a .face file

static_assert(std::endian::native == std::endian::little, "blobs are little-endian and copied as they are");

/// The CBOR of a .face file. Throws InputError when it is damaged, or nested deeper than such a file is.
nlohmann::json parseFaceTree(std::string_view bytes, const std::string& file);

/// One map of a .face file, read field by field; every getter throws InputError that names the field.
class FaceFields {
 public:
  /// Refers to `map`. `place`: where it stands in the file, "" at its top.
  FaceFields(const nlohmann::json& map, std::string file, std::string place);

  [[nodiscard]] FaceFields map(const char* key) const { return {at(key), file_, pathOf(key)}; }
  [[nodiscard]] const nlohmann::json& array(const char* key, std::size_t max_size) const;
  [[nodiscard]] bool has(const char* key) const { return map_.contains(key); }
  [[nodiscard]] std::string text(const char* key) const;
  [[nodiscard]] double number(const char* key, double least, double most) const;
  [[nodiscard]] std::int64_t whole(const char* key, std::int64_t least, std::int64_t most) const;
  [[nodiscard]] bool flag(const char* key) const;
  /// A blob of `Scalar`s; any length up to the file's own.
  template <typename Scalar>
  [[nodiscard]] std::vector<Scalar> blob(const char* key) const {
    const nlohmann::json& value = at(key);
    if (!value.is_binary()) fail(key, "expected a blob of bytes");
    const auto& bytes = value.get_binary();
    if (bytes.size() % sizeof(Scalar) != 0)
      fail(key, fmt::format("found {} bytes; expected a multiple of {}", bytes.size(), sizeof(Scalar)));
    std::vector<Scalar> values(bytes.size() / sizeof(Scalar));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  /// rows x columns doubles, finite and of a size that a face can have.
  template <typename MatrixType>
  [[nodiscard]] MatrixType matrix(const char* key, std::size_t rows) const {
    const std::vector<double> values = blob<double>(key);
    constexpr auto kColumns = static_cast<std::size_t>(MatrixType::ColsAtCompileTime);
    if (values.size() != rows * kColumns)
      fail(key, fmt::format("found {} numbers; expected {}", values.size(), rows * kColumns));
    for (const double value : values) {
      if (!(std::abs(value) <= 1e9)) fail(key, "found a coordinate that is no usable number");
    }
    return Eigen::Map<const MatrixType>(values.data(), static_cast<Eigen::Index>(rows),
                                        static_cast<Eigen::Index>(kColumns));
  }
  [[noreturn]] void fail(const char* key, std::string_view what) const;
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  [[nodiscard]] const nlohmann::json& at(const char* key) const;
  [[nodiscard]] std::string pathOf(std::string_view key) const;

  const nlohmann::json& map_;
  std::string file_;
  std::string place_;
};

template <typename Scalar>
nlohmann::json blobOf(const Scalar* data, std::size_t count) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(data);
  return nlohmann::json::binary(std::vector<std::uint8_t>(bytes, bytes + count * sizeof(Scalar)));
}
template <typename Scalar>
nlohmann::json blobOf(const std::vector<Scalar>& values) {
  return blobOf(values.data(), values.size());
}
template <typename MatrixType>
nlohmann::json blobOfMatrix(const MatrixType& matrix) {
  return blobOf(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

}  // namespace mouthpiece
