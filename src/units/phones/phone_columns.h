#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/index.h"
#include "base/time.h"
#include "phonetics/labels/speech_labels.h"
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

/// Bits of PhoneFacts::edges.
enum PhoneEdge : unsigned {
  kBeginsSyllable = 1,
  kEndsSyllable = 2,
  kBeginsWord = 4,
  kEndsWord = 8,
  kBeginsPhrase = 16,
  kEndsPhrase = 32,
};

/// What labels say of one of their phones.
struct PhoneFacts {
  std::array<Phone, 5> phones{};           ///< two before, itself, two after; silence beyond the ends
  bool is_first = false, is_last = false;  ///< of its labels
  unsigned edges = 0;                      ///< PhoneEdge
  bool is_stressed = false;
  Seconds duration = 0;
  float log_duration = 0;  ///< of seconds, a millisecond at least
  float log_rate = 0;      ///< of phones a second, over up to three phones to each side, not beyond a pause

  [[nodiscard]] Phone phone() const { return phones[2]; }
};

/// What selection asks of all phones of a corpus, a column each, take after take: a large corpus' file keeps them, so
/// that a line reads the labels of those takes alone that it plays.
class PhoneColumns {
 public:
  using Position = std::uint32_t;  ///< of a phone among those of all takes, one after another

  /// Of the next take; `is_adapted`: from another speaker. Throws InternalError beyond 2^31 phones.
  void add(const SpeechLabels& labels, bool is_adapted);

  [[nodiscard]] std::size_t takeCount() const { return take_begin.size() - 1; }
  [[nodiscard]] std::size_t phoneCount() const { return phones.size(); }
  [[nodiscard]] std::size_t phoneCount(TakeIndex take) const { return endOf(take) - take_begin[take.value]; }
  [[nodiscard]] Position endOf(TakeIndex take) const { return take_begin[take.value + 1]; }
  [[nodiscard]] Position positionOf(const PhonePlace& place) const {
    return take_begin[place.take.value] + static_cast<Position>(place.phone.value);
  }
  [[nodiscard]] PhonePlace placeOf(Position position) const;
  /// Of positions that rise, which is faster.
  [[nodiscard]] std::vector<PhonePlace> placesOf(const Position* first, const Position* last) const;

  [[nodiscard]] Phone phoneAt(const PhonePlace& place) const { return phones[positionOf(place)]; }
  [[nodiscard]] bool isAdapted(TakeIndex take) const { return (marks[take_begin[take.value]] & kAdapted) != 0; }
  /// Without logarithms, which take longer than all the rest, those two stay 0.
  [[nodiscard]] PhoneFacts factsOf(const PhonePlace& place, bool with_logarithms = true) const;

  /// What is wrong with columns that came from elsewhere, as a predicate ("name phones that there are not"); "" when
  /// nothing is. Each take has a phone at least.
  [[nodiscard]] std::string_view fault() const;

  bool operator==(const PhoneColumns&) const = default;

  std::vector<Position> take_begin{0};  ///< by take, and where the last one ends
  std::vector<Phone> phones;
  std::vector<std::uint8_t> marks;  ///< the lowest six bits PhoneFacts::edges, then kStressed and kAdapted
  std::vector<Seconds> durations;
  std::vector<Position> suffixes;  ///< sortedSuffixes() of phone_span_index.h; empty: not sorted yet

  static constexpr std::uint8_t kStressed = 64, kAdapted = 128;
};

}  // namespace mouthpiece
