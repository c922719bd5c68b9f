#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_tags.h"
#include "base/time.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// What is sung on one vowel: a note, or several that are tied (melisma), each from where the one before it ends.
struct Syllable {
  std::vector<Note> notes;
};

/// A word of the lyrics. Its syllables follow each other without a rest.
struct SongWord {
  std::string text;  ///< letters and apostrophes, lower case; or kana
  std::vector<Syllable> syllables;
  Pronunciation said{};  ///< of kana; no phones: the voice knows

  [[nodiscard]] TimeSpan span() const { return {syllables.front().notes.front().span.start, end()}; }
  [[nodiscard]] Seconds end() const { return syllables.back().notes.back().span.end; }
};

/// One voice with lyrics, on the clock of the sound that it becomes (docs/formats/song.md). What lies between words is
/// rest.
struct Song {
  std::string title;
  std::vector<SongWord> words;
  Seconds duration = 0;  ///< with the rest after the last word

  /// The words with blanks between.
  [[nodiscard]] std::string lyrics() const;
  /// The notes of all words, in order.
  [[nodiscard]] std::vector<Note> notes() const;
};

/// The frequency of a pitch that MIDI counts: 60 is middle C, 69 is A4 = 440 Hz; fractions are cents.
double hzOfMidiPitch(double midi_pitch);
/// "C4" is 60, "F#3", "Bb4", "A4+20" (cents). Throws InputError.
double midiPitchFromName(std::string_view name, std::string_view file, std::string_view place);

/// Throws InputError, with `name` in front, for what cannot be sung: no words, words that are neither letters and
/// apostrophes nor kana, pitches or lengths out of range, notes that do not follow each other, too long.
void checkSong(const Song& song, std::string_view name);

/// The song with as many syllables in each word as a voice gives it: of notes for too many the last syllable takes the
/// rest, and the last note is parted into what is lacking. `counts`: one a word; 0 counts as 1.
Song withSyllables(Song song, std::span<const std::size_t> counts);

/// A kind of file that songs are written in. `parse` throws InputError, with `name` in front.
struct SongFormat {
  std::string_view ending;
  std::string_view what;
  Song (*parse)(std::string_view bytes, std::string_view name);
};
/// All that readSong reads, the one that other endings stand for first.
std::span<const SongFormat> songFormats();

/// Reads a song by the ending of its name, MIDI by its first bytes and JSON by its brace. Throws InputError naming file
/// and place.
Song readSong(const std::filesystem::path& path);

Song parseSongJson(std::string_view bytes, std::string_view name);
/// One voice with lyrics of a score-partwise.
Song parseMusicXml(std::string_view bytes, std::string_view name);
/// The same in a ZIP archive (.mxl).
Song parsePackedMusicXml(std::string_view bytes, std::string_view name);
/// The melody of a standard MIDI file (format 0 or 1) and the lyrics on its notes. Words are told from syllables by
/// blanks and slashes, as karaoke has them, or else by hyphens, as rhythm games have them.
Song parseMidi(std::string_view bytes, std::string_view name);
/// UTAU's project: a syllable a note; a lyric of + or - goes on with the word before.
Song parseUst(std::string_view bytes, std::string_view name);
/// Subtitles (SubRip): their words on one note, each for as long as its letters are many.
Song parseSubtitleSong(std::string_view bytes, std::string_view name);

}  // namespace mouthpiece
