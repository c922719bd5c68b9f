#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "singing/song.h"

namespace mouthpiece {
namespace {

using nlohmann::json;

constexpr int kDeepest = 16;

/// Reads the fields of song.json; every complaint names the place.
class SongReader {
 public:
  SongReader(const json& root, std::string_view name) : root_(root), name_(name) {}

  Song read() {
    if (!root_.is_object()) fail("", "found no object; expected a song");
    Song song;
    if (root_.contains("title")) song.title = text(root_, "title", "title");
    song.beats_per_minute = root_.contains("tempo") ? number(root_, "tempo", "tempo") : song.beats_per_minute;
    const json& words = list(root_, "words", "words");
    for (std::size_t i = 0; i < words.size(); ++i) readEntry(words[i], fmt::format("words[{}]", i), song);
    checkSong(song, name_);
    return song;
  }

 private:
  [[noreturn]] void fail(std::string_view place, std::string_view what) const { throw InputError(name_, place, what); }

  const json& field(const json& object, const char* key, const std::string& place) const {
    if (!object.is_object() || !object.contains(key)) fail(place, fmt::format("has no '{}'; expected one", key));
    return object.at(key);
  }
  double number(const json& object, const char* key, const std::string& place) const {
    const json& value = field(object, key, place);
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      fail(place, fmt::format("'{}' is no number; expected one", key));
    return value.get<double>();
  }
  std::string text(const json& object, const char* key, const std::string& place) const {
    const json& value = field(object, key, place);
    if (!value.is_string()) fail(place, fmt::format("'{}' is no text; expected text", key));
    return value.get<std::string>();
  }
  const json& list(const json& object, const char* key, const std::string& place) const {
    const json& value = field(object, key, place);
    if (!value.is_array()) fail(place, fmt::format("'{}' is no list; expected a list", key));
    return value;
  }

  /// {"rest": 2}, or {"word": "morning", "notes": [...]}.
  void readEntry(const json& entry, const std::string& place, Song& song) const {
    if (entry.is_object() && entry.contains("rest")) {
      const double beats = number(entry, "rest", place);
      if (!(beats >= 0)) fail(place, fmt::format("rests {:g} beats; expected 0 or more", beats));
      (song.words.empty() ? song.first_rest_beats : song.words.back().rest_beats) += beats;
      return;
    }
    SongWord word;
    word.text = lowerCase(text(entry, "word", place));
    const json& notes = list(entry, "notes", place);
    for (std::size_t i = 0; i < notes.size(); ++i) readNote(notes[i], fmt::format("{}.notes[{}]", place, i), word);
    song.words.push_back(std::move(word));
  }

  /// {"pitch": "C4", "beats": 1, "tie": true, "vibrato": true}: a tied note goes on with the syllable before it.
  void readNote(const json& entry, const std::string& place, SongWord& word) const {
    SongNote note;
    const json& pitch = field(entry, "pitch", place);
    note.midi_pitch =
        pitch.is_string() ? midiPitchFromName(pitch.get<std::string>(), name_, place) : number(entry, "pitch", place);
    note.beats = number(entry, "beats", place);
    note.vibrato = flag(entry, "vibrato", place);
    const bool is_tied = flag(entry, "tie", place);
    if (is_tied && word.syllables.empty()) fail(place, "is tied to no note before it; expected a first note");
    if (!is_tied) word.syllables.emplace_back();
    word.syllables.back().push_back(note);
  }

  bool flag(const json& object, const char* key, const std::string& place) const {
    if (!object.contains(key)) return false;
    if (!object.at(key).is_boolean()) fail(place, fmt::format("'{}' is neither true nor false", key));
    return object.at(key).get<bool>();
  }

  static std::string lowerCase(std::string word) {
    for (char& c : word) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    return word;
  }

  const json& root_;
  std::string_view name_;
};

}  // namespace

Song parseSongJson(std::string_view bytes, std::string_view name) {
  bool is_too_deep = false;
  const auto watch = [&](int depth, json::parse_event_t, json&) {
    is_too_deep |= depth > kDeepest;
    return depth <= kDeepest;
  };
  const json root = json::parse(bytes, watch, false);
  if (root.is_discarded() || is_too_deep)
    throw InputError(name, "", "is no JSON that a song is written in; expected an object");
  return SongReader(root, name).read();
}

}  // namespace mouthpiece
