// The kinds that are no JSON.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <pugixml.hpp>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "hearing/times/times_reader.h"

namespace mouthpiece {
namespace {

/// "01:02:03,456", "02:03.456"; nullopt for anything else.
std::optional<Seconds> clockTime(std::string_view text) {
  double seconds = 0;
  std::string part;
  std::size_t colons = 0;
  for (const char c : std::string(text) + ":") {
    if (c != ':') {
      part += c == ',' ? '.' : c;
      continue;
    }
    const bool is_number = !part.empty() && part.find_first_not_of("0123456789.") == std::string::npos;
    const std::optional<double> value = is_number ? parseNumber(part) : std::nullopt;
    if (!value || ++colons > 3) return std::nullopt;
    seconds = 60 * seconds + *value;
    part.clear();
  }
  return colons >= 2 ? std::optional<Seconds>(seconds) : std::nullopt;
}

Seconds requireClock(std::string_view text, std::string_view file, std::size_t line) {
  const std::string_view time = trimmed(text);
  if (const auto seconds = clockTime(time.substr(0, time.find(' ')))) return *seconds;
  throw InputError(file, std::to_string(line),
                   fmt::format("found '{}'; expected a time as 00:00:01,500", printable(time.substr(0, 40))));
}

/// The length of "JOHN:", "MR. SMITH 2 (on the phone):" at the beginning of `text`; 0 where nobody is named.
std::size_t speakerIn(std::string_view text) {
  constexpr std::size_t kMostWords = 3;
  const std::size_t colon = text.find(':');
  if (colon == text.npos || (colon + 1 < text.size() && text[colon + 1] != ' ')) return 0;
  const std::string_view name = trimmed(text.substr(0, std::min(colon, text.find('('))));
  if (name.size() < colon && text.find('(') < colon && text[colon - 1] != ')') return 0;
  const bool has_capital = name.find_first_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ") != name.npos;
  const bool has_small = std::ranges::any_of(name, [](char c) { return c >= 'a' && c <= 'z'; });
  const bool has_end = name.find_first_of("!?,;") != name.npos;
  return has_capital && !has_small && !has_end && std::ranges::count(name, ' ') < signedIndex(kMostWords) ? colon + 1
                                                                                                          : 0;
}

/// As HTML and WebVTT name signs.
std::string withSignsFor(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kNamed{
      {{"&lt;", "<"}, {"&gt;", ">"}, {"&nbsp;", " "}, {"&lrm;", ""}, {"&rlm;", ""}, {"&amp;", "&"}}};
  std::string plain;
  while (!text.empty()) {
    const auto* const named =
        std::ranges::find_if(kNamed, [&](const auto& each) { return text.starts_with(each.first); });
    const bool is_named = named != kNamed.end();
    plain += is_named ? named->second : text.substr(0, 1);
    text.remove_prefix(is_named ? named->first.size() : 1);
  }
  return plain;
}

/// Without <tags>, {styles}, what tells that another speaks (dashes, ">>") and who; the name goes to `builder`.
std::string plainCue(std::string_view line, TimesBuilder& builder) {
  const std::string plain = withSignsFor(withoutBracketed(line, "<>{}"));
  std::string_view text = trimmed(plain);
  const auto dropTurns = [&] {
    while (text.starts_with('-') || text.starts_with('>')) text = trimmed(text.substr(1));
  };
  dropTurns();
  if (const std::size_t name = speakerIn(text); name > 0) {
    builder.addNotSaid(text.substr(0, name));
    text = trimmed(text.substr(name));
    dropTurns();
  }
  return std::string(text);
}

Seconds requireSeconds(std::string_view text, std::string_view file, const std::string& place) {
  const auto value = parseNumber(text);
  if (value && std::isfinite(*value)) return *value;
  throw InputError(file, place, fmt::format("found '{}'; expected a time in seconds", printable(text)));
}

}  // namespace

std::optional<Phone> phoneOfShape(std::string_view shape, std::string_view file, const std::string& place) {
  // Rhubarb's README: A closed, B clenched, C open, D wide open, E rounded, F puckered, G lip to teeth, H L, X rest.
  constexpr std::array<std::pair<char, Phone>, 8> kShapes = {{{'A', Phone::kM},
                                                              {'B', Phone::kS},
                                                              {'C', Phone::kEH},
                                                              {'D', Phone::kAA},
                                                              {'E', Phone::kAO},
                                                              {'F', Phone::kUW},
                                                              {'G', Phone::kF},
                                                              {'H', Phone::kL}}};
  if (shape == "X") return std::nullopt;
  for (const auto& [name, phone] : kShapes) {
    if (shape.size() == 1 && shape[0] == name) return phone;
  }
  throw InputError(file, place, fmt::format("found the mouth shape '{}'; expected A to H or X", printable(shape)));
}

TimesFile parseSubtitles(std::string_view text, std::string_view name) {
  const bool is_vtt = trimmed(text).starts_with("WEBVTT");
  // YouTube's captions roll: a cue shows the last line of the one before once more, over its own.
  const bool rolls = is_vtt && text.find("<c>") != std::string_view::npos;
  TimesBuilder builder(name, is_vtt ? "WebVTT" : "SRT");
  builder.setLines();
  LineReader reader(text);
  std::string_view line;
  bool in_note = false;
  std::optional<TimeSpan> span;
  std::vector<std::string> lines, lines_before;
  std::string place;
  const auto finish = [&] {
    std::size_t shown = rolls ? std::min(lines.size(), lines_before.size()) : 0;
    while (shown > 0 &&
           !std::equal(lines.begin(), lines.begin() + signedIndex(shown), lines_before.end() - signedIndex(shown)))
      --shown;
    if (span)
      builder.addWord(fmt::format("{}", fmt::join(lines.begin() + signedIndex(shown), lines.end(), " ")), *span, place);
    if (span) lines_before = std::move(lines);
    span.reset();
    lines.clear();
  };
  const auto isNumber = [](std::string_view cue) { return cue.find_first_not_of("0123456789") == cue.npos; };
  while (reader.next(line)) {
    const std::string_view bare = trimmed(line);
    if (bare.empty() && !line.empty() && line != "\r" && span && rolls)
      continue;  // a blank holds the upper line's place
    if (bare.empty()) {
      finish();
      in_note = false;
    } else if (!span && (bare.starts_with("NOTE") || bare.starts_with("STYLE") || bare.starts_with("REGION"))) {
      in_note = true;
    } else if (const std::size_t arrow = bare.find("-->"); arrow != std::string_view::npos && !in_note) {
      if (!lines.empty() && isNumber(lines.back())) lines.pop_back();  // this cue's, where no empty line parts them
      finish();
      span = TimeSpan{requireClock(bare.substr(0, arrow), name, reader.lineNumber()),
                      requireClock(bare.substr(arrow + 3), name, reader.lineNumber())};
      place = std::to_string(reader.lineNumber());
    } else if (span) {
      std::string plain = plainCue(bare, builder);
      if (!plain.empty()) lines.push_back(std::move(plain));
    }
  }
  finish();
  return builder.finish();
}

/// Whisper's TSV, milliseconds under "start end text", and Audacity's labels, seconds.
TimesFile parseTabbedLines(std::string_view text, std::string_view name) {
  LineReader reader(text);
  std::vector<std::string_view> fields;
  std::string_view line;
  const bool is_whisper = trimmed(text).starts_with("start\tend\ttext");
  TimesBuilder builder(name, is_whisper ? "Whisper TSV" : "Audacity labels");
  builder.setLines();
  for (bool is_header = is_whisper; reader.next(line);) {
    if (trimmed(line).empty() || std::exchange(is_header, false)) continue;
    if (line.starts_with('\\')) continue;  // Audacity's frequencies of the label above
    const std::string place = std::to_string(reader.lineNumber());
    splitFields(line, '\t', fields);
    if (fields.size() != 3)
      throw InputError(name, place, fmt::format("found {} fields; expected start, end and text", fields.size()));
    const double unit = is_whisper ? 1e-3 : 1;
    builder.addWord(fields[2],
                    {unit * requireSeconds(fields[0], name, place), unit * requireSeconds(fields[1], name, place)},
                    place);
  }
  return builder.finish();
}

TimesFile parseLrc(std::string_view text, std::string_view name) {
  constexpr Seconds kAWord = 0.5, kLongestLine = 15;
  struct Row {
    Seconds start;
    std::string text, place;
  };
  TimesBuilder builder(name, "LRC");
  builder.setLines();
  std::vector<Row> rows;
  Seconds sooner = 0;  // what the players of such a file take off its times
  LineReader reader(text);
  for (std::string_view line; reader.next(line);) {
    std::vector<Seconds> starts;
    line = trimmed(line);
    if (constexpr std::string_view kOffset = "[offset:"; line.starts_with(kOffset) && line.ends_with(']')) {
      const std::string_view written = trimmed(line.substr(kOffset.size(), line.size() - kOffset.size() - 1));
      const auto milliseconds = parseNumber(written.starts_with('+') ? written.substr(1) : written);
      if (!milliseconds)
        throw InputError(name, std::to_string(reader.lineNumber()),
                         fmt::format("found the offset '{}'; expected milliseconds", printable(written)));
      sooner = *milliseconds * kMillisecond;
      continue;
    }
    for (line = trimmed(line); line.starts_with('['); line = trimmed(line)) {
      const std::size_t close = line.find(']');
      if (close == line.npos) break;
      const auto time = clockTime(line.substr(1, close - 1));
      if (!time && starts.empty() && line.find(':') < close) line = {};  // [by:whisper.cpp]
      if (!time) break;
      starts.push_back(*time);
      line.remove_prefix(close + 1);
    }
    for (const Seconds start : starts)
      rows.push_back({start, plainCue(line, builder), std::to_string(reader.lineNumber())});
  }
  std::ranges::stable_sort(rows, {}, [](const Row& row) { return std::pair(row.start, row.text.empty()); });
  // Two texts at one time are one line in two languages: the first is sung.
  for (std::size_t i = 1; i < rows.size();) {
    if (rows[i].start > rows[i - 1].start) {
      ++i;
      continue;
    }
    if (!rows[i].text.empty()) builder.addNotSaid(rows[i].text);
    rows.erase(rows.begin() + signedIndex(i));
  }
  for (Row& row : rows) row.start = std::max(0.0, row.start - sooner);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto words = std::ranges::count(rows[i].text, ' ') + 1;
    const Seconds most = rows[i].start + std::min(kLongestLine, 2 * kAWord * asReal(words));
    builder.addWord(rows[i].text, {rows[i].start, i + 1 < rows.size() ? std::min(most, rows[i + 1].start) : most},
                    rows[i].place);
  }
  return builder.finish();
}

