#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_tags.h"
#include "phonetics/text/lexicon.h"
#include "singing/song.h"
#include "voices/voice.h"

namespace mouthpiece {

/// A song ready to be animated: how it sounds and what is heard, or was written, in it.
struct SungLine {
  SpokenLine line;
  AudioTags tags;
  std::vector<std::string> warnings;   ///< what makes the tags doubtful
  std::vector<std::string> notices{};  ///< what is worth telling and no doubt
};

/// What a voice adds to a note with vibrato: it comes after a delay and grows.
struct SungVibrato {
  double rate_hz = 6.2;
  double depth_semitones = 0.5;  ///< half of peak to peak
  Seconds delay = 0.15;
};

struct SingingOptions {
  std::string_view voice;            ///< of sungVoices(); "": the first
  const Lexicon* lexicon = nullptr;  ///< pronunciations that go before the voice's own; kept alive by the caller
  SungVibrato vibrato = {};
};

/// A voice that sings. `sing` throws InputError when what it needs is not installed, or a word cannot be sung; tags are
/// the notes and vibrato that were written.
struct SungVoice {
  std::string_view name;
  std::string_view what;
  SungLine (*sing)(const Song& song, const SingingOptions& options);
};
/// All that singSong knows, the usual one first.
std::span<const SungVoice> sungVoices();

/// Sings a song (docs/formats/song.md). Throws InputError.
SungLine singSong(const Song& song, const SingingOptions& options = {});

/// What is heard in a recorded song whose labels are known.
SungLine hearSong(SpokenLine line);

/// Festival's singing mode with the voice kal. A word with more syllables than notes parts its last note; with fewer,
/// the last syllable takes the notes left.
SungLine singWithFestival(const Song& song, const SingingOptions& options);

/// What that mode reads: one frequency and length a note, a row of short ones where there is vibrato. The words have
/// Festival's own count of syllables.
std::string festivalSingingXml(const Song& song, const SungVibrato& vibrato);

}  // namespace mouthpiece
