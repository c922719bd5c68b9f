#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "voices/voice.h"

namespace mouthpiece {

/// A tone held for a while; a syllable with several is a melisma.
struct SungTone {
  double hz = 0;
  Seconds duration = 0;
  bool vibrato = false;
};

/// A word to sing: the tones of each of its syllables, and the rest after it.
struct SungWord {
  std::string text;  ///< letters and apostrophes
  std::vector<std::vector<SungTone>> syllables;
  Seconds rest = 0;
};

/// A tone as it was sung, on the clock of the sound.
struct TimedTone {
  TimeSpan span;
  double hz = 0;
  bool vibrato = false;
};

/// A song as the voice sang it.
struct SungLine {
  SpokenLine line;               ///< sound and labels, as of speech
  std::vector<TimedTone> tones;  ///< as they were written
};

/// What the voice adds to a tone with vibrato: grows over the first part of the tone.
struct SungVibrato {
  double rate_hz = 6.2;
  double depth_semitones = 0.5;  ///< half of peak to peak
  Seconds delay = 0.15;
};

struct SingingOptions {
  const Lexicon* lexicon = nullptr;  ///< pronunciations that go before Festival's; kept alive by the caller
  SungVibrato vibrato;
};

/// Sings through Festival's singing mode with kal (docs/formats/song.md). A word with more syllables than tones parts
/// its last one; with fewer, the last syllable takes the tones left. Throws InputError when Festival or the voice is
/// not installed, or the song cannot be sung.
SungLine singWords(const std::vector<SungWord>& words, Seconds first_rest, const SingingOptions& options = {});

}  // namespace mouthpiece
