#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "mouthpiece/labels.h"

namespace mouthpiece {

struct Language;
struct PhoneSegment;
struct TranscriptWord;

/// The last half a minute to a minute of a sound whose words and their times are told: when each phone of a word is
/// said. A word is aligned with those of the seconds before it, as in a file: alone it has too little sound to tell how
/// the room sounds.
class ToldWords {
 public:
  ToldWords(int sample_rate_hz, const Language& language);
  ToldWords(const ToldWords&) = delete;
  ToldWords& operator=(const ToldWords&) = delete;
  ~ToldWords();

  /// Sound that follows what came before, in [-1, 1]; what is no number is silence.
  void push(std::span<const float> samples);
  /// The phones of `words`, numbered from `first_word` on, which are said within `span`; none where its sound has not
  /// come, or does not hold them.
  std::vector<PhoneSegment> phonesOf(const std::vector<TranscriptWord>& words, const TimeSpan& span,
                                     std::size_t first_word);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace mouthpiece
