#include "motion/formats/motion_csv.h"

#include <fmt/format.h>

#include <cmath>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"
#include "motion/formats/motion_rows.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr std::string_view kTimeColumn = "time_s";

/// "LIP_UP_MID.x,LIP_UP_MID.y,LIP_UP_MID.z" behind the time column, for each marker.
std::vector<std::string> readHeader(std::string_view line, std::string_view file) {
  std::vector<std::string_view> columns;
  splitFields(line, ',', columns);
  if (trimmed(columns[0]) != kTimeColumn) {
    throw InputError(
        file, "1",
        fmt::format(
            "found first column \"{}\"; expected {}{}", printable(columns[0]), kTimeColumn,
            trimmed(columns[0]) == "Timecode" ? " (a Live Link Face take needs a head with ARKit's shapes)" : ""));
  }
  if (columns.size() < 4 || columns.size() % 3 != 1) {
    throw InputError(file, "1",
                     fmt::format("found {} columns; expected time_s and three for each marker", columns.size()));
  }
  std::vector<std::string> names;
  for (std::size_t i = 1; i < columns.size(); i += 3) {
    const std::string_view first = trimmed(columns[i]);
    const std::string_view name = first.substr(0, first.size() < 2 ? 0 : first.size() - 2);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::string expected = fmt::format("{}.{}", name, "xyz"[axis]);
      if (name.empty() || trimmed(columns[i + axis]) != expected) {
        throw InputError(file, "1",
                         fmt::format("found column \"{}\"; expected NAME.x,NAME.y,NAME.z for each marker",
                                     printable(columns[i + axis])));
      }
    }
    names.emplace_back(name);
  }
  expectDistinctNames(names, file, "1");
  return names;
}

}  // namespace

MotionClip readMotionCsvText(std::string_view text, std::string_view name) {
  LineReader lines(text);
  std::string_view line;
  if (!lines.next(line)) throw InputError(name, "", "is empty; expected a header time_s,NAME.x,NAME.y,NAME.z,...");
  std::vector<std::string> marker_names = readHeader(line, name);
  MotionRows rows(name, marker_names.size());
  std::vector<std::string_view> cells;
  while (lines.next(line)) {
    if (trimmed(line).empty()) continue;
    const std::string place = fmt::format("{}", lines.lineNumber());
    splitFields(line, ',', cells);
    if (cells.size() != 3 * marker_names.size() + 1) {
      throw InputError(name, place,
                       fmt::format("found {} cells; expected {}", cells.size(), 3 * marker_names.size() + 1));
    }
    const std::optional<double> time = parseNumber(cells[0]);
    if (!time) throw InputError(name, place, fmt::format("found time \"{}\"; expected seconds", printable(cells[0])));
    rows.add(*time, std::span(cells).subspan(1), 1.0, place);
  }
  return rows.takeClip(std::move(marker_names), 0.0);
}

MotionClip readMotionCsv(const std::filesystem::path& path) { return readMotionCsvText(readFile(path), path.string()); }

namespace {

void appendCsv(const MotionInPieces& motion, const AppendBytes& append) {
  expectWritableNames(motion.marker_names, ",\"\n\r", "CSV", kTimeColumn);
  expectFrameRate(motion.frame_rate_hz, "CSV", kTimeColumn);
  std::string header(kTimeColumn);
  for (const std::string& marker : motion.marker_names) header += fmt::format(",{0}.x,{0}.y,{0}.z", marker);
  append(header + '\n');
  appendMotionRows(
      motion, ',', [](std::string&, std::size_t) {}, append);
}

}  // namespace

std::string writeMotionCsvText(const MotionClip& clip) {
  std::string text;
  appendCsv(inOnePiece(clip), [&text](std::string_view more) { text += more; });
  return text;
}

void writeMotionCsv(const std::filesystem::path& path, const MotionClip& clip) {
  writeMotionCsv(path, inOnePiece(clip));
}

void writeMotionCsv(const std::filesystem::path& path, const MotionInPieces& motion) {
  writeFileInParts(path, [&](const AppendBytes& append) { appendCsv(motion, append); });
}

}  // namespace mouthpiece
