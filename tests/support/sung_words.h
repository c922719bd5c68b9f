#pragma once

#include <string>
#include <vector>

#include "singing/song.h"

namespace mouthpiece::samples {

/// A note by its length alone: it begins where the one before ends.
struct HeldNote {
  double hz;
  Seconds length;
  bool vibrato = false;
};

/// A song written down word after word.
class SungWords {
 public:
  SungWords& word(std::string text, const std::vector<std::vector<HeldNote>>& syllables) {
    SongWord& word = song_.words.emplace_back();
    word.text = std::move(text);
    for (const std::vector<HeldNote>& notes : syllables) {
      Syllable& syllable = word.syllables.emplace_back();
      for (const HeldNote& note : notes) {
        const Seconds start = song_.duration;
        song_.duration += note.length;
        syllable.notes.push_back({{start, song_.duration}, note.hz, note.vibrato});
      }
    }
    return *this;
  }
  SungWords& rest(Seconds length) {
    song_.duration += length;
    return *this;
  }
  [[nodiscard]] const Song& song() const { return song_; }

 private:
  Song song_;
};

}  // namespace mouthpiece::samples
