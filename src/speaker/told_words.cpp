#include "speaker/told_words.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>

#include "audio/audio_clip.h"
#include "base/errors.h"
#include "base/index.h"
#include "hearing/alignment/forced_alignment.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

constexpr double kRateHz = SamplesToHear::kRateHz;
constexpr Seconds kMostKept = 60;
/// So long ago a word that is aligned with the next begins at most, and so much sound around them is heard.
constexpr Seconds kTogether = 4, kBefore = 0.5, kAfter = 0.02;

struct Told {
  std::vector<TranscriptWord> words;
  TimeSpan span;
};

}  // namespace

struct ToldWords::State {
  State(int sample_rate_hz, const Language& language)
      : resampler(sample_rate_hz, SamplesToHear::kRateHz), aligner({}, language) {}

  [[nodiscard]] Seconds begin() const { return asReal(dropped) / kRateHz; }
  [[nodiscard]] AudioClip soundIn(const TimeSpan& span) const {
    const auto sampleAt = [&](Seconds time) {
      return signedIndex(std::min(kept.size(), static_cast<std::size_t>(std::max(0.0, time - begin()) * kRateHz)));
    };
    return {SamplesToHear::kRateHz, {kept.begin() + sampleAt(span.start), kept.begin() + sampleAt(span.end)}};
  }

  LiveResampler resampler;
  ForcedAligner aligner;
  std::vector<float> kept;
  std::uint64_t dropped = 0;  ///< samples before `kept`
  std::deque<Told> told;      ///< the last ones
};

ToldWords::ToldWords(int sample_rate_hz, const Language& language)
    : state_(std::make_unique<State>(sample_rate_hz, language)) {}
ToldWords::~ToldWords() = default;

void ToldWords::push(std::span<const float> samples) {
  constexpr auto kMost = static_cast<std::size_t>(kMostKept * kRateHz);
  std::vector<float> usable(samples.begin(), samples.end());
  for (float& sample : usable) sample = std::isnan(sample) ? 0.0F : std::clamp(sample, -1.0F, 1.0F);
  state_->resampler.push(usable, state_->kept);
  std::vector<float>& kept = state_->kept;
  if (kept.size() <= kMost) return;
  const std::size_t gone = kept.size() - kMost / 2;
  kept.erase(kept.begin(), kept.begin() + signedIndex(gone));
  state_->dropped += gone;
}

std::vector<PhoneSegment> ToldWords::phonesOf(const std::vector<TranscriptWord>& words, const TimeSpan& span,
                                              std::size_t first_word) {
  std::deque<Told>& told = state_->told;
  const Seconds come = state_->begin() + asReal(state_->kept.size()) / kRateHz;
  if (words.empty() || span.start < state_->begin() || span.end > come + kAfter) return {};
  if (!told.empty() && span.start < told.back().span.start) told.clear();  // told once more
  while (!told.empty() && told.front().span.start < std::max(state_->begin(), span.end - kTogether)) told.pop_front();
  std::vector<TranscriptWord> together;
  for (const Told& each : told) together.insert(together.end(), each.words.begin(), each.words.end());
  const std::size_t before = together.size();
  together.insert(together.end(), words.begin(), words.end());
  told.push_back({words, span});
  std::vector<PhoneSegment> segments;
  try {
    const SpeechLabels labels = state_->aligner.labelsOf(
        state_->soundIn({told.front().span.start - kBefore, span.end + kAfter}), together, "a word");
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
