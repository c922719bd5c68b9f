#pragma once

#include <optional>
#include <string>
#include <vector>

#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// A phone as a label file or a voice gives it, before it is part of consistent SpeechLabels.
struct PhoneSegment {
  Phone phone = Phone::kSil;
  TimeSpan span;
  std::optional<std::size_t> word = std::nullopt;      ///< index into `words`; ignored for silence
  std::optional<std::size_t> syllable = std::nullopt;  ///< any number, the same for phones side by side in a syllable
  std::optional<int> stress = std::nullopt;            ///< of the syllable: 0, 1, 2; given with its vowel
  std::string ipa{};                                   ///< LabelledPhone::ipa
};

/// A word of a words tier.
struct WordSegment {
  std::string text;
  TimeSpan span;
};

/// Makes labels that keep every promise of SpeechLabels:
/// - gaps between segments and before the first become silence, `duration` (if later) is filled with silence;
/// - neighbouring silences are merged;
/// - a line that starts or ends without silence gives up to 20 ms, at most a quarter, of its first or last phone to it;
/// - syllables that are not given are found by maximal onset within each word, split at silence; a syllable without a
///   known stress has 1 where it is the likeliest of its word, else 0;
/// - words without phones are left out.
/// Segments rise in time, do not overlap and last longer than zero (checked by whoever read them: InternalError).
SpeechLabels buildSpeechLabels(std::vector<PhoneSegment> segments, const std::vector<std::string>& words,
                               Seconds duration, const Language& language = english());

/// Gives each phone that is not silence the word that holds its middle, then builds. Words rise in time without
/// overlaps.
SpeechLabels buildSpeechLabels(std::vector<PhoneSegment> segments, const std::vector<WordSegment>& words,
                               Seconds duration, const Language& language = english());

/// `next` said after `line`: its times are moved by the duration of `line`; the two silences that meet become one.
void appendSpeechLabels(SpeechLabels& line, const SpeechLabels& next);

}  // namespace mouthpiece
