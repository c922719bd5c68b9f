#include "singing/song.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "singing/kana_lyrics.h"
#include "singing/song_builder.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostWords = 5000, kMostNotesOfSyllable = 100, kLongestWord = 40, kBytesOfKana = 3;
constexpr double kSlowest = 10, kFastest = 600;  // beats a minute
constexpr double kLowestPitch = 28, kHighestPitch = 96;
constexpr Seconds kShortestNote = 0.02, kLongestNote = 60, kLongestRest = 120, kLongestSong = 1800;
constexpr Seconds kRounding = 1e-6;  // of sums of lengths
constexpr std::uint64_t kMostBytes = 16U << 20U;

constexpr std::array<SongFormat, 8> kFormats{{{".json", "song.json", parseSongJson},
                                              {".musicxml", "MusicXML, score-partwise", parseMusicXml},
                                              {".xml", "MusicXML, score-partwise", parseMusicXml},
                                              {".mxl", "packed MusicXML", parsePackedMusicXml},
                                              {".mid", "MIDI with lyrics", parseMidi},
                                              {".kar", "karaoke's MIDI", parseMidi},
                                              {".ust", "UTAU's project", parseUst},
                                              {".srt", "subtitles, on one note", parseSubtitleSong}}};

/// Checks a song from its beginning to its end.
class SongChecker {
 public:
  explicit SongChecker(std::string_view name) : name_(name) {}

  void check(const Song& song) {
    if (song.words.empty() || song.words.size() > kMostWords)
      fail("words", fmt::format("holds {} words; expected 1 to {}", song.words.size(), kMostWords));
    for (std::size_t i = 0; i < song.words.size(); ++i) checkWord(song.words[i], fmt::format("words[{}]", i));
    checkRest(song.duration, "");
    if (!(song.duration <= kLongestSong))
      fail("", fmt::format("lasts {:.0f} s; expected at most {} s", song.duration, kLongestSong));
  }

 private:
  [[noreturn]] void fail(std::string_view place, std::string_view what) const { throw InputError(name_, place, what); }

  void checkWord(const SongWord& word, const std::string& place) {
    const auto is_letter = [](char c) { return c >= 'a' && c <= 'z'; };
    const auto is_plain = [&](char c) { return is_letter(c) || c == '\''; };
    const std::string& text = word.text;
    const bool is_kana = !word.said.phones.empty() && kanaOf(text) == text;
    if (is_kana && text.size() > kBytesOfKana * kLongestWord)
      fail(place, fmt::format("found the word '{}'; expected at most {} kana", printable(text, 150), kLongestWord));
    if (!is_kana && (std::none_of(text.begin(), text.end(), is_letter) ||
                     !std::all_of(text.begin(), text.end(), is_plain) || text.size() > kLongestWord))
      fail(place, fmt::format("found the word '{}'; expected letters a to z and ', or kana", printable(text, 50)));
    if (word.syllables.empty() || word.syllables.size() > kLongestWord)
      fail(place, fmt::format("has {} syllables; expected 1 to {}", word.syllables.size(), kLongestWord));
    for (const Syllable& syllable : word.syllables) {
      const std::size_t count = syllable.notes.size();
      if (count == 0 || count > kMostNotesOfSyllable)
        fail(place, fmt::format("has a syllable of {} notes; expected 1 to {}", count, kMostNotesOfSyllable));
      const bool is_first = &syllable == &word.syllables.front();
      if (is_first) checkRest(syllable.notes.front().span.start, place);
      for (const Note& note : syllable.notes) checkNote(note, place);
    }
  }

  void checkNote(const Note& note, const std::string& place) {
    const double pitch = 69 + 12 * std::log2(note.hz / 440);
    if (!(pitch >= kLowestPitch - kRounding && pitch <= kHighestPitch + kRounding))
      fail(place, fmt::format("has pitch {:g}; expected {} to {} (E1 to C7)", pitch, kLowestPitch, kHighestPitch));
    const Seconds length = note.span.duration();
    if (!(length >= kShortestNote - kRounding && length <= kLongestNote + kRounding))
      fail(place, fmt::format("has a note of {:g} s; expected {} to {} s", length, kShortestNote, kLongestNote));
    if (!(std::abs(note.span.start - last_end_) <= kRounding))
      fail(place, fmt::format("has a note at {:g} s; expected it at {:g} s, where the one before ends", note.span.start,
                              last_end_));
    last_end_ = note.span.end;
  }

  /// Takes note of the rest that lasts until `end`.
  void checkRest(Seconds end, std::string_view place) {
    const Seconds rest = end - last_end_;
    if (!(rest >= -kRounding && rest <= kLongestRest + kRounding))
      fail(place, fmt::format("rests {:g} s; expected 0 to {} s", rest, kLongestRest));
    last_end_ = end;
  }

  std::string_view name_;
  Seconds last_end_ = 0;
};

}  // namespace

std::string Song::lyrics() const {
  std::string text;
  for (const SongWord& word : words) text += (text.empty() ? "" : " ") + word.text;
  return text;
}

