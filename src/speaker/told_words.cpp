#include "speaker/told_words.h"

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr double kRateHz = SamplesToHear::kRateHz;
constexpr Seconds kMostKept = 60;
/// So long ago a word that is aligned with the next begins at most, and so much sound around them is heard.
constexpr Seconds kTogether = 4, kBefore = 0.5, kAfter = 0.02;

}  // namespace

void ToldWords::push(std::span<const float> samples) {
  constexpr auto kMost = static_cast<std::size_t>(kMostKept * kRateHz);
  std::vector<float> usable(samples.begin(), samples.end());
  for (float& sample : usable) sample = std::isnan(sample) ? 0.0F : std::clamp(sample, -1.0F, 1.0F);
  resampler_.push(usable, kept_);
  if (kept_.size() <= kMost) return;
  const std::size_t gone = kept_.size() - kMost / 2;
  kept_.erase(kept_.begin(), kept_.begin() + signedIndex(gone));
  dropped_ += gone;
}

AudioClip ToldWords::soundIn(const TimeSpan& span) const {
  const auto sampleAt = [&](Seconds time) {
    return signedIndex(std::min(kept_.size(), static_cast<std::size_t>(std::max(0.0, time - begin()) * kRateHz)));
  };
  return {SamplesToHear::kRateHz, {kept_.begin() + sampleAt(span.start), kept_.begin() + sampleAt(span.end)}};
}

std::vector<PhoneSegment> ToldWords::phonesOf(const std::vector<TranscriptWord>& words, const TimeSpan& span,
                                              std::size_t first_word) {
  const Seconds come = begin() + asReal(kept_.size()) / kRateHz;
  if (words.empty() || span.start < begin() || span.end > come + kAfter) return {};
  while (!told_.empty() && told_.front().span.start < std::max(begin(), span.end - kTogether)) told_.pop_front();
  std::vector<TranscriptWord> together;
  for (const Told& told : told_) together.insert(together.end(), told.words.begin(), told.words.end());
  const std::size_t before = together.size();
  together.insert(together.end(), words.begin(), words.end());
  told_.push_back({words, span});
  std::vector<PhoneSegment> segments;
  try {
    const SpeechLabels labels =
        aligner_.align(soundIn({told_.front().span.start - kBefore, span.end + kAfter}), together, "a word").labels;
    for (const LabelledPhone& phone : labels.phones) {
      if (phone.phone == Phone::kSil || !phone.word || *phone.word < before) continue;
      PhoneSegment segment{.phone = phone.phone, .span = phone.span, .word = first_word + *phone.word - before};
      if (phone.syllable && isVowel(phone.phone)) segment.stress = labels.syllables[*phone.syllable].stress;
      segments.push_back(segment);
    }
  } catch (const InputError&) {  // it is not heard there
  }
  if (segments.empty()) return {};
  // Who told the word knows when it begins and ends.
  const TimeSpan found{segments.front().span.start, segments.back().span.end};
  for (PhoneSegment& segment : segments) {
    for (Seconds* time : {&segment.span.start, &segment.span.end})
      *time = std::lerp(span.start, span.end, (*time - found.start) / found.duration());
  }
  return segments;
}

}  // namespace mouthpiece