/// Milliseconds and a text in quotes under "start,end,text".
TimesFile parseWhisperCsv(std::string_view text, std::string_view name) {
  TimesBuilder builder(name, "Whisper CSV");
  builder.setLines();
  LineReader reader(text);
  bool is_header = true;
  for (std::string_view line; reader.next(line);) {
    line = trimmed(line);
    if (line.empty() || std::exchange(is_header, false)) continue;
    const std::string place = std::to_string(reader.lineNumber());
    const std::size_t first = line.find(','), second = std::min(line.find(',', first + 1), line.size());
    if (first == line.npos || second == line.size())
      throw InputError(name, place, "has less than three fields; expected start, end and text");
    std::string_view said = trimmed(line.substr(second + 1));
    const bool is_quoted = said.size() > 1 && said.starts_with('"') && said.ends_with('"');
    if (is_quoted) said = said.substr(1, said.size() - 2);
    builder.addWord(trimmed(said),
                    {kMillisecond * requireSeconds(line.substr(0, first), name, place),
                     kMillisecond * requireSeconds(line.substr(first + 1, second - first - 1), name, place)},
                    place);
  }
  return builder.finish();
}

TimesFile parseRhubarbTsv(std::string_view text, std::string_view name) {
  TimesBuilder builder(name, "Rhubarb TSV");
  builder.setShapes();
  LineReader reader(text);
  std::vector<std::string_view> fields;
  std::optional<Phone> shape;
  std::optional<Seconds> start;
  std::string place;
  for (std::string_view line; reader.next(line);) {
    if (trimmed(line).empty()) continue;
    place = std::to_string(reader.lineNumber());
    splitFields(line, '\t', fields);
    if (fields.size() != 2)
      throw InputError(name, place, fmt::format("found {} fields; expected a time and a shape", fields.size()));
    const Seconds time = requireSeconds(fields[0], name, place);
    if (start) builder.addPhone(shape, {*start, time}, place);
    if (!start && time < 0) builder.addPhone(shape, {time, time}, place);  // says what is wrong
    shape = phoneOfShape(trimmed(fields[1]), name, place);
    start = time;
  }
  if (shape)
    throw InputError(name, place, "ends with a shape that is not X; expected X, which tells when the last one ends");
  return builder.finish();
}

