// Standard MIDI files with lyrics: karaoke's, and the vocal parts of rhythm games.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "base/byte_reader.h"
#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "singing/timed_notes.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kMostEvents = 1'000'000;
constexpr int kText = 0x01, kTrackName = 0x03, kLyric = 0x05, kTempo = 0x51;
constexpr unsigned kPercussion = 9;      // of General MIDI's channels
constexpr double kUsualTempo = 500'000;  // microseconds a quarter

using Tick = std::uint64_t;

struct TickNote {
  Tick start, end;
  int pitch;
};

/// The notes of one channel of a track by when they begin, of several at once the one that ends first.
using Voice = std::map<Tick, TickNote>;

/// One track: its voices by their channels, and its words. All of a file of format 0 is one track.
struct Track {
  std::string name;
  std::map<unsigned, Voice> voices;
  std::map<Tick, std::string> lyrics, texts;
};

class MidiReader {
 public:
  MidiReader(std::string_view bytes, std::string_view name) : reader_(bytes, name, ByteOrder::kBig) {}

  Song read() {
    readHeader();
    while (reader_.remaining() > 0) readChunk();
    timeTempos();
    return songOf(timedNotes(), title_, reader_.fileName());
  }

 private:
  struct Tempo {
    Seconds at;      ///< when it begins
    double quarter;  ///< microseconds
  };
  [[nodiscard]] Seconds secondsAfter(const Tempo& tempo, Tick ticks) const {
    return tempo.at + 1e-6 * tempo.quarter * static_cast<double>(ticks) / division_;
  }

  void readHeader() {
    if (reader_.remaining() < 14 || reader_.readBytes(4) != "MThd")
      throw InputError(reader_.fileName(), "", "is no standard MIDI file");
    const std::size_t size = reader_.readU32();
    if (size < 6) reader_.fail("found a header that is too short");
    if (const int format = reader_.readU16(); format > 1)
      reader_.fail(fmt::format("found format {}; expected 0 or 1", format));
    reader_.skip(2);
    division_ = reader_.readU16();
    if (division_ == 0 || division_ >= 0x8000) reader_.fail("found times by film frames; expected ticks a quarter");
    reader_.skip(size - 6);
  }

  void readChunk() {
    if (reader_.remaining() < 8) return reader_.skip(reader_.remaining());
    const std::string_view kind = reader_.readBytes(4);
    const std::size_t size = reader_.readU32(), end = reader_.position() + std::min(size, reader_.remaining());
    if (kind == "MTrk") readTrack(end);
    reader_.seek(end);
  }

