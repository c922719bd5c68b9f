#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/index.h"
#include "base/time.h"
#include "phonetics/language/phone.h"

namespace mouthpiece {

/// Phones [first, last] of the same SpeechLabels, both included.
struct PhoneRange {
  PhoneIndex first;
  PhoneIndex last;
  bool operator==(const PhoneRange&) const = default;
};

struct LabelledPhone {
  Phone phone = Phone::kSil;
  TimeSpan span;
  std::optional<std::size_t> word;      ///< index into SpeechLabels::words; none in silence
  std::optional<std::size_t> syllable;  ///< index into SpeechLabels::syllables
  std::string ipa{};  ///< as its language writes it, where `phone` is only the nearest to it; "": the phone itself

  [[nodiscard]] std::string_view name() const { return ipa.empty() ? phoneName(phone) : std::string_view(ipa); }
};

struct LabelledSyllable {
  PhoneRange phones;
  int stress = 0;  ///< 0 none, 1 primary, 2 secondary
};

struct LabelledWord {
  std::string text;  ///< "": likely a word, nobody knows which (LikelyWords)
  PhoneRange phones;
};

/// What is said when: phones in time order without gaps or overlaps, starting and ending in silence.
struct SpeechLabels {
  std::vector<LabelledPhone> phones;
  std::vector<LabelledSyllable> syllables;
  std::vector<LabelledWord> words;

  [[nodiscard]] Seconds duration() const { return phones.empty() ? 0.0 : phones.back().span.end; }
  [[nodiscard]] TimeSpan spanOf(const PhoneRange& range) const {
    return {phones[range.first.value].span.start, phones[range.last.value].span.end};
  }
  /// The word that phone belongs to, "" in silence.
  [[nodiscard]] std::string wordOf(PhoneIndex phone) const;
};

/// Whether both say the same phones at the same times, to within 5 ms; the last silences may differ in length.
bool isSaidAlike(const SpeechLabels& a, const SpeechLabels& b);

/// Which of the promises above `labels` break, as a predicate ("does not begin and end in silence"); "" when they hold:
/// times rise, indices are in range, words and syllables hold the phones that name them.
std::string_view faultOf(const SpeechLabels& labels);
/// Throws InternalError where faultOf() finds one.
void expectConsistent(const SpeechLabels& labels);

}  // namespace mouthpiece
