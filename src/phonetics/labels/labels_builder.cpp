#include "phonetics/labels/labels_builder.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "phonetics/labels/syllables.h"

namespace mouthpiece {
namespace {

/// What a line without silence at its end lends to it.
constexpr Seconds kLentSilence = 0.020;
constexpr double kLentShare = 0.25;
/// Gaps up to this are rounding in the file, not a pause; the phone before is stretched over them.
constexpr Seconds kRoundingGap = 1e-4;

bool isSilence(const PhoneSegment& segment) { return segment.phone == Phone::kSil; }

void appendSegment(std::vector<PhoneSegment>& segments, const PhoneSegment& next) {
  if (!segments.empty() && isSilence(segments.back()) && isSilence(next)) {
    segments.back().span.end = next.span.end;
  } else {
    segments.push_back(next);
  }
}

/// Fills gaps with silence and merges silences that meet.
std::vector<PhoneSegment> withoutGaps(const std::vector<PhoneSegment>& segments, Seconds duration) {
  std::vector<PhoneSegment> filled;
  Seconds end = 0;
  for (PhoneSegment segment : segments) {
    MOUTHPIECE_EXPECT(std::isfinite(segment.span.start) && std::isfinite(segment.span.end));
    MOUTHPIECE_EXPECT(segment.span.start < segment.span.end && segment.span.start > end - kRoundingGap);
    if (segment.span.start > end + kRoundingGap) {
      appendSegment(filled, {.span = {end, segment.span.start}});
    } else {
      segment.span.start = end;
      MOUTHPIECE_EXPECT(segment.span.start < segment.span.end);
    }
    end = segment.span.end;
    appendSegment(filled, segment);
  }
  if (duration > end + kRoundingGap) appendSegment(filled, {.span = {end, duration}});
  return filled;
}

Seconds lentBy(const PhoneSegment& segment) { return std::min(kLentSilence, kLentShare * segment.span.duration()); }

/// The silence at the start and the end that SpeechLabels promises, taken from the outer phones.
std::vector<PhoneSegment> withSilentEnds(const std::vector<PhoneSegment>& segments) {
  std::vector<PhoneSegment> out;
  for (const PhoneSegment& segment : segments) {
    if (out.empty() && !isSilence(segment)) {
      const Seconds start = segment.span.start;
      out.push_back({.span = {start, start + lentBy(segment)}});
      out.push_back(segment);
      out.back().span.start = out.front().span.end;
    } else {
      out.push_back(segment);
    }
  }
  if (!isSilence(out.back())) {
    const Seconds end = out.back().span.end;
    out.back().span.end -= lentBy(out.back());
    out.push_back({.span = {out.back().span.end, end}});
  }
  return out;
}

class LabelsBuilder {
 public:
  LabelsBuilder(std::vector<PhoneSegment> segments, const std::vector<std::string>& words, const Language& language)
      : segments_(std::move(segments)), words_(words), language_(language) {}

  SpeechLabels build() {
    for (const PhoneSegment& segment : segments_) {
      labels_.phones.push_back(
          {.phone = segment.phone, .span = segment.span, .word = {}, .syllable = {}, .ipa = segment.ipa});
    }
    for (std::size_t begin = 0; begin < segments_.size();) {
      const std::size_t end = endOfWordStretch(begin);
      if (!isSilence(segments_[begin])) addStretch(begin, end);
      begin = end;
    }
    return std::move(labels_);
  }

 private:
  /// The end of the phones from `begin` that share its word and have no silence between them.
  [[nodiscard]] std::size_t endOfWordStretch(std::size_t begin) const {
    std::size_t end = begin + 1;
    if (isSilence(segments_[begin])) return end;
    while (end < segments_.size() && !isSilence(segments_[end]) && segments_[end].word == segments_[begin].word) ++end;
    return end;
  }

  void addStretch(std::size_t begin, std::size_t end) {
    addToWord(begin, end);
    if (segments_[begin].syllable) {
      addGivenSyllables(begin, end);
    } else {
      addFoundSyllables(begin, end);
    }
  }

  void addToWord(std::size_t begin, std::size_t end) {
    const auto& word = segments_[begin].word;
    if (!word) return;
    MOUTHPIECE_EXPECT(*word < words_.size());
    if (last_word_ != word) labels_.words.push_back({words_[*word], {PhoneIndex(begin), PhoneIndex(begin)}});
    last_word_ = word;
    labels_.words.back().phones.last = PhoneIndex(end - 1);
    for (std::size_t i = begin; i < end; ++i) labels_.phones[i].word = labels_.words.size() - 1;
  }