TimesFile parseRhubarbXml(std::string_view text, std::string_view name) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20U;
  if (text.size() > kMostBytes) throw InputError(name, "", "is over 64 MiB; expected Rhubarb's XML");
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(text.data(), text.size());
  if (!result)
    throw InputError(name, fmt::format("byte {}", result.offset), fmt::format("is no XML: {}", result.description()));
  const pugi::xml_node cues = document.child("rhubarbResult").child("mouthCues");
  if (!cues) throw InputError(name, "", "has no rhubarbResult with mouthCues; expected Rhubarb's XML");
  TimesBuilder builder(name, "Rhubarb XML");
  builder.setShapes();
  std::size_t number = 0;
  for (const pugi::xml_node cue : cues.children("mouthCue")) {
    const std::string place = fmt::format("mouthCue {}", ++number);
    const TimeSpan span{requireSeconds(cue.attribute("start").value(), name, place),
                        requireSeconds(cue.attribute("end").value(), name, place)};
    builder.addPhone(phoneOfShape(trimmed(cue.child_value()), name, place), span, place);
  }
  return builder.finish();
}

TimesFile parseWordCtm(std::string_view text, std::string_view name) {
  TimesBuilder builder(name, "CTM");
  LineReader reader(text);
  std::string recording;
  for (std::string_view line; reader.next(line);) {
    if (trimmed(line).empty() || line.starts_with(";;")) continue;
    const std::string place = std::to_string(reader.lineNumber());
    std::vector<std::string> fields;
    for (std::size_t at = 0; (at = line.find_first_not_of(" \t\r", at)) != std::string_view::npos;) {
      const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      fields.emplace_back(line.substr(at, end - at));
      at = end;
    }
    if (fields.size() < 5) {
      throw InputError(name, place,
                       fmt::format("found {} fields; expected \"name channel start duration word\"", fields.size()));
    }
    if (recording.empty()) recording = fields[0];
    if (fields[0] != recording) {
      throw InputError(name, place,
                       fmt::format("found words of '{}' after those of '{}'; expected one recording a file",
                                   printable(fields[0]), printable(recording)));
    }
    const Seconds start = requireSeconds(fields[2], name, place);
    const Seconds duration = requireSeconds(fields[3], name, place);
    const double confidence = fields.size() > 5 ? parseNumber(fields[5]).value_or(1) : 1;
    if (!isSilenceName(fields[4])) builder.addWord(fields[4], {start, start + duration}, place, confidence);
  }
  return builder.finish();
}

}  // namespace mouthpiece
