#include "singing/timed_notes.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "base/unicode.h"
#include "singing/kana_lyrics.h"
#include "singing/song_builder.h"

namespace mouthpiece {
namespace {

/// What is shorter than this is no note of a voice, but a slip of the file.
constexpr Seconds kShortest = 0.02;

}  // namespace

std::string wordLetters(std::string_view text) {
  std::string letters = kanaOf(text);
  if (!letters.empty()) return letters;
  for (const char c : lowerCase(toAscii(text))) {
    if ((c >= 'a' && c <= 'z') || c == '\'') letters += c;
  }
  return letters;
}

std::string wordLetters(std::string_view text, std::string_view name, std::string_view place) {
  if (hasIdeographs(text))
    throw InputError(name, place, fmt::format("found the lyric '{}'; expected it in kana", printable(text, 60)));
  if (hasKanaSigns(text)) return wordLetters(text);
  const std::string plain = toAscii(text);
  for (std::size_t at = 0; at < plain.size();) {
    const auto sign = decodeUtf8(plain, at);
    if (sign && *sign >= 0x80 && isWordSign(*sign))
      throw InputError(name, place,
                       fmt::format("found the lyric '{}'; expected Latin letters or kana", printable(text, 60)));
  }
  return wordLetters(plain);
}

Song songOf(std::vector<TimedNote> notes, std::string_view title, std::string_view name) {
  std::stable_sort(notes.begin(), notes.end(),
                   [](const TimedNote& a, const TimedNote& b) { return a.span.start < b.span.start; });
  std::vector<TimedNote> sung;
  for (TimedNote& note : notes) {
    if (!sung.empty()) {
      Seconds& end = sung.back().span.end;
      if (note.span.start - sung.back().span.start < kShortest) continue;  // of a chord, or a double
      end = std::min(end, note.span.start);
    }
    if (note.span.duration() >= kShortest) sung.push_back(std::move(note));
  }
  SongBuilder song;
  song.title = title;
  song.beats_per_minute = 60;  // a beat is a second
  Seconds sung_until = 0;
  // Notes without any text behind a pause are another instrument's, until the next word.
  constexpr Seconds kPause = 0.3;
  bool is_played = false;
  const auto isBehindPause = [&](std::size_t i) {
    return i > 0 && trimmed(sung[i].text).empty() && sung[i].span.start - sung[i - 1].span.end > kPause;
  };
  for (std::size_t i = 0; i < sung.size(); ++i) {
    const TimedNote& note = sung[i];
    is_played = trimmed(note.text).empty() && (is_played || isBehindPause(i));
    if (is_played) continue;
    const std::string letters = wordLetters(note.text, name, fmt::format("note at {:.2f} s", note.span.start));
    if (letters.find_first_not_of('\'') == std::string::npos && !song.hasWords()) continue;  // before any word
    if (note.span.start > sung_until) song.addRest(note.span.start - sung_until);
    if (letters.find_first_not_of('\'') != std::string::npos) {
      if (!note.goes_on || !song.hasWords()) song.beginWord();
      song.addText(letters);
      song.beginSyllable();
    }
    // The word is sung until its next syllable begins.
    const bool has_next = i + 1 < sung.size() && !isBehindPause(i + 1) &&
                          (sung[i + 1].goes_on || wordLetters(sung[i + 1].text).empty());
    sung_until = has_next ? sung[i + 1].span.start : note.span.end;
    song.addNote(note.midi_pitch, sung_until - note.span.start, note.vibrato);
  }
  return song.song(name);
}

}  // namespace mouthpiece
