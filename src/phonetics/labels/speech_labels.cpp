#include "phonetics/labels/speech_labels.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Neighbouring phones meet to within this: times come from decimal text and from sums of floats.
constexpr Seconds kTimeTolerance = 1e-6;

std::string_view faultOfPhones(const SpeechLabels& labels) {
  const auto& phones = labels.phones;
  if (phones.empty() || phones.front().phone != Phone::kSil || phones.back().phone != Phone::kSil)
    return "does not begin and end in silence";
  for (std::size_t i = 0; i < phones.size(); ++i) {
    const LabelledPhone& phone = phones[i];
    const TimeSpan& span = phone.span;
    const Seconds before = i == 0 ? std::max(0.0, span.start) : phones[i - 1].span.end;
    if (!(std::isfinite(span.end) && span.start < span.end && std::abs(span.start - before) <= kTimeTolerance))
      return "its phones do not follow one another in time";
    if ((phone.word && *phone.word >= labels.words.size()) ||
        (phone.syllable && *phone.syllable >= labels.syllables.size()))
      return "a phone names a word or syllable that is not there";
    if (phone.phone != Phone::kSil) continue;
    if (phone.word || phone.syllable) return "a silence names a word or syllable";
    if (i > 0 && phones[i - 1].phone == Phone::kSil) return "two silences lie side by side";
  }
  return "";
}

bool isInside(const PhoneRange& range, std::size_t phone_count) {
  return range.first <= range.last && range.last.value < phone_count;
}

}  // namespace

std::string SpeechLabels::wordOf(PhoneIndex phone) const {
  const auto& word = phones.at(phone.value).word;
  return word ? words.at(*word).text : std::string();
}

bool isSaidAlike(const SpeechLabels& a, const SpeechLabels& b) {
  constexpr Seconds kSameTime = 0.005;
  if (a.phones.size() != b.phones.size()) return false;
  for (std::size_t i = 0; i < a.phones.size(); ++i) {
    if (a.phones[i].phone != b.phones[i].phone) return false;
    const bool is_last = i + 1 == a.phones.size();
    if (!is_last && std::abs(a.phones[i].span.end - b.phones[i].span.end) > kSameTime) return false;
  }
  return true;
}

std::string_view faultOf(const SpeechLabels& labels) {
  if (const std::string_view fault = faultOfPhones(labels); !fault.empty()) return fault;
  const auto& phones = labels.phones;
  for (std::size_t w = 0; w < labels.words.size(); ++w) {
    const PhoneRange& range = labels.words[w].phones;
    // A word may hold a silence (a hesitation), which belongs to no word; its ends are its own.
    if (!isInside(range, phones.size()) || phones[range.first.value].word != w || phones[range.last.value].word != w)
      return "a phone does not name the word that it begins or ends";
  }
  for (std::size_t s = 0; s < labels.syllables.size(); ++s) {
    const PhoneRange& range = labels.syllables[s].phones;
    if (!isInside(range, phones.size())) return "a phone does not name the syllable that holds it";
    for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
      if (phones[i].syllable != s) return "a phone does not name the syllable that holds it";
    }
  }
  return "";
}

void expectConsistent(const SpeechLabels& labels) { MOUTHPIECE_EXPECT(faultOf(labels).empty()); }

}  // namespace mouthpiece
