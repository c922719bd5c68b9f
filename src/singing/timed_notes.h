#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"
#include "singing/song.h"

namespace mouthpiece {

/// A note of a file that says when each begins, with what is sung on it.
struct TimedNote {
  TimeSpan span;
  double midi_pitch = 60;
  std::string text;      ///< as it is written; what has no letters goes on with the syllable before (a melisma)
  bool goes_on = false;  ///< its syllable belongs to the word before
  bool vibrato = false;
};

/// The song of notes in any order: of several at once the first counts, one that runs into the next is cut, and gaps
/// within a word are sung through. Throws InputError, with `name` in front, for what cannot be sung.
Song songOf(std::vector<TimedNote> notes, std::string_view title, std::string_view name);

/// The kana of a lyric, or else its A to Z and apostrophes in lower case; an accent is left out.
std::string wordLetters(std::string_view text);
/// The same. Throws InputError, with `name` and `place` in front, for ideographs, whose reading nobody tells, and
/// for other alphabets.
std::string wordLetters(std::string_view text, std::string_view name, std::string_view place);

}  // namespace mouthpiece