  void addSyllable(std::size_t begin, std::size_t end, int stress_if_unknown) {
    int stress = stress_if_unknown;
    bool is_from_vowel = false;
    for (std::size_t i = begin; i < end; ++i) {
      labels_.phones[i].syllable = labels_.syllables.size();
      if (!segments_[i].stress || is_from_vowel) continue;
      stress = *segments_[i].stress;
      is_from_vowel = isVowel(segments_[i].phone);
    }
    labels_.syllables.push_back({{PhoneIndex(begin), PhoneIndex(end - 1)}, stress});
  }

  void addGivenSyllables(std::size_t begin, std::size_t end) {
    while (begin < end) {
      std::size_t next = begin + 1;
      while (next < end && segments_[next].syllable == segments_[begin].syllable) ++next;
      addSyllable(begin, next, 0);
      begin = next;
    }
  }

  void addFoundSyllables(std::size_t begin, std::size_t end) {
    std::vector<Phone> phones;
    bool stress_is_known = false;
    for (std::size_t i = begin; i < end; ++i) {
      phones.push_back(segments_[i].phone);
      stress_is_known = stress_is_known || segments_[i].stress.has_value();
    }
    const auto syllables = syllabify(phones, language_);
    const std::size_t stressed = likelyStressedSyllable(phones, syllables, language_);
    for (std::size_t s = 0; s < syllables.size(); ++s) {
      const std::size_t first = begin + syllables[s].first;
      addSyllable(first, first + syllables[s].count, !stress_is_known && s == stressed ? 1 : 0);
    }
  }

  std::vector<PhoneSegment> segments_;
  const std::vector<std::string>& words_;
  const Language& language_;
  SpeechLabels labels_;
  std::optional<std::size_t> last_word_;
};

}  // namespace

SpeechLabels buildSpeechLabels(std::vector<PhoneSegment> segments, const std::vector<std::string>& words,
                               Seconds duration, const Language& language) {
  const std::vector<PhoneSegment> filled = withoutGaps(segments, duration);
  MOUTHPIECE_EXPECT(!filled.empty());
  SpeechLabels labels = LabelsBuilder(withSilentEnds(filled), words, language).build();
  expectConsistent(labels);
  return labels;
}

SpeechLabels buildSpeechLabels(std::vector<PhoneSegment> segments, const std::vector<WordSegment>& words,
                               Seconds duration, const Language& language) {
  std::vector<std::string> texts;
  for (const WordSegment& word : words) texts.push_back(word.text);
  std::size_t w = 0;
  for (PhoneSegment& segment : segments) {
    const Seconds middle = segment.span.middle();
    while (w < words.size() && words[w].span.end <= middle) ++w;
    if (w < words.size() && words[w].span.contains(middle) && !isSilence(segment)) segment.word = w;
  }
  return buildSpeechLabels(std::move(segments), texts, duration, language);
}

void appendSpeechLabels(SpeechLabels& line, const SpeechLabels& next) {
  MOUTHPIECE_EXPECT(!line.phones.empty() && !next.phones.empty());
  const Seconds offset = line.duration() - next.phones.front().span.start;
  const std::size_t phone_offset = line.phones.size() - 1;  // the first silence of `next` joins the last of `line`
  const auto moved = [&](PhoneRange range) {
    return PhoneRange{PhoneIndex(range.first.value + phone_offset), PhoneIndex(range.last.value + phone_offset)};
  };
  line.phones.back().span.end = next.phones.front().span.end + offset;
  for (std::size_t i = 1; i < next.phones.size(); ++i) {
    LabelledPhone phone = next.phones[i];
    phone.span = {line.phones.back().span.end, phone.span.end + offset};
    if (phone.word) *phone.word += line.words.size();
    if (phone.syllable) *phone.syllable += line.syllables.size();
    line.phones.push_back(phone);
  }
  for (const LabelledWord& word : next.words) line.words.push_back({word.text, moved(word.phones)});
  for (const auto& syllable : next.syllables) line.syllables.push_back({moved(syllable.phones), syllable.stress});
}

}  // namespace mouthpiece