std::vector<Note> Song::notes() const {
  std::vector<Note> all;
  for (const SongWord& word : words) {
    for (const Syllable& syllable : word.syllables) all.insert(all.end(), syllable.notes.begin(), syllable.notes.end());
  }
  return all;
}

double hzOfMidiPitch(double midi_pitch) { return 440 * std::exp2((midi_pitch - 69) / 12); }

double midiPitchFromName(std::string_view name, std::string_view file, std::string_view place) {
  constexpr std::array<int, 7> kSteps{9, 11, 0, 2, 4, 5, 7};  // A to G, above C
  const auto fail = [&]() -> InputError {
    return InputError(
        file, place, fmt::format("found the pitch '{}'; expected one like C4, F#3, Bb4 or A4+20", printable(name, 20)));
  };
  if (name.size() < 2 || name.size() > 12 || name[0] < 'A' || name[0] > 'G') throw fail();
  double pitch = kSteps[unsignedIndex(name[0] - 'A')];
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

void checkSong(const Song& song, std::string_view name) { SongChecker(name).check(song); }

Song withSyllables(Song song, std::span<const std::size_t> counts) {
  MOUTHPIECE_EXPECT(song.words.size() == counts.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    std::vector<Syllable>& syllables = song.words[i].syllables;
    const std::size_t wanted = std::max<std::size_t>(1, counts[i]);
    while (syllables.size() > wanted) {
      std::vector<Note>& kept = syllables[syllables.size() - 2].notes;
      kept.insert(kept.end(), syllables.back().notes.begin(), syllables.back().notes.end());
      syllables.pop_back();
    }
    const Note whole = syllables.back().notes.back();
    const double parts = asReal(wanted - syllables.size() + 1);
    for (double part = 1; part < parts; ++part) {
      const auto placeOf = [&](double share) { return std::lerp(whole.span.start, whole.span.end, share / parts); };
      syllables.back().notes.back().span.end = placeOf(part);
      syllables.push_back({{{{placeOf(part), placeOf(part + 1)}, whole.hz, whole.vibrato}}});
    }
  }
  return song;
}

void SongBuilder::addNote(double midi_pitch, double beats, bool vibrato) {
  const double start = song_.duration;
  song_.duration += beats;
  song_.words.back().syllables.back().notes.push_back({{start, song_.duration}, hzOfMidiPitch(midi_pitch), vibrato});
}

void SongBuilder::tieNote(double midi_pitch, double beats, bool vibrato) {
  const Note& last = song_.words.back().syllables.back().notes.back();
  if (last.hz != hzOfMidiPitch(midi_pitch)) return addNote(midi_pitch, beats, vibrato);
  lengthenNote(beats);
}

void SongBuilder::lengthenNote(double beats) {
  song_.words.back().syllables.back().notes.back().span.end = song_.duration += beats;
}

Song SongBuilder::song(std::string_view name) const {
  if (!(beats_per_minute >= kSlowest && beats_per_minute <= kFastest)) {
    throw InputError(name, "tempo",
                     fmt::format("is {:g} beats a minute; expected {} to {}", beats_per_minute, kSlowest, kFastest));
  }
  Song timed = song_;
  timed.title = title;
  const Seconds beat = 60 / beats_per_minute;
  timed.duration *= beat;
  for (SongWord& word : timed.words) {
    for (Syllable& syllable : word.syllables) {
      for (Note& note : syllable.notes) note.span = {note.span.start * beat, note.span.end * beat};
    }
  }
  sayKana(timed.words);
  checkSong(timed, name);
  return timed;
}

std::span<const SongFormat> songFormats() { return kFormats; }

Song readSong(const std::filesystem::path& path) {
  std::string ending = lowerCase(path.extension().string());
  if (ending == ".midi") ending = ".mid";
  const auto format =
      std::find_if(kFormats.begin(), kFormats.end(), [&](const SongFormat& known) { return ending == known.ending; });
  const SongFormat& reader = format == kFormats.end() ? kFormats.front() : *format;
  const std::string bytes = readFile(path, kMostBytes);
  if (bytes.starts_with("MThd")) return parseMidi(bytes, path.string());
  if (reader.parse != parsePackedMusicXml || !bytes.starts_with("PK"))
    expectText(bytes, path.string(),
               kindOfNoText(bytes).starts_with("a sound") ? "a written song, whose sound may go beside it as audio"
                                                          : "a written song");
  if (format == kFormats.end() && bytes.find_first_not_of(" \t\r\n\xEF\xBB\xBF") != bytes.find('{')) {
    std::string endings;
    for (const SongFormat& known : kFormats) endings += fmt::format(" {}", known.ending);
    throw InputError(path.string(), "",
                     fmt::format("is no song by its name; expected one that ends in{} (the words of a recording are "
                                 "its lyrics)",
                                 endings));
  }
  return reader.parse(bytes, path.string());
}

}  // namespace mouthpiece
