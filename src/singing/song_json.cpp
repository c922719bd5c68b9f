#include "base/json_fields.h"
#include "base/text_encoding.h"
#include "singing/song_builder.h"

namespace mouthpiece {
namespace {

/// {"pitch": "C4", "beats": 1, "tie": true, "vibrato": true}: a tied note goes on with the syllable before it.
void readNote(const JsonField& entry, bool is_first, SongBuilder& song) {
  const auto flag = [&](std::string_view key) { return entry[key].exists() && entry[key].flag(); };
  const JsonField pitch = entry["pitch"];
  const double midi_pitch =
      pitch.isText() ? midiPitchFromName(pitch.text(), pitch.file(), pitch.path()) : pitch.number();
  if (!flag("tie")) {
    song.beginSyllable();
  } else if (is_first) {
    entry.fail("is tied to no note before it; expected a first note");
  }
  song.addNote(midi_pitch, entry["beats"].number(0), flag("vibrato"));
}

/// {"rest": 2}, or {"word": "morning", "notes": [...]}.
void readEntry(const JsonField& entry, SongBuilder& song) {
  if (entry["rest"].exists()) return song.addRest(entry["rest"].number(0));
  song.beginWord();
  song.addText(lowerCase(entry["word"].text()));
  const std::vector<JsonField> notes = entry["notes"].list();
  for (const JsonField& note : notes) readNote(note, &note == &notes.front(), song);
}

}  // namespace

Song parseSongJson(std::string_view bytes, std::string_view name) {
  const JsonField root = parseJson(bytes, name, "a song");
  SongBuilder song;
  if (const JsonField title = root["title"]; title.exists()) song.title = title.text();
  if (const JsonField tempo = root["tempo"]; tempo.exists()) song.beats_per_minute = tempo.number();
  for (const JsonField& entry : root["words"].list()) readEntry(entry, song);
  return song.song(name);
}

}  // namespace mouthpiece
