#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <pugixml.hpp>
#include <string>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_numbers.h"
#include "base/zip.h"
#include "singing/score_order.h"
#include "singing/song_builder.h"
#include "singing/timed_notes.h"

namespace mouthpiece {
namespace {

constexpr int kDeepest = 40;
constexpr std::size_t kMostNodes = 2'000'000;
/// Of a note without one, as rap is written: A3.
constexpr double kSpokenPitch = 57;
/// Quarters that rounding leaves between notes of thirds and sixths; no rest is that short.
constexpr double kSlip = 1e-6;

struct DepthWatch : pugi::xml_tree_walker {
  bool is_fine = true;
  std::size_t nodes = 0;
  bool for_each(pugi::xml_node& /*node*/) override {
    is_fine = depth() <= kDeepest && ++nodes <= kMostNodes;
    return is_fine;
  }
};

bool isText(const pugi::xml_node& node, const char* wanted) { return std::strcmp(node.child_value(), wanted) == 0; }

/// What is sung on a note: mostly a syllable, or several words that share it.
struct SungText {
  std::string letters;
  pugi::xml_node syllabic;
};

/// Goes through the first part that has lyrics, as it is played: the voice that has most of them, a verse each time.
class PartReader {
 public:
  explicit PartReader(std::string_view name) : name_(name) { song_.beats_per_minute = 60; }  // a beat is a second

  Song read(const pugi::xml_node& score) {
    song_.title = score.child("work").child_value("work-title");
    if (song_.title.empty()) song_.title = score.child_value("movement-title");
    const pugi::xml_node part = partWithLyrics(score);
    voice_ = voiceWithLyrics(part);
    readMeasures(part);
    const ScoreTempos tempos(score, name_);
    const std::vector<PlayedMeasure> order = playedMeasures(score, part, name_);
    findSections(order);
    for (const PlayedMeasure& played : order) {
      const Measure& measure = measures_[played.index];
      place_ = measure.place;
      verse_ = verseOf(measure, played.times_before);
      double at = 0;
      for (const Placed& note : measure.notes) {
        if (note.end <= at) continue;
        const double start = std::max(at, note.start);
        if (start > at + kSlip) addRest(tempos.between(played.index, at, start));
        readNote(note, tempos.between(played.index, start, note.end));
        at = note.end;
      }
      if (measure.quarters > at + kSlip) addRest(tempos.between(played.index, at, measure.quarters));
    }
    song_.addRest(rest_);
    return song_.song(name_);
  }

 private:
  /// A note of ours in its measure, quarters.
  struct Placed {
    pugi::xml_node note;
    double start, end;
    double transposed;  ///< semitones that it sounds above what is written
  };
  struct Measure {
    std::string place;
    std::vector<Placed> notes;
    std::vector<std::string> verses;  ///< as `number` names them, rising
    std::size_t times_played = 0, section = 0;
    double quarters = 0;
  };

  [[noreturn]] void fail(std::string_view what) const { throw InputError(name_, place_, what); }

  pugi::xml_node partWithLyrics(const pugi::xml_node& score) const {
    for (const pugi::xml_node& part : score.children("part")) {
      for (const pugi::xml_node& measure : part.children("measure")) {
        for (const pugi::xml_node& note : measure.children("note")) {
          if (note.child("lyric")) return part;
        }
      }
    }
    throw InputError(name_, "", "has no part with lyrics; expected one voice with lyrics");
  }

  static std::string voiceOf(const pugi::xml_node& note) {
    return note.child("voice") ? note.child_value("voice") : "1";  // a note that names none is of the first
  }

