#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// One note of a syllable; a syllable tied over several notes (melisma) has several.
struct SongNote {
  double midi_pitch = 60;  ///< 60 is middle C, 69 is A4 = 440 Hz; fractions are cents
  double beats = 1;
  bool vibrato = false;
};

/// A word of the lyrics: its syllables' notes in order, and the rest after it.
struct SongWord {
  std::string text;  ///< letters and apostrophes, lower case
  std::vector<std::vector<SongNote>> syllables;
  double rest_beats = 0;
};

/// One voice with lyrics (docs/formats/song.md).
struct Song {
  std::string title;
  double beats_per_minute = 100;
  double first_rest_beats = 0;
  std::vector<SongWord> words;

  [[nodiscard]] Seconds secondsOf(double beats) const { return beats * 60 / beats_per_minute; }
  [[nodiscard]] Seconds duration() const;
  /// The words with blanks between.
  [[nodiscard]] std::string lyrics() const;
};

double hzOfMidiPitch(double midi_pitch);
/// "C4" is 60, "F#3", "Bb4", "A4+20" (cents). Throws InputError.
double midiPitchFromName(std::string_view name, std::string_view file, std::string_view place);

/// Reads a song from song.json, or MusicXML (.musicxml .xml: one voice with lyrics; .mxl is not read). Throws
/// InputError naming file and place.
Song readSong(const std::filesystem::path& path);
Song parseSongJson(std::string_view bytes, std::string_view name);
Song parseMusicXml(std::string_view bytes, std::string_view name);

/// Throws InputError for what cannot be sung: no words, pitches or lengths out of range, too long.
void checkSong(const Song& song, std::string_view name);

}  // namespace mouthpiece
