#pragma once

#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace mouthpiece {

/// Time from the start of the clip or utterance at hand.
using Seconds = double;

/// The half-open interval [start, end).
struct TimeSpan {
  Seconds start = 0;
  Seconds end = 0;

  [[nodiscard]] constexpr Seconds duration() const { return end - start; }
  [[nodiscard]] constexpr Seconds middle() const { return 0.5 * (start + end); }
  [[nodiscard]] constexpr bool contains(Seconds time) const { return start <= time && time < end; }
  [[nodiscard]] constexpr bool overlaps(const TimeSpan& other) const { return start < other.end && other.start < end; }
  constexpr auto operator<=>(const TimeSpan&) const = default;
};

/// A phone of a performed line.
struct PhoneLabel {
  std::string phone;   ///< ARPAbet without stress: "AH"; IPA where it has no such phone: "y"; "sil" in silence
  std::string viseme;  ///< its class: "MBP", "Ah" (docs/theory/phonetics/phones_and_visemes.md)
  TimeSpan span;
  std::optional<std::size_t> word;  ///< index into Labels::words; none in silence
};

struct WordLabel {
  std::string text;
  TimeSpan span;
};

/// What is said when. Phones follow one another without gaps, silence first and last.
struct Labels {
  std::vector<PhoneLabel> phones;
  std::vector<WordLabel> words;
};

}  // namespace mouthpiece
