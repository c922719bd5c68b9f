#include "motion/formats/motion_csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"
#include "motion/formats/motion_rows.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

/// What the second and third line tell by name.
struct TrcFacts {
  double rate_hz = 0;
  double mm_per_unit = 1;
};

double unitInMillimetres(std::string_view unit, std::string_view file) {
  if (unit == "mm") return 1.0;
  if (unit == "cm") return 10.0;
  if (unit == "m") return 1000.0;
  throw InputError(file, "3", fmt::format("found units \"{}\"; expected mm, cm or m", printable(unit)));
}

TrcFacts readFacts(std::string_view name_line, std::string_view value_line, std::string_view file) {
  std::vector<std::string_view> names;
  std::vector<std::string_view> values;
  splitFields(name_line, '\t', names);
  splitFields(value_line, '\t', values);
  TrcFacts facts;
  for (std::size_t i = 0; i < std::min(names.size(), values.size()); ++i) {
    const std::string_view name = trimmed(names[i]);
    if (name == "DataRate") facts.rate_hz = parseNumber(values[i]).value_or(0.0);
    if (name == "Units") facts.mm_per_unit = unitInMillimetres(trimmed(values[i]), file);
  }
  expectFrameRate(facts.rate_hz, file, "3");
  return facts;
}

/// "Frame#  Time  NAME  <empty>  <empty>  NAME ...": a name stands above its first axis.
std::vector<std::string> readNames(std::string_view line, std::string_view file) {
  std::vector<std::string_view> fields;
  splitFields(line, '\t', fields);
  if (fields.size() < 3 || trimmed(fields[0]) != "Frame#" || trimmed(fields[1]) != "Time") {
    throw InputError(file, "4", "expected the columns Frame#, Time and the marker names");
  }
  std::vector<std::string> names;
  for (std::size_t i = 2; i < fields.size(); i += 3) {
    if (const std::string_view name = trimmed(fields[i]); !name.empty()) names.emplace_back(name);
  }
  if (names.empty()) throw InputError(file, "4", "found no marker; expected names");
  expectDistinctNames(names, file, "4");
  return names;
}

std::string_view requiredLine(LineReader& lines, std::string_view file, std::string_view what) {
  std::string_view line;
  if (!lines.next(line)) throw InputError(file, "", fmt::format("ends in its header; expected {}", what));
  return line;
}

}  // namespace

MotionClip readTrcText(std::string_view text, std::string_view name) {
  LineReader lines(text);
  if (!requiredLine(lines, name, "PathFileType").starts_with("PathFileType")) {
    throw InputError(name, "1", "is no TRC file; expected PathFileType");
  }
  const std::string_view fact_names = requiredLine(lines, name, "the names DataRate, ...");
  const TrcFacts facts = readFacts(fact_names, requiredLine(lines, name, "the data rate"), name);
  std::vector<std::string> marker_names = readNames(requiredLine(lines, name, "the marker names"), name);
  requiredLine(lines, name, "the axes X1, Y1, Z1, ...");

  MotionRows rows(name, marker_names.size());
  std::vector<std::string_view> cells;
  std::string_view line;
  while (lines.next(line)) {
    if (trimmed(line).empty()) continue;
    const std::string place = fmt::format("{}", lines.lineNumber());
    splitFields(line, '\t', cells);
    const std::optional<double> time = cells.size() > 1 ? parseNumber(cells[1]) : std::nullopt;
    if (!time) throw InputError(name, place, "found no time; expected frame number, time and positions");
    // Many writers end each row with a tab.
    while (cells.size() > 2 + 3 * marker_names.size() && trimmed(cells.back()).empty()) cells.pop_back();
    rows.add(*time, std::span(cells).subspan(2), facts.mm_per_unit, place);
  }
  if (rows.rowCount() == 0) throw InputError(name, "", "found no frames; expected at least one");
  return rows.takeClip(std::move(marker_names), facts.rate_hz);
}

MotionClip readTrc(const std::filesystem::path& path) { return readTrcText(readFile(path), path.string()); }

namespace {

void appendTrc(const MotionInPieces& motion, std::string_view file_name, const AppendBytes& append) {
  expectWritableNames(motion.marker_names, "\t\n\r", "TRC", "4");
  expectFrameRate(motion.frame_rate_hz, "TRC", "DataRate");
  const std::string rate = fmt::format("{}", motion.frame_rate_hz);
  std::string text = fmt::format(
      "PathFileType\t4\t(X/Y/Z)\t{0}\n"
      "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
      "{1}\t{1}\t{2}\t{3}\tmm\t{1}\t1\t{2}\nFrame#\tTime",
      printable(file_name, 200), rate, motion.frame_count, motion.markerCount());
  for (const std::string& marker : motion.marker_names) text += fmt::format("\t{}\t\t", marker);
  text += "\n\t";
  for (std::size_t i = 1; i <= motion.markerCount(); ++i) text += fmt::format("\tX{0}\tY{0}\tZ{0}", i);
  append(text + "\n\n");
  const auto number = [](std::string& row, std::size_t frame) { row += fmt::format("{}\t", frame + 1); };
  appendMotionRows(motion, '\t', number, append);
}

}  // namespace

std::string writeTrcText(const MotionClip& clip, std::string_view file_name) {
  std::string text;
  appendTrc(inOnePiece(clip), file_name, [&text](std::string_view more) { text += more; });
  return text;
}

void writeTrc(const std::filesystem::path& path, const MotionClip& clip) { writeTrc(path, inOnePiece(clip)); }

void writeTrc(const std::filesystem::path& path, const MotionInPieces& motion) {
  writeFileInParts(path, [&](const AppendBytes& append) { appendTrc(motion, path.filename().string(), append); });
}

}  // namespace mouthpiece
