#include "expression/beats.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr Seconds kLongestBeat = 0.8;
constexpr Seconds kShortestPause = 0.1;
constexpr double kLong = 1.1;  ///< of the usual length of a stressed vowel

/// The longest vowel of a stressed syllable of the phones.
std::optional<TimeSpan> stressedVowel(const SpeechLabels& labels, std::size_t first, std::size_t last) {
  std::optional<TimeSpan> longest;
  for (std::size_t i = first; i <= last; ++i) {
    const LabelledPhone& phone = labels.phones[i];
    const bool is_stressed = phone.syllable && labels.syllables[*phone.syllable].stress == 1;
    if (is_stressed && isVowel(phone.phone) && (!longest || phone.span.duration() > longest->duration()))
      longest = phone.span;
  }
  return longest;
}

void addParts(const Beat& whole, std::vector<Beat>& beats) {
  const auto parts = static_cast<int>(std::ceil(whole.span.duration() / kLongestBeat));
  for (int part = 0; part < parts; ++part) {
    Beat& beat = beats.emplace_back(whole);
    const Seconds step = whole.span.duration() / parts;
    beat.span = {whole.span.start + part * step, whole.span.start + (part + 1) * step};
  }
}

}  // namespace

std::vector<Beat> beatsOf(const SpeechLabels& labels) {
  std::vector<Beat> beats;
  std::vector<double> lengths;  // of stressed vowels
  std::vector<Seconds> vowels;  // of each beat's, 0: none
  for (std::size_t first = 0; first < labels.phones.size();) {
    const LabelledPhone& phone = labels.phones[first];
    std::size_t last = first;
    const bool is_silence = phone.phone == Phone::kSil;
    while (last + 1 < labels.phones.size() && (labels.phones[last + 1].phone == Phone::kSil) == is_silence &&
           labels.phones[last + 1].word == phone.word)
      ++last;
    Beat beat;
    beat.span = labels.spanOf({PhoneIndex(first), PhoneIndex(last)});
    beat.is_silence = is_silence;
    if (beat.is_silence && beat.span.duration() < kShortestPause && !beats.empty()) {
      beats.back().span.end = beat.span.end;  // no pause: a word's end
    } else if (beat.is_silence || !phone.word) {
      addParts(beat, beats);
    } else {
      const std::optional<TimeSpan> vowel = stressedVowel(labels, first, last);
      beat.accent = vowel ? vowel->middle() : beat.span.middle();
      if (vowel) lengths.push_back(vowel->duration());
      beats.push_back(beat);
    }
    vowels.resize(beats.size(), 0);
    if (!is_silence && phone.word) {
      const std::optional<TimeSpan> vowel = stressedVowel(labels, first, last);
      vowels.back() = vowel ? vowel->duration() : 0;
    }
    first = last + 1;
  }
  const double usual = median(lengths, 0);
  for (std::size_t i = 0; i < beats.size(); ++i) {
    beats[i].starts_phrase = i == 0 || (!beats[i].is_silence && beats[i - 1].is_silence);
    beats[i].ends_phrase = i + 1 == beats.size() || (!beats[i].is_silence && beats[i + 1].is_silence);
    if (beats[i].is_silence) continue;
    beats[i].is_accented = vowels[i] > 0 && (beats[i].ends_phrase || vowels[i] > kLong * usual);
  }
  return beats;
}

}  // namespace mouthpiece
