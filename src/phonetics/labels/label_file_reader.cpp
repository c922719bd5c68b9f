#include "phonetics/labels/label_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/index.h"
#include "base/statistics.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "phonetics/labels/label_entries.h"
#include "phonetics/labels/textgrid.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxLabFileBytes = std::uint64_t{64} << 20U;
/// A phone lasts 80 ms or so: 800,000 of HTK's units, 1,280 of TIMIT's samples. The geometric middle parts them.
constexpr double kHtkMedianDuration = 32000;

struct Line {
  std::vector<std::string_view> fields;
  std::size_t number = 0;
};

/// The words of each line that has any.
std::vector<Line> splitLines(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\f\v";
  std::vector<Line> lines;
  LineReader reader(text);
  for (std::string_view rest; reader.next(rest);) {
    Line line{{}, reader.lineNumber()};
    for (std::size_t at = 0; (at = rest.find_first_not_of(kBlanks)) != std::string_view::npos;) {
      rest.remove_prefix(at);
      line.fields.push_back(rest.substr(0, rest.find_first_of(kBlanks)));
      rest.remove_prefix(line.fields.back().size());
    }
    if (!line.fields.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

double parseTime(std::string_view file, const Line& line, std::size_t field) {
  const auto value = parseNumber(line.fields[field]);
  if (!value || !std::isfinite(*value)) {
    throw InputError(file, std::to_string(line.number),
                     fmt::format("found '{}'; expected a time", printable(line.fields[field])));
  }
  return *value;
}

[[noreturn]] void failFields(std::string_view file, const Line& line, std::string_view expected) {
  throw InputError(file, std::to_string(line.number),
                   fmt::format("found {} fields; expected \"{}\"", line.fields.size(), expected));
}

/// "end colour label" after the header's "#"; each label starts where the one before ends.
std::vector<LabelEntry> readEspsLines(std::string_view file, const std::vector<Line>& lines, std::size_t first) {
  std::vector<LabelEntry> entries;
  Seconds start = 0;
  for (std::size_t i = first; i < lines.size(); ++i) {
    const Line& line = lines[i];
    if (line.fields.size() < 2) failFields(file, line, "end colour label");
    const Seconds end = parseTime(file, line, 0);
    std::string_view label = line.fields.size() > 2 ? line.fields[2] : std::string_view();
    label = label.substr(0, label.find(';'));
    entries.push_back({std::string(label), {start, end}, std::to_string(line.number)});
    start = end;
  }
  return entries;
}

/// "start end label" with times as they stand.
std::vector<LabelEntry> readStartEndLines(std::string_view file, const std::vector<Line>& lines) {
  std::vector<LabelEntry> entries;
  for (const Line& line : lines) {
    if (line.fields.size() < 2) failFields(file, line, "start end label");
    const TimeSpan span{parseTime(file, line, 0), parseTime(file, line, 1)};
    const std::string_view label = line.fields.size() > 2 ? line.fields[2] : std::string_view();
    entries.push_back({std::string(label), span, std::to_string(line.number)});
  }
  return entries;
}

bool isCtmLine(const Line& line) {
  return line.fields.size() >= 5 && parseNumber(line.fields[2]) && parseNumber(line.fields[3]);
}

/// "name channel start duration label [confidence]", ";;" before a comment.
std::vector<LabelEntry> readCtmLines(std::string_view file, const std::vector<Line>& lines) {
  std::vector<LabelEntry> entries;
  std::string_view name;
  for (const Line& line : lines) {
    if (line.fields[0].starts_with(";;")) continue;
    if (line.fields.size() < 5) failFields(file, line, "name channel start duration label");
    if (name.empty()) name = line.fields[0];
    if (line.fields[0] != name) {
      throw InputError(file, std::to_string(line.number),
                       fmt::format("found labels of '{}' after those of '{}'; expected one file a take",
                                   printable(line.fields[0]), printable(name)));
    }
    const Seconds start = parseTime(file, line, 2);
    entries.push_back(
        {std::string(line.fields[4]), {start, start + parseTime(file, line, 3)}, std::to_string(line.number)});
  }
  return entries;
}

bool hasDecimalPoint(const std::vector<Line>& lines) {
  return std::any_of(lines.begin(), lines.end(), [](const Line& line) {
    return line.fields[0].find('.') != std::string_view::npos ||
           (line.fields.size() > 1 && line.fields[1].find('.') != std::string_view::npos);
  });
}

double medianDuration(const std::vector<LabelEntry>& entries) {
  std::vector<double> durations;
  for (const LabelEntry& entry : entries) durations.push_back(entry.span.duration());
  return median(std::move(durations));
}

bool endsEspsHeader(const Line& line) { return line.fields.size() == 1 && line.fields[0] == "#"; }

std::vector<LabelEntry> readEntries(std::string_view text, std::string_view file, const LabFileOptions& options) {
  const std::vector<Line> lines = splitLines(text);
  if (lines.empty()) throw InputError(file, "", "holds no labels; expected lines of \"start end label\"");
  if (lines[0].fields[0].starts_with('{') || lines[0].fields[0].starts_with('['))
    throw InputError(file, std::to_string(lines[0].number),
                     "begins as JSON does; expected a TextGrid or lines of \"start end label\"");
  if (lines[0].fields[0] == "#!MLF!#") throw InputError(file, "1", "is a master label file; expected one file a take");
  const auto hash = std::find_if(lines.begin(), lines.end(), endsEspsHeader);
  if (hash != lines.end()) return readEspsLines(file, lines, unsignedIndex(hash - lines.begin()) + 1);
  const auto first =
      std::find_if(lines.begin(), lines.end(), [](const Line& line) { return !line.fields[0].starts_with(";;"); });
  if (first != lines.end() && isCtmLine(*first)) return readCtmLines(file, lines);
  std::vector<LabelEntry> entries = readStartEndLines(file, lines);
  if (hasDecimalPoint(lines)) return entries;
  const double units_per_second =
      medianDuration(entries) >= kHtkMedianDuration ? kHtkUnitsPerSecond : options.timit_sample_rate_hz;
  for (LabelEntry& entry : entries) {
    entry.span = {entry.span.start / units_per_second, entry.span.end / units_per_second};
  }
  return entries;
}

}  // namespace

SpeechLabels parseLabFile(std::string_view bytes, std::string_view name, const LabFileOptions& options) {
  MOUTHPIECE_EXPECT(options.timit_sample_rate_hz > 0);
  const std::string text = decodeText(bytes, name);
  const auto entries = readEntries(text, name, options);
  auto phones = phonesFromEntries(name, entries, *options.language);
  if (phones.empty()) throw InputError(name, "", "holds no labels; expected phones with their times");
  return buildSpeechLabels(std::move(phones), std::vector<WordSegment>{}, entries.back().span.end, *options.language);
}

bool isLabFile(std::string_view text) {
  std::vector<Line> lines = splitLines(text);
  const auto hash = std::find_if(lines.begin(), lines.end(), endsEspsHeader);
  const bool is_esps = hash != lines.end();
  if (is_esps) lines.erase(lines.begin(), hash + 1);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const auto& fields = lines[i].fields;
    if (fields.size() < 3 || !parseNumber(fields[0]) || !parseNumber(fields[1])) return false;
    if (!is_esps && i > 0 && fields[0] != lines[i - 1].fields[1]) return false;
  }
  return lines.size() > 1;
}

SpeechLabels readLabels(const std::filesystem::path& path, const LabFileOptions& options) {
  const std::string bytes = readFile(path, kMaxLabFileBytes);
  expectText(bytes, path.string(), "labels, as a TextGrid");
  return isTextGrid(bytes) ? parseTextGrid(bytes, path.string(), *options.language)
                           : parseLabFile(bytes, path.string(), options);
}

}  // namespace mouthpiece
