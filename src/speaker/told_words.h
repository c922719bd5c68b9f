#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "audio/audio_clip.h"
#include "base/time.h"
#include "hearing/alignment/forced_alignment.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {

/// The last minute of a sound whose words and their times are told: when each phone of a word is said. A word is
/// aligned with those of the seconds before it, as in a file: alone it has too little sound to tell how the room
/// sounds.
class ToldWords {
 public:
  ToldWords(int sample_rate_hz, const Language& language)
      : resampler_(sample_rate_hz, SamplesToHear::kRateHz), aligner_({}, language) {}

  /// Sound that follows what came before, in [-1, 1]; what is no number is silence.
  void push(std::span<const float> samples);
  /// The phones of `words`, numbered from `first_word` on, which are said within `span`; none where its sound has not
  /// come, or does not hold them.
  std::vector<PhoneSegment> phonesOf(const std::vector<TranscriptWord>& words, const TimeSpan& span,
                                     std::size_t first_word);

 private:
  struct Told {
    std::vector<TranscriptWord> words;
    TimeSpan span;
  };

  [[nodiscard]] Seconds begin() const { return asReal(dropped_) / SamplesToHear::kRateHz; }
  [[nodiscard]] AudioClip soundIn(const TimeSpan& span) const;

  LiveResampler resampler_;
  ForcedAligner aligner_;
  std::vector<float> kept_;
  std::uint64_t dropped_ = 0;  ///< samples before `kept_`
  std::deque<Told> told_;      ///< the last ones
};

}  // namespace mouthpiece