  std::uint32_t readLength() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) {
      const std::uint8_t byte = reader_.readU8();
      value = value << 7U | (byte & 0x7FU);
      if (byte < 0x80) return value;
    }
    reader_.fail("found a length of over four bytes");
  }

  void readTrack(std::size_t end) {
    Track& track = tracks_.emplace_back();
    Sounding sounding;
    Tick now = 0;
    std::uint8_t status = 0;
    while (reader_.position() < end) {
      if (++events_ > kMostEvents) reader_.fail("found over a million events");
      now += readLength();
      const std::uint8_t first = reader_.readU8();
      if (first == 0xFF) {
        const int kind = reader_.readU8();
        readMeta(kind, reader_.readBytes(readLength()), now, track);
      } else if (first == 0xF0 || first == 0xF7) {
        reader_.skip(readLength());
      } else {
        std::uint8_t data = first;
        if (first >= 0x80) {
          status = first;
          data = reader_.readU8();
        } else if (status < 0x80) {
          reader_.fail("found data without a status");
        }
        readChannel(status, data, now, sounding, track);
      }
    }
  }

  /// When the notes that still sound began, by channel and pitch.
  using Sounding = std::map<std::pair<unsigned, int>, Tick>;

  void readChannel(unsigned status, int data, Tick now, Sounding& sounding, Track& track) {
    const unsigned kind = status & 0xF0U, channel = status & 0x0FU;
    if (kind == 0xC0 || kind == 0xD0) return;
    const int value = reader_.readU8();
    if (kind != 0x80 && kind != 0x90) return;
    if (const auto begun = sounding.find({channel, data}); begun != sounding.end()) {
      const TickNote note{begun->second, now, data};
      if (isSung(note) && channel != kPercussion) track.voices[channel].emplace(note.start, note);
      sounding.erase(begun);
    }
    if (kind == 0x90 && value > 0) sounding[{channel, data}] = now;
  }

  void readMeta(int kind, std::string_view data, Tick now, Track& track) {
    if (kind == kTempo && data.size() == 3) {
      double quarter = 0;
      for (const char byte : data) quarter = 256 * quarter + static_cast<unsigned char>(byte);
      if (quarter > 0) tempos_[now] = {0, quarter};
    }
    if (kind == kTrackName) track.name = decodeText(data, reader_.fileName());
    if (kind == kTrackName && tracks_.size() == 1) title_ = track.name;
    // Karaoke's headers (@T title) and marks of rhythm games ([play]) are no words.
    const bool is_mark = !data.empty() && (data[0] == '@' || data[0] == '[' || data[0] == '%');
    if ((kind == kLyric || kind == kText) && !data.empty() && !is_mark)
      addText(kind == kLyric ? track.lyrics : track.texts, now, decodeText(data, reader_.fileName()));
  }

  /// A line's end that is an event of its own ends the word before.
  static void addText(std::map<Tick, std::string>& words, Tick now, const std::string& text) {
    const bool is_blank = text.find_first_not_of(" \r\n\t") == std::string::npos;
    if (is_blank && !words.empty()) {
      words.rbegin()->second += text;
    } else if (!is_blank) {
      words[now] += text;
    }
  }

  /// Gives each change of the tempo its time.
  void timeTempos() {
    Tick from = 0;
    Tempo last{0, kUsualTempo};
    for (auto& [start, tempo] : tempos_) {
      tempo.at = secondsAfter(last, start - from);
      from = start;
      last = tempo;
    }
  }

  [[nodiscard]] Seconds secondsAt(Tick tick) const {
    const auto next = tempos_.upper_bound(tick);
    if (next == tempos_.begin()) return secondsAfter({0, kUsualTempo}, tick);
    const auto& [start, tempo] = *std::prev(next);
    return secondsAfter(tempo, tick - start);
  }

  /// Words and notes may stand in tracks and channels of their own: the words are those of the track that has most of
  /// them, the melody is the voice whose notes these words fit best: each has one, and few notes none.
  std::vector<TimedNote> timedNotes() const {
    const std::map<Tick, std::string>* words = nullptr;
    for (const Track& track : tracks_) {
      const auto& own = track.lyrics.empty() ? track.texts : track.lyrics;
      if (words == nullptr || own.size() > words->size()) words = &own;
    }
    if (words == nullptr || words->empty())
      throw InputError(reader_.fileName(), "", "holds no lyrics; expected a MIDI file with words on its notes");
    const Voice* melody = nullptr;
    double best = 0;
    for (const Track& track : tracks_) {
      for (const auto& [channel, voice] : track.voices) {
        const double met = asReal(startsOfWords(voice, *words).size());
        const double fit = met / (asReal(words->size()) + asReal(voice.size()) - met);
        if (fit <= best) continue;
        best = fit;
        melody = &voice;
      }
    }
    if (melody == nullptr)
      throw InputError(reader_.fileName(), "",
                       "has no note that begins with a word; expected a melody with its lyrics");
    return withWords(*melody, *words);
  }

  /// Phrase and percussion marks of rhythm games lie above and below any voice.
  static bool isSung(const TickNote& note) { return note.pitch >= 28 && note.pitch <= 96; }

  /// The word on each note that has one: the nearest, at most a sixteenth away; players' words are not on the tick.
  std::map<Tick, Tick> startsOfWords(const Voice& voice, const std::map<Tick, std::string>& words) const {
    std::map<Tick, Tick> word_of;
    const auto distance = [](Tick a, Tick b) { return a < b ? b - a : a - b; };
    for (const auto& [word, text] : words) {
      auto nearest = voice.lower_bound(word);
      if (nearest == voice.end() ||
          (nearest != voice.begin() && distance(std::prev(nearest)->first, word) < distance(nearest->first, word))) {
        if (nearest == voice.begin()) break;
        --nearest;
      }
      if (distance(nearest->first, word) > division_ / 4) continue;
      const auto [known, is_new] = word_of.try_emplace(nearest->first, word);
      if (!is_new && distance(known->second, nearest->first) > distance(word, nearest->first)) known->second = word;
    }
    return word_of;
  }

  /// A word that begins where a note goes on parts it.
  Voice partedByWords(Voice voice, const std::map<Tick, std::string>& words) const {
    std::set<Tick> placed;
    for (const auto& [note, word] : startsOfWords(voice, words)) placed.insert(word);
    for (const auto& [word, text] : words) {
      const auto next = voice.upper_bound(word);
      if (placed.contains(word) || wordLetters(text).empty() || next == voice.begin()) continue;
      TickNote& note = std::prev(next)->second;
      if (word - note.start <= division_ / 4 || word + division_ / 8 >= note.end) continue;
      voice.emplace(word, TickNote{word, note.end, note.pitch});
      note.end = word;
    }
    return voice;
  }

  std::vector<TimedNote> withWords(const Voice& melody, const std::map<Tick, std::string>& words) const {
    constexpr std::string_view kBlanks = " \r\n\t";
    const auto isBlank = [&](char c) { return kBlanks.find(c) != std::string_view::npos; };
    const auto beginsWord = [&](char c) { return isBlank(c) || c == '/' || c == '\\'; };
    const auto hasMore = [&](const std::string& text) {
      const std::string_view letters = trimmedMarks(text);
      return letters.ends_with('-') || letters.ends_with('=');
    };
    // Where hyphens say that a word goes on, a line's end does not make blanks the sign of it.
    const bool by_hyphens =
        std::any_of(words.begin(), words.end(), [&](const auto& word) { return hasMore(word.second); });
    const bool by_blanks = std::any_of(words.begin(), words.end(), [&](const auto& word) {
      const std::string& text = word.second;
      const std::size_t end = by_hyphens ? text.find_last_not_of("\r\n") + 1 : text.size();
      if (end < 2) return false;  // of text in UTF-16 its mark alone leaves nothing
      return beginsWord(text.front()) || isBlank(text[end - 1]);
    });
    const Voice parted = partedByWords(melody, words);
    const std::map<Tick, Tick> word_of = startsOfWords(parted, words);
    std::vector<TimedNote> notes;
    bool joins_next = false, ends_word = true;
    for (const auto& [start, note] : parted) {
      TimedNote& sung = notes.emplace_back();
      sung.span = {secondsAt(start), secondsAt(note.end)};
      sung.midi_pitch = note.pitch;
      const auto word = word_of.find(start);
      if (word == word_of.end()) continue;
      const std::string& written = words.at(word->second);
      const std::string_view text = trimmedMarks(written);
      sung.text = text;
      if (wordLetters(text).empty()) continue;  // "+": a melisma
      const bool begins = !by_blanks ? !joins_next : beginsWord(written.front()) || ends_word;
      sung.goes_on = notes.size() > 1 && !begins;
      joins_next = hasMore(written);
      ends_word = isBlank(written.back());
    }
    return notes;
  }

  /// Without what marks a spoken note in a rhythm game.
  static std::string_view trimmedMarks(std::string_view text) {
    while (!text.empty() && std::string_view("#^*$ \r\n").find(text.back()) != std::string_view::npos)
      text.remove_suffix(1);
    return text;
  }

  ByteReader reader_;
  unsigned division_ = 480;
  std::size_t events_ = 0;
  std::string title_;
  std::vector<Track> tracks_;
  std::map<Tick, Tempo> tempos_;
};

}  // namespace

Song parseMidi(std::string_view bytes, std::string_view name) { return MidiReader(bytes, name).read(); }

}  // namespace mouthpiece
