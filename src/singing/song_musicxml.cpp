#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <pugixml.hpp>

#include "base/errors.h"
#include "base/text_numbers.h"
#include "base/zip.h"
#include "singing/song_builder.h"
#include "singing/timed_notes.h"

namespace mouthpiece {
namespace {

constexpr int kDeepest = 40;
constexpr std::size_t kMostNodes = 2'000'000;

struct DepthWatch : pugi::xml_tree_walker {
  bool is_fine = true;
  std::size_t nodes = 0;
  bool for_each(pugi::xml_node& /*node*/) override {
    is_fine = depth() <= kDeepest && ++nodes <= kMostNodes;
    return is_fine;
  }
};

bool isText(const pugi::xml_node& node, const char* wanted) { return std::strcmp(node.child_value(), wanted) == 0; }

/// Goes through the first part that has lyrics: its first voice, first verse.
class PartReader {
 public:
  explicit PartReader(std::string_view name) : name_(name) {}

  Song read(const pugi::xml_node& score) {
    song_.title = score.child("work").child_value("work-title");
    const pugi::xml_node part = partWithLyrics(score);
    for (const pugi::xml_node& measure : part.children("measure")) {
      place_ = fmt::format("measure {}", printable(measure.attribute("number").as_string("?"), 12));
      for (const pugi::xml_node& child : measure.children()) readChild(child);
    }
    if (ties_open_) fail("ends within a tie");
    return song_.song(name_);
  }

 private:
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

  double number(const pugi::xml_node& node, const char* what) const {
    const auto value = parseNumber(node.child_value());
    if (!value || !std::isfinite(*value))
      fail(fmt::format("has {} '{}'; expected a number", what, printable(node.child_value(), 20)));
    return *value;
  }

  void readChild(const pugi::xml_node& child) {
    const std::string_view kind = child.name();
    if (kind == "attributes" && child.child("divisions")) {
      divisions_ = number(child.child("divisions"), "divisions");
      if (!(divisions_ > 0 && divisions_ <= 1e6))
        fail(fmt::format("has {:g} divisions; expected 1 or more", divisions_));
    }
    if (kind == "sound") readTempo(child);
    if (kind == "direction") readTempo(child.child("sound"));
    if (kind == "note") readNote(child);
  }

  /// The first tempo holds for the whole song.
  void readTempo(const pugi::xml_node& sound) {
    if (has_tempo_ || !sound.attribute("tempo")) return;
    const auto tempo = parseNumber(sound.attribute("tempo").as_string());
    if (!tempo || !std::isfinite(*tempo)) fail("has a tempo that is no number; expected beats a minute");
    song_.beats_per_minute = *tempo;
    has_tempo_ = true;
  }

  /// Other voices, chords' upper notes and grace notes take no time of ours.
  bool isOurs(const pugi::xml_node& note) {
    if (note.child("chord") || note.child("grace") || note.child("cue")) return false;
    const std::string voice =
        note.child("voice") ? note.child_value("voice") : "1";  // a note that names none is of the first
    if (!voice_) voice_ = voice;
    return voice == *voice_;
  }

  void readNote(const pugi::xml_node& note) {
    if (!isOurs(note)) return;
    if (!note.child("duration")) fail("has a note without duration; expected one");
    const double beats = number(note.child("duration"), "a duration") / divisions_;
    if (!(beats >= 0 && beats <= 1e4)) fail(fmt::format("has a note of {:g} beats", beats));
    if (beats == 0) return;
    if (note.child("rest")) return addRest(beats);
    if (!note.child("pitch")) fail("has a note without pitch; expected a pitch or a rest");
    addPitched(note, beats);
  }

  void addRest(double beats) {
    song_.addRest(beats);
    in_word_ = ties_open_ = false;
  }

  double pitchOf(const pugi::xml_node& pitch) const {
    const std::string name = fmt::format("{}{}", pitch.child_value("step"), pitch.child_value("octave"));
    const double alter = pitch.child("alter") ? number(pitch.child("alter"), "an alteration") : 0;
    return midiPitchFromName(name, name_, place_) + alter;
  }

  /// A wavy line over a note, or the word in an ornament, is how notation programs write vibrato.
  static bool hasVibrato(const pugi::xml_node& note) {
    for (const pugi::xml_node& notations : note.children("notations")) {
      if (notations.child("ornaments").child("wavy-line") || notations.child("technical").child("other-technical"))
        return true;
    }
    return false;
  }

  void addPitched(const pugi::xml_node& note, double beats) {
    bool ends_tie = false, begins_tie = false;
    for (const pugi::xml_node& tie : note.children("tie")) {
      const std::string_view type = tie.attribute("type").as_string();
      ends_tie |= type == "stop";
      begins_tie |= type == "start";
    }
    const double midi_pitch = pitchOf(note.child("pitch"));
    const std::string letters = lyricOf(note);
    if (ends_tie && ties_open_) {
      song_.tieNote(midi_pitch, beats, hasVibrato(note));
    } else if (letters.empty() && song_.isResting()) {
      song_.addRest(beats);  // without a word of its own: another instrument's
    } else {
      if (!letters.empty()) beginSyllable(letters, note);
      song_.addNote(midi_pitch, beats, hasVibrato(note));  // of a melisma where it has no letters
    }
    ties_open_ = begins_tie && song_.hasWords();
  }

  [[nodiscard]] std::string lyricOf(const pugi::xml_node& note) const {
    std::string letters;
    for (const pugi::xml_node& text : note.child("lyric").children("text"))
      letters += wordLetters(text.child_value(), name_, place_);
    return letters;
  }

  void beginSyllable(const std::string& letters, const pugi::xml_node& note) {
    const pugi::xml_node syllabic = note.child("lyric").child("syllabic");
    const bool goes_on = in_word_ && (isText(syllabic, "middle") || isText(syllabic, "end"));
    if (!goes_on) song_.beginWord();
    song_.addText(letters);
    song_.beginSyllable();
    in_word_ = isText(syllabic, "begin") || isText(syllabic, "middle");
  }

  std::string_view name_;
  std::string place_;
  SongBuilder song_;
  double divisions_ = 1;
  std::optional<std::string> voice_;
  bool has_tempo_ = false;
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
