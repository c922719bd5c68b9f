#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mouthpiece {

/// A place in a JSON document and what stands there, possibly nothing. Getters check kind, size and range; they throw
/// InputError with the file and the place's path (`words[2].notes[0].beats`), what was found and what was expected.
/// A copy is cheap and keeps the document alive.
class JsonField {
 public:
  /// The member `key` of this object, there or not: the getters below refuse one that is missing.
  JsonField operator[](std::string_view key) const;
  [[nodiscard]] bool exists() const { return missing_key_.empty(); }
  [[nodiscard]] bool isNull() const;
  [[nodiscard]] bool isNumber() const;
  [[nodiscard]] bool isWhole() const;  ///< a number written without point or exponent
  [[nodiscard]] bool isText() const;
  [[nodiscard]] bool isList() const;
  [[nodiscard]] bool isObject() const;
  /// Entries of a list or object; 0 of anything else.
  [[nodiscard]] std::size_t size() const;

  /// Finite and within both limits.
  [[nodiscard]] double number(double least = std::numeric_limits<double>::lowest(),
                              double most = std::numeric_limits<double>::max()) const;
  [[nodiscard]] std::int64_t whole(std::int64_t least, std::int64_t most) const;
  [[nodiscard]] bool flag() const;
  /// At most `most` bytes.
  [[nodiscard]] std::string text(std::size_t most = kLongestText) const;
  /// 1 to `most` bytes without control characters.
  [[nodiscard]] std::string name(std::size_t most = kLongestText) const;
  /// The place of this text among `words`.
  [[nodiscard]] std::size_t choice(std::span<const std::string_view> words) const;

  [[nodiscard]] std::vector<JsonField> list(std::size_t least = 0, std::size_t most = kLongestList) const;
  /// name() of each entry.
  [[nodiscard]] std::vector<std::string> names(std::size_t least = 0, std::size_t most = kLongestList) const;
  /// `count` numbers, none farther from 0 than `largest`.
  [[nodiscard]] Eigen::VectorXd numbers(Eigen::Index count, double largest) const;
  /// An object's entries in the order of their keys.
  [[nodiscard]] std::vector<std::pair<std::string, JsonField>> members() const;

  /// What a CBOR document holds as bytes.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const;
  /// The same as little-endian numbers.
  template <typename Scalar>
  [[nodiscard]] std::vector<Scalar> blob() const {
    const std::span<const std::uint8_t> raw = bytes();
    if (raw.size() % sizeof(Scalar) != 0) refuse("a multiple of " + std::to_string(sizeof(Scalar)) + " bytes");
    std::vector<Scalar> values(raw.size() / sizeof(Scalar));
    if (!values.empty()) std::memcpy(values.data(), raw.data(), raw.size());
    if constexpr (std::endian::native == std::endian::big) {
      for (Scalar& value : values) {
        auto* const first = reinterpret_cast<std::uint8_t*>(&value);
        std::reverse(first, first + sizeof(Scalar));
      }
    }
    return values;
  }

  /// Throws InputError: "found WHAT IS THERE; expected EXPECTED", or "is missing; expected EXPECTED".
  [[noreturn]] void refuse(std::string_view expected) const;
  /// Throws InputError that says `what` of this place.
  [[noreturn]] void fail(std::string_view what) const;
  [[nodiscard]] const std::string& file() const;
  /// `markers[3].name`; "" for the whole document. Found by a search: for messages.
  [[nodiscard]] std::string path() const;

  static constexpr std::size_t kLongestText = 4096;
  static constexpr std::size_t kLongestList = 100'000'000;

 private:
  struct Document;
  JsonField(std::shared_ptr<const Document> document, const nlohmann::json& node, std::string missing_key = {});
  friend JsonField parseJson(std::string_view, std::string_view, std::string_view);
  friend JsonField parseCbor(std::string_view, std::string_view, std::string_view);

  std::shared_ptr<const Document> document_;
  const nlohmann::json* node_;  ///< of a missing member: the object that lacks it
  std::string missing_key_;
};

/// The whole of a JSON text. Throws InputError for what is no JSON, holds a number out of range or is nested deeper
/// than 32 levels: "is no valid JSON; expected EXPECTED", with the byte.
JsonField parseJson(std::string_view text, std::string_view file, std::string_view expected);
/// The same of CBOR: "is no valid CBOR". Long blobs of cborBytes() are read where they lie in `bytes`, which has to
/// outlive the fields.
JsonField parseCbor(std::string_view bytes, std::string_view file, std::string_view expected);

}  // namespace mouthpiece