  /// The first of those with most lyrics.
  static std::string voiceWithLyrics(const pugi::xml_node& part) {
    std::vector<std::pair<std::string, std::size_t>> counts;
    for (const pugi::xml_node& measure : part.children("measure")) {
      for (const pugi::xml_node& note : measure.children("note")) {
        if (!note.child("lyric")) continue;
        const std::string voice = voiceOf(note);
        auto known = std::find_if(counts.begin(), counts.end(), [&](const auto& each) { return each.first == voice; });
        if (known == counts.end()) known = counts.insert(counts.end(), {voice, 0});
        ++known->second;
      }
    }
    return std::max_element(counts.begin(), counts.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }

  /// Chords' upper notes, grace and cue notes are not sung.
  [[nodiscard]] bool isOurs(const pugi::xml_node& note) const {
    return !note.child("chord") && !note.child("grace") && !note.child("cue") && voiceOf(note) == voice_;
  }

  double number(const pugi::xml_node& node, const char* what) const {
    const auto value = parseNumber(node.child_value());
    if (!value || !std::isfinite(*value))
      fail(fmt::format("has {} '{}'; expected a number", what, printable(node.child_value(), 20)));
    return *value;
  }

  void readMeasures(const pugi::xml_node& part) {
    double divisions = 1, transposed = 0;
    for (const pugi::xml_node& node : part.children("measure")) {
      Measure& measure = measures_.emplace_back();
      place_ = measure.place = placeOfMeasure(node);
      double quarters = 0;
      for (const pugi::xml_node& child : node.children()) {
        const double start = quarters;
        passElement(child, divisions, quarters, name_, place_);
        measure.quarters = std::max(measure.quarters, quarters);
        if (const pugi::xml_node transpose = child.child("transpose")) transposed = semitonesOf(transpose);
        if (std::strcmp(child.name(), "note") != 0 || !isOurs(child)) continue;
        if (quarters > start) measure.notes.push_back({child, start, quarters, transposed});
        for (const pugi::xml_node& lyric : child.children("lyric")) {
          const std::string verse = verseName(lyric);
          if (std::find(measure.verses.begin(), measure.verses.end(), verse) == measure.verses.end())
            measure.verses.push_back(verse);
        }
      }
      std::stable_sort(measure.notes.begin(), measure.notes.end(),
                       [](const Placed& a, const Placed& b) { return a.start < b.start; });
      std::sort(measure.verses.begin(), measure.verses.end(), isEarlierVerse);
    }
  }

  [[nodiscard]] double semitonesOf(const pugi::xml_node& transpose) const {
    double semitones = 0;
    if (transpose.child("chromatic")) semitones += number(transpose.child("chromatic"), "a transposition");
    if (transpose.child("octave-change"))
      semitones += 12 * number(transpose.child("octave-change"), "an octave change");
    return semitones;
  }

  static std::string verseName(const pugi::xml_node& lyric) { return lyric.attribute("number").as_string("1"); }
  static bool isEarlierVerse(const std::string& a, const std::string& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  }
  /// Measures that always follow each other have their verses together.
  void findSections(const std::vector<PlayedMeasure>& order) {
    std::vector<std::size_t> passes_on(measures_.size());  // how often the next one in the score follows
    for (std::size_t i = 0; i < order.size(); ++i) {
      ++measures_[order[i].index].times_played;
      if (i + 1 < order.size() && order[i + 1].index == order[i].index + 1) ++passes_on[order[i].index];
    }
    for (std::size_t i = 0; i < measures_.size(); ++i) {
      Measure& measure = measures_[i];
      const bool follows =
          i > 0 && passes_on[i - 1] == measure.times_played && measures_[i - 1].times_played == measure.times_played;
      if (!follows) verses_.emplace_back();
      measure.section = verses_.size() - 1;
      for (const std::string& verse : measure.verses) {
        std::vector<std::string>& all = verses_.back();
        const auto place = std::ranges::lower_bound(all, verse, isEarlierVerse);
        if (place == all.end() || *place != verse) all.insert(place, verse);
      }
    }
  }

  /// Of a measure that has fewer verses than its section an earlier one is sung again. "" where it has later ones
  /// alone.
  [[nodiscard]] std::string verseOf(const Measure& measure, std::size_t times_before) const {
    if (measure.verses.empty()) return "";
    if (measure.times_played == 1) return measure.verses.front();
    const std::vector<std::string>& all = verses_[measure.section];
    const auto after =
        std::ranges::upper_bound(measure.verses, all[std::min(times_before, all.size() - 1)], isEarlierVerse);
    return after == measure.verses.begin() ? "" : *std::prev(after);
  }

  void readNote(const Placed& placed, Seconds length) {
    const pugi::xml_node& note = placed.note;
    if (note.child("rest")) return addRest(length);
    if (!note.child("pitch") && !note.child("unpitched")) fail("has a note without pitch; expected a pitch or a rest");
    const double midi_pitch = note.child("pitch") ? pitchOf(note.child("pitch")) + placed.transposed : kSpokenPitch;
    addSung(note, midi_pitch, length);
  }

  /// It is added when it is known that no word goes on behind it.
  void addRest(Seconds length) {
    rest_ += length;
    ties_open_ = false;
  }

  double pitchOf(const pugi::xml_node& pitch) const {
    const std::string name = fmt::format("{}{}", pitch.child_value("step"), pitch.child_value("octave"));
    const double alter = pitch.child("alter") ? number(pitch.child("alter"), "an alteration") : 0;
    return midiPitchFromName(name, name_, place_) + alter;
  }

  /// A wavy line over a note, or the word in an ornament, is how notation programs write vibrato.
  static bool hasVibrato(const pugi::xml_node& note) {
    for (const pugi::xml_node& notations : note.children("notations")) {
      if (notations.child("ornaments").child("wavy-line")) return true;
      const std::string_view word = notations.child("technical").child_value("other-technical");
      if (word.find("ibr") != std::string_view::npos) return true;
    }
    return false;
  }

  void addSung(const pugi::xml_node& note, double midi_pitch, Seconds length) {
    bool ends_tie = false, begins_tie = false;
    for (const pugi::xml_node& tie : note.children("tie")) {
      const std::string_view type = tie.attribute("type").as_string();
      ends_tie |= type == "stop";
      begins_tie |= type == "start";
    }
    const std::vector<SungText> texts = textsOf(note);
    if (ends_tie && ties_open_) {
      song_.tieNote(midi_pitch, length, hasVibrato(note));
    } else if (!texts.empty()) {
      for (const SungText& text : texts) {
        beginSyllable(text, &text == &texts.front());
        song_.addNote(midi_pitch, length / asReal(texts.size()), hasVibrato(note));
      }
    } else if (song_.isResting() || rest_ > 0) {
      rest_ += length;  // without a word of its own: another instrument's
    } else {
      song_.addNote(midi_pitch, length, hasVibrato(note));  // of a melisma
    }
    ties_open_ = begins_tie && song_.hasWords();
  }

  /// Words that share a note stand beside an elision, or beside a blank.
  [[nodiscard]] std::vector<SungText> textsOf(const pugi::xml_node& note) const {
    std::vector<SungText> texts;
    const pugi::xml_node lyric = note.find_child([&](const pugi::xml_node& child) {
      return std::strcmp(child.name(), "lyric") == 0 && verseName(child) == verse_;
    });
    pugi::xml_node syllabic;
    bool is_apart = true;
    for (const pugi::xml_node& child : lyric.children()) {
      const std::string_view kind = child.name();
      if (kind == "syllabic") syllabic = child;
      if (kind == "elision") {
        is_apart = true;
        syllabic = {};
      }
      if (kind != "text") continue;
      std::string spaced = child.child_value();
      for (const std::string_view blank : {"\xC2\xA0", "\xE2\x80\xBF"}) {  // a hard one, and a tie below
        for (std::size_t at = 0; (at = spaced.find(blank, at)) != std::string::npos;)
          spaced.replace(at, blank.size(), " ");
      }
      std::vector<std::string_view> words;
      splitFields(spaced, ' ', words);
      for (const std::string_view word : words) {
        const std::string letters = wordLetters(word, name_, place_);
        is_apart |= &word != &words.front();
        if (letters.find_first_not_of('\'') == std::string::npos) continue;
        if (is_apart || texts.empty()) texts.push_back({"", syllabic});
        texts.back().letters += letters;
        is_apart = false;
      }
    }
    return texts;
  }

  void beginSyllable(const SungText& text, bool is_first) {
    const bool in_middle = isText(text.syllabic, "middle"), ends = isText(text.syllabic, "end");
    if (in_word_ && (in_middle || ends) && song_.hasWords()) {
      if (rest_ > 0) song_.lengthenNote(rest_);  // sung through, as in all other kinds of songs
    } else {
      song_.addRest(rest_);
      song_.beginWord();
    }
    rest_ = 0;
    song_.addText(text.letters);
    song_.beginSyllable();
    // Of words that share a note it is the last that goes on.
    in_word_ = isText(text.syllabic, "begin") || in_middle || (!is_first && !text.syllabic && in_word_);
  }

  std::string_view name_;
  std::string place_, voice_, verse_;
  SongBuilder song_;
  std::vector<Measure> measures_;
  std::vector<std::vector<std::string>> verses_;  ///< of each section, rising
  Seconds rest_ = 0;                              ///< since the last note
  bool in_word_ = false;
  bool ties_open_ = false;
};

}  // namespace

Song parseMusicXml(std::string_view bytes, std::string_view name) {
  // pugixml reads no document types and expands only the five entities of XML itself: no entity bombs, no outside
  // files.
  if (bytes.find("<!ENTITY") != std::string_view::npos)
    throw InputError(name, "", "defines entities; expected plain MusicXML");
  pugi::xml_document document;
  const pugi::xml_parse_result result =
      document.load_buffer(bytes.data(), bytes.size(), pugi::parse_minimal | pugi::parse_escapes);
  if (!result) {
    throw InputError(name, fmt::format("byte {}", result.offset),
                     fmt::format("is no XML: {}; expected MusicXML", result.description()));
  }
  DepthWatch watch;
  document.traverse(watch);
  if (!watch.is_fine) {
    throw InputError(name, "", fmt::format("nests deeper than {} or holds over {} elements", kDeepest, kMostNodes));
  }
  const pugi::xml_node score = document.child("score-partwise");
  if (!score) {
    throw InputError(name, "",
                     document.child("score-timewise") ? "is score-timewise; expected score-partwise"
                                                      : "is no MusicXML score; expected score-partwise");
  }
  return PartReader(name).read(score);
}

Song parsePackedMusicXml(std::string_view bytes, std::string_view name) {
  const std::string container = unzipped(bytes, "META-INF/container.xml", name);
  pugi::xml_document document;
  std::string score_name;
  if (document.load_buffer(container.data(), container.size(), pugi::parse_minimal))
    score_name = document.child("container").child("rootfiles").child("rootfile").attribute("full-path").as_string();
  if (score_name.empty())
    throw InputError(name, "", "names no score in META-INF/container.xml; expected packed MusicXML");
  const std::string score = unzipped(bytes, score_name, name);
  if (score.empty())
    throw InputError(name, "", fmt::format("holds no {}, which its container names", printable(score_name, 60)));
  return parseMusicXml(score, name);
}

}  // namespace mouthpiece
