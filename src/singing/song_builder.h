#pragma once

#include <string>
#include <string_view>

#include "singing/song.h"

namespace mouthpiece {

/// Puts a song together from what a reader finds in it, in the order in which it is sung. Lengths are in beats; nothing
/// is checked before the song is whole.
class SongBuilder {
 public:
  std::string title;
  double beats_per_minute = 100;

  /// Before its syllables; `text` may grow by and by.
  void beginWord() { song_.words.emplace_back(); }
  void addText(std::string_view text) { song_.words.back().text += text; }
  void beginSyllable() { song_.words.back().syllables.emplace_back(); }
  /// Of the last syllable.
  void addNote(double midi_pitch, double beats, bool vibrato);
  /// Makes the last note longer where it has that pitch, and is another one else.
  void tieNote(double midi_pitch, double beats, bool vibrato);
  /// Makes the last note longer.
  void lengthenNote(double beats);
  void addRest(double beats) { song_.duration += beats; }

  [[nodiscard]] bool hasWords() const { return !song_.words.empty(); }
  /// Whether a rest came after the last note.
  [[nodiscard]] bool isResting() const { return !hasWords() || song_.words.back().end() < song_.duration; }

  /// The song on the clock. Throws InputError, with `name` in front, for what cannot be sung.
  [[nodiscard]] Song song(std::string_view name) const;

 private:
  Song song_;  ///< with beats for seconds
};

}  // namespace mouthpiece
