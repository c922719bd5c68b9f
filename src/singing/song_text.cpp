// Songs in plain text: UTAU's projects, and subtitles.
#include <fmt/format.h>
#include <unicode/unistr.h>

#include <algorithm>
#include <array>
#include <optional>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "singing/kana_lyrics.h"
#include "singing/timed_notes.h"

namespace mouthpiece {
namespace {

constexpr double kTicksAQuarter = 480;
constexpr double kSlowestUst = 10, kFastestUst = 600;  // quarters a minute
/// What subtitles are sung on: they say when, not how high.
constexpr double kSubtitlePitch = 57;
constexpr std::size_t kMostLines = 1'000'000;

double numberIn(std::string_view value, std::string_view name, std::size_t line) {
  const auto number = parseNumber(value);
  if (!number || !(std::abs(*number) < 1e9))
    throw InputError(name, fmt::format("{}", line), fmt::format("found '{}'; expected a number", printable(value, 20)));
  return *number;
}

bool isUtf8(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    if (!decodeUtf8(text, at)) return false;
  }
  return true;
}

/// UTAU writes Shift JIS, later programs UTF-8 or UTF-16.
std::string ustText(std::string_view bytes, std::string_view name) {
  if (!bytes.starts_with("\xFE\xFF") && !bytes.starts_with("\xFF\xFE") && !isUtf8(bytes)) {
    std::string text;
    icu::UnicodeString(bytes.data(), static_cast<int32_t>(bytes.size()), "windows-31j").toUTF8String(text);
    if (!kanaOf(text).empty()) return text;
  }
  return decodeText(bytes, name);
}

/// What a voice bank's notes say besides syllables: "R", a vowel's end ("a R", "n -"), a breath ("息", "吸う").
bool isSilent(std::string_view lyric, bool is_japanese) {
  const std::string lower = lowerCase(lyric);
  if (lower.empty() || lower == "r") return true;
  if (!is_japanese) return false;
  if (lower == "rest") return true;
  const bool is_breath = lyric.starts_with("息") || lyric.starts_with("吸");
  return is_breath || (lower.size() <= 3 && (lower.ends_with(" r") || lower.ends_with(" -")));
}

/// "00:01:02,345" or "01:02.345".
std::optional<Seconds> subtitleTime(std::string_view text) {
  std::vector<std::string_view> fields;
  splitFields(trimmed(text), ':', fields);
  if (fields.size() < 2 || fields.size() > 3) return std::nullopt;
  Seconds seconds = 0;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    std::string field(fields[i]);
    if (i + 1 == fields.size()) std::replace(field.begin(), field.end(), ',', '.');
    const auto number = parseNumber(field);
    if (!number || !(*number >= 0 && *number < 1e5)) return std::nullopt;
    seconds = 60 * seconds + *number;
  }
  return seconds;
}

/// The words of a subtitle share its time by their letters.
void addSubtitle(TimeSpan span, const std::string& text, std::string_view name, std::vector<TimedNote>& notes) {
  std::vector<std::string> words;
  std::vector<std::string_view> pieces;
  splitFields(text, ' ', pieces);
  std::size_t letters = 0;
  for (const std::string_view piece : pieces) {
    if (std::string word = wordLetters(piece, name, fmt::format("subtitle at {:.2f} s", span.start));
        word.find_first_not_of('\'') != std::string::npos) {
      letters += word.size() + 1;
      words.push_back(std::move(word));
    }
  }
  Seconds start = span.start;
  for (const std::string& word : words) {
    const Seconds length = span.duration() * asReal(word.size() + 1) / asReal(letters);
    notes.push_back({{start, start + length}, kSubtitlePitch, word});
    start += length;
  }
}

}  // namespace

Song parseUst(std::string_view bytes, std::string_view name) {
  const std::string text = ustText(bytes, name);
  const bool is_japanese = !kanaOf(text).empty();
  std::vector<TimedNote> notes;
  std::string title;
  double tempo = 120, ticks = 0;
  Seconds now = 0;
  TimedNote note;
  bool is_note = false;
  std::size_t notes_line = 0;
  const auto finish = [&] {
    if (!is_note) return;
    if (!(ticks > 0 && ticks < 1e7))
      throw InputError(name, fmt::format("{}", notes_line), fmt::format("found a length of {:g} ticks", ticks));
    note.span = {now, now + 60 / tempo * ticks / kTicksAQuarter};
    now = note.span.end;
    if (!isSilent(note.text, is_japanese)) {
      note.goes_on = (note.text.starts_with('+') || note.text.starts_with('-')) && kanaOf(note.text).empty();
      notes.push_back(note);
    }
  };
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    if (line.starts_with('[')) {
      finish();
      is_note = line.size() > 2 && line[1] == '#' && line[2] >= '0' && line[2] <= '9';
      note = {};
      ticks = 0;
      notes_line = lines.lineNumber();
      if (notes_line > kMostLines) throw InputError(name, "", "has over a million lines");
      continue;
    }
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos) continue;
    const std::string_view key = line.substr(0, equals), value = trimmed(line.substr(equals + 1));
    if (key == "ProjectName") title = value;
    if (key == "Tempo") {
      std::string number(value);  // an early UTAU wrote a comma
      std::replace(number.begin(), number.end(), ',', '.');
      tempo = numberIn(number, name, lines.lineNumber());
      if (!(tempo >= kSlowestUst && tempo <= kFastestUst))
        throw InputError(name, fmt::format("{}", lines.lineNumber()),
                         fmt::format("found a tempo of {:g}; expected {} to {}", tempo, kSlowestUst, kFastestUst));
    }
    if (is_note && key == "Length") ticks = numberIn(value, name, lines.lineNumber());
    if (is_note && key == "NoteNum") note.midi_pitch = numberIn(value, name, lines.lineNumber());
    if (is_note && key == "Lyric") note.text = value;
    if (is_note && key == "VBR") note.vibrato = !value.empty();
  }
  finish();
  if (notes.empty())
    throw InputError(name, "", "holds no sung note; expected sections [#0000] with Length, Lyric and NoteNum");
  return songOf(std::move(notes), title, name);
}

Song parseSubtitleSong(std::string_view bytes, std::string_view name) {
  const std::string text = decodeText(bytes, name);
  std::vector<TimedNote> notes;
  std::optional<TimeSpan> span;
  std::string words;
  const auto finish = [&] {
    if (span) addSubtitle(*span, words, name, notes);
    span.reset();
    words.clear();
  };
  LineReader lines(text);
  for (std::string_view line; lines.next(line);) {
    const std::size_t arrow = line.find("-->");
    if (arrow != std::string_view::npos) {
      finish();
      const auto start = subtitleTime(line.substr(0, arrow)), end = subtitleTime(line.substr(arrow + 3));
      if (!start || !end || *end <= *start)
        throw InputError(
            name, fmt::format("{}", lines.lineNumber()),
            fmt::format("found the times '{}'; expected 00:00:01,000 --> 00:00:02,500", printable(line, 60)));
      span = TimeSpan{*start, *end};
    } else if (trimmed(line).empty()) {
      finish();
    } else if (span) {
      words += std::string(words.empty() ? "" : " ") + withoutBracketed(line, "<>{}[]");
    }
  }
  finish();
  if (notes.empty()) throw InputError(name, "", "holds no words; expected subtitles with letters a to z");
  return songOf(std::move(notes), "", name);
}

}  // namespace mouthpiece
