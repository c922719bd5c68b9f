#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "phonetics/text/lexicon.h"
#include "audio/audio_tags.h"
#include "voices/voice.h"

namespace mouthpiece {

/// A song ready to be animated.
struct SungSource {
  SpokenLine line;
  AudioTags tags;
  std::vector<std::string> warnings;  ///< what makes them doubtful
};

/// Sings a song file (song.json or MusicXML; docs/formats/song.md). Notes and vibrato are those that were written.
/// Throws InputError.
SungSource singSong(const std::filesystem::path& path, const Lexicon* lexicon);

/// What is heard in a recorded song whose labels are known.
SungSource hearSong(SpokenLine line);

}  // namespace mouthpiece
