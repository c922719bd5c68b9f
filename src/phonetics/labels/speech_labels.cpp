#include "phonetics/labels/speech_labels.h"

#include <cmath>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// Neighbouring phones meet to within this: times come from decimal text and from sums of floats.
constexpr Seconds kTimeTolerance = 1e-6;

void expectPhonesConsistent(const SpeechLabels& labels) {
  const auto& phones = labels.phones;
  MOUTHPIECE_EXPECT(phones.front().phone == Phone::kSil);
  MOUTHPIECE_EXPECT(phones.back().phone == Phone::kSil);
  MOUTHPIECE_EXPECT(phones.front().span.start >= 0);
  for (std::size_t i = 0; i < phones.size(); ++i) {
    const LabelledPhone& phone = phones[i];
    MOUTHPIECE_EXPECT(std::isfinite(phone.span.start) && std::isfinite(phone.span.end));
    MOUTHPIECE_EXPECT(phone.span.start < phone.span.end);
    MOUTHPIECE_EXPECT(!phone.word || *phone.word < labels.words.size());
    MOUTHPIECE_EXPECT(!phone.syllable || *phone.syllable < labels.syllables.size());
    MOUTHPIECE_EXPECT(phone.phone != Phone::kSil || (!phone.word && !phone.syllable));
    if (i == 0) continue;
    MOUTHPIECE_EXPECT(std::abs(phone.span.start - phones[i - 1].span.end) <= kTimeTolerance);
    MOUTHPIECE_EXPECT(phone.phone != Phone::kSil || phones[i - 1].phone != Phone::kSil);
  }
}

void expectRangeInside(const PhoneRange& range, std::size_t phone_count) {
  MOUTHPIECE_EXPECT(range.first <= range.last);
  MOUTHPIECE_EXPECT(range.last.value < phone_count);
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

void expectConsistent(const SpeechLabels& labels) {
  MOUTHPIECE_EXPECT(!labels.phones.empty());
  expectPhonesConsistent(labels);
  for (std::size_t w = 0; w < labels.words.size(); ++w) {
    const PhoneRange& range = labels.words[w].phones;
    expectRangeInside(range, labels.phones.size());
    // A word may hold a silence (a hesitation), which belongs to no word; its ends are its own.
    MOUTHPIECE_EXPECT(labels.phones[range.first.value].word == w);
    MOUTHPIECE_EXPECT(labels.phones[range.last.value].word == w);
  }
  for (std::size_t s = 0; s < labels.syllables.size(); ++s) {
    const PhoneRange& range = labels.syllables[s].phones;
    expectRangeInside(range, labels.phones.size());
    for (std::size_t i = range.first.value; i <= range.last.value; ++i) {
      MOUTHPIECE_EXPECT(labels.phones[i].syllable == s);
    }
  }
}

}  // namespace mouthpiece
