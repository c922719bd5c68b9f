#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/index.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// A phone of a corpus.
struct PhonePlace {
  TakeIndex take;
  PhoneIndex phone;
  auto operator<=>(const PhonePlace&) const = default;
};

/// `place` moved on by `phones` phones.
inline PhonePlace advance(const PhonePlace& place, std::size_t phones) {
  return {place.take, PhoneIndex(place.phone.value + phones)};
}

/// The longest prefix that occurs, and where it begins; length 0 and no places when not even the first pair occurs.
struct LongestMatch {
  std::size_t length = 0;
  std::vector<PhonePlace> places;  ///< in the order of the corpus
};

/// Finds runs of phones in the takes of a corpus: a suffix array with longest common prefixes over all phone labels. A
/// run never crosses from one take into the next. Immutable, safe to share.
class PhoneSpanIndex {
 public:
  /// One sequence a take; fewer than 2^31 phones in all. O(n log n) for n phones, whatever they repeat.
  explicit PhoneSpanIndex(const std::vector<std::vector<Phone>>& takes);

  /// O(length * log n + places).
  [[nodiscard]] LongestMatch longestMatch(std::span<const Phone> phones) const;

  /// Every place where all of `phones` occurs; same cost. Everywhere, when `phones` is empty.
  [[nodiscard]] std::vector<PhonePlace> placesOf(std::span<const Phone> phones) const;

  [[nodiscard]] std::size_t phoneCount() const { return phones_.size(); }

 private:
  [[nodiscard]] std::size_t commonPrefix(std::span<const Phone> phones, std::size_t suffix) const;
  [[nodiscard]] std::size_t lowerBound(std::span<const Phone> phones) const;
  [[nodiscard]] std::vector<PhonePlace> placesAround(std::size_t row, std::size_t length) const;
  void sortSuffixes();
  void measureCommonPrefixes();

  using Position = std::uint32_t;  ///< of a phone among those of all takes, one after another
  [[nodiscard]] PhonePlace placeOf(Position position) const;

  std::vector<Phone> phones_;
  std::vector<Position> take_end_;       ///< by phone: where its take ends
  std::vector<Position> take_begin_;     ///< by take
  std::vector<Position> suffixes_;       ///< starts of the suffixes (to the end of their take), sorted
  std::vector<Position> common_prefix_;  ///< of suffixes_[k - 1] and suffixes_[k]; 0 for k = 0
};

}  // namespace mouthpiece
