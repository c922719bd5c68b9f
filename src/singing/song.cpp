#include "singing/song.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostWords = 5000;
constexpr std::size_t kMostNotesOfSyllable = 100;
constexpr std::size_t kLongestWord = 40;
constexpr double kSlowest = 10, kFastest = 600;  // beats a minute
constexpr double kLowestPitch = 28, kHighestPitch = 96;
constexpr double kLongestBeats = 256;
constexpr Seconds kShortestNote = 0.02;
constexpr Seconds kLongestSong = 1800;
constexpr std::uint64_t kMostBytes = 16U << 20U;

bool isWordCharacter(char c) { return (c >= 'a' && c <= 'z') || c == '\''; }

void checkNote(const Song& song, const SongNote& note, std::string_view name, const std::string& place) {
  if (!(note.midi_pitch >= kLowestPitch && note.midi_pitch <= kHighestPitch)) {
    throw InputError(
        name, place,
        fmt::format("has pitch {:g}; expected {} to {} (E1 to C7)", note.midi_pitch, kLowestPitch, kHighestPitch));
  }
  if (!(note.beats > 0 && note.beats <= kLongestBeats) || song.secondsOf(note.beats) < kShortestNote) {
    throw InputError(name, place,
                     fmt::format("lasts {:g} beats; expected up to {}, and at least {} s", note.beats, kLongestBeats,
                                 kShortestNote));
  }
}

void checkRest(double beats, std::string_view name, const std::string& place) {
  if (beats >= 0 && beats <= kLongestBeats) return;
  throw InputError(name, place, fmt::format("rests {:g} beats; expected 0 to {}", beats, kLongestBeats));
}

void checkWord(const Song& song, std::size_t number, std::string_view name) {
  const SongWord& word = song.words[number];
  const std::string place = fmt::format("words[{}]", number);
  const bool has_letter = std::any_of(word.text.begin(), word.text.end(), [](char c) { return c != '\''; });
  if (!has_letter || word.text.size() > kLongestWord ||
      !std::all_of(word.text.begin(), word.text.end(), isWordCharacter)) {
    throw InputError(name, place,
                     fmt::format("found the word '{}'; expected letters a to z and '", printable(word.text, 50)));
  }
  if (word.syllables.empty() || word.syllables.size() > kLongestWord) {
    throw InputError(name, place,
                     fmt::format("has {} syllables; expected 1 to {}", word.syllables.size(), kLongestWord));
  }
  for (const auto& notes : word.syllables) {
    if (notes.empty() || notes.size() > kMostNotesOfSyllable) {
      throw InputError(name, place,
                       fmt::format("has a syllable of {} notes; expected 1 to {}", notes.size(), kMostNotesOfSyllable));
    }
    for (const SongNote& note : notes) checkNote(song, note, name, place);
  }
  checkRest(word.rest_beats, name, place);
}

}  // namespace

Seconds Song::duration() const {
  double beats = first_rest_beats;
  for (const SongWord& word : words) {
    for (const auto& notes : word.syllables) {
      for (const SongNote& note : notes) beats += note.beats;
    }
    beats += word.rest_beats;
  }
  return secondsOf(beats);
}

std::string Song::lyrics() const {
  std::string text;
  for (const SongWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

double hzOfMidiPitch(double midi_pitch) { return 440 * std::exp2((midi_pitch - 69) / 12); }

double midiPitchFromName(std::string_view name, std::string_view file, std::string_view place) {
  constexpr std::array<int, 7> kSteps{9, 11, 0, 2, 4, 5, 7};  // A to G, above C
  const auto fail = [&]() -> InputError {
    return InputError(
        file, place, fmt::format("found the pitch '{}'; expected one like C4, F#3, Bb4 or A4+20", printable(name, 20)));
  };
  if (name.size() < 2 || name.size() > 12 || name[0] < 'A' || name[0] > 'G') throw fail();
  double pitch = kSteps[static_cast<std::size_t>(name[0] - 'A')];
  std::size_t at = 1;
  for (; at < name.size() && (name[at] == '#' || name[at] == 'b'); ++at) pitch += name[at] == '#' ? 1 : -1;
  if (at >= name.size() || name[at] < '0' || name[at] > '9') throw fail();
  pitch += 12 * (name[at] - '0' + 1);
  const std::string_view cents_text = name.substr(at + 1);
  if (cents_text.empty()) return pitch;
  const auto cents = parseNumber(cents_text);
  if ((cents_text[0] != '+' && cents_text[0] != '-') || !cents || !(std::abs(*cents) <= 100)) throw fail();
  return pitch + *cents / 100;
}

void checkSong(const Song& song, std::string_view name) {
  if (!(song.beats_per_minute >= kSlowest && song.beats_per_minute <= kFastest)) {
    throw InputError(
        name, "tempo",
        fmt::format("is {:g} beats a minute; expected {} to {}", song.beats_per_minute, kSlowest, kFastest));
  }
  if (song.words.empty() || song.words.size() > kMostWords) {
    throw InputError(name, "words", fmt::format("holds {} words; expected 1 to {}", song.words.size(), kMostWords));
  }
  checkRest(song.first_rest_beats, name, "rest_beats");
  for (std::size_t i = 0; i < song.words.size(); ++i) checkWord(song, i, name);
  if (song.duration() > kLongestSong) {
    throw InputError(name, "", fmt::format("lasts {:.0f} s; expected at most {} s", song.duration(), kLongestSong));
  }
}

Song readSong(const std::filesystem::path& path) {
  const std::string ending = path.extension().string();
  const std::string bytes = readFile(path, kMostBytes);
  if (ending == ".mxl") throw InputError(path.string(), "", "is packed MusicXML; expected it unpacked (.musicxml)");
  const bool is_xml = ending == ".musicxml" || ending == ".xml";
  return is_xml ? parseMusicXml(bytes, path.string()) : parseSongJson(bytes, path.string());
}

}  // namespace mouthpiece
