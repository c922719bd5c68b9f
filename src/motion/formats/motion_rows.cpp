#include "motion/formats/motion_rows.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <set>

#include "base/errors.h"
#include "base/text_numbers.h"
#include "motion/position_limits.h"

namespace mouthpiece {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// How far a frame may be from its even place, in frames.
constexpr double kMaxUnevenness = 0.25;
/// Times are written to a microsecond, so a rate found from them is this sure, in seconds over the whole clip.
constexpr double kTimeRounding = 2e-6;

double cellValue(std::string_view cell, double mm_per_unit, std::string_view file, std::string_view place) {
  cell = trimmed(cell);
  if (cell.empty()) return kNan;
  const std::optional<double> value = parseNumber(cell);
  if (!value) throw InputError(file, place, fmt::format("found \"{}\"; expected a number", printable(cell)));
  if (std::isnan(*value)) return kNan;
  if (!(std::abs(*value * mm_per_unit) <= kMaxPositionMm)) {
    throw InputError(
        file, place,
        fmt::format("found a position of {:g} mm; expected at most {:g}", *value * mm_per_unit, kMaxPositionMm));
  }
  return *value * mm_per_unit;
}

/// The rate that the writer most likely meant, when the times cannot tell it apart: a whole number, a television rate,
/// or one of few decimals.
double likelyRate(double rate, double uncertainty) {
  for (const double nominal : {std::round(rate), std::round(rate * 1.001) / 1.001, std::round(rate * 10.0) / 10.0,
                               std::round(rate * 100.0) / 100.0, std::round(rate * 1000.0) / 1000.0}) {
    if (nominal > 0.0 && std::abs(nominal - rate) <= uncertainty) return nominal;
  }
  return rate;
}

}  // namespace

void MotionRows::add(double time, std::span<const std::string_view> cells, double mm_per_unit, std::string_view place) {
  if (cells.size() != column_count_) {
    throw InputError(file_, place,
                     fmt::format("found {} cells of positions; expected {}", cells.size(), column_count_));
  }
  if (!std::isfinite(time)) throw InputError(file_, place, "found a time that is not finite");
  if (!times_.empty() && !(time > times_.back())) {
    throw InputError(file_, place,
                     fmt::format("found time {:g} s behind {:g} s; expected it to rise", time, times_.back()));
  }
  times_.push_back(time);
  const std::size_t first = values_.size();
  values_.resize(first + column_count_, kNan);
  for (std::size_t i = 0; i < cells.size(); ++i) values_[first + i] = cellValue(cells[i], mm_per_unit, file_, place);
  for (std::size_t i = first; i < values_.size(); i += 3) {
    if (std::isnan(values_[i] + values_[i + 1] + values_[i + 2])) values_[i] = values_[i + 1] = values_[i + 2] = kNan;
  }
}

double MotionRows::rateFromTimes() const {
  if (times_.size() < 2) throw InputError(file_, "", "found fewer than two rows; expected two to tell the frame rate");
  const double intervals = asReal(times_.size() - 1);
  const double length = times_.back() - times_.front();
  const double rate = intervals / length;
  for (std::size_t i = 0; i < times_.size(); ++i) {
    const double unevenness = std::abs((times_[i] - times_.front()) * rate - asReal(i));
    if (unevenness > kMaxUnevenness) {
      throw InputError(file_, fmt::format("row {}", i + 1),
                       fmt::format("found time {:g} s, {:.2f} frames from its place at {:g} Hz; expected even times",
                                   times_[i], unevenness, rate));
    }
  }
  return likelyRate(rate, rate * kTimeRounding / length);
}

void MotionRows::expectTimesAt(double rate_hz) const {
  constexpr double kMostOff = 0.5, kMostDrift = 0.02;  // frames from one row to the next; of all
  for (std::size_t i = 1; i < times_.size(); ++i) {
    const double step = (times_[i] - times_[i - 1]) * rate_hz, all = (times_[i] - times_.front()) * rate_hz;
    if (std::abs(step - 1) <= kMostOff && std::abs(all - asReal(i)) <= kMostOff + kMostDrift * asReal(i)) continue;
    throw InputError(file_, fmt::format("row {}", i + 1),
                     fmt::format("found time {:g} s after {:g} s; expected even times at the file's {:g} Hz", times_[i],
                                 times_[i - 1], rate_hz));
  }
}

MotionClip MotionRows::takeClip(std::vector<std::string> marker_names, double rate_hz) const {
  MotionClip clip;
  clip.frame_rate_hz = rate_hz > 0.0 ? rate_hz : rateFromTimes();
  if (rate_hz > 0) expectTimesAt(rate_hz);
  expectFrameRate(clip.frame_rate_hz, file_, "");
  clip.marker_names = std::move(marker_names);
  clip.positions_mm =
      Eigen::Map<const PositionMatrix>(values_.data(), signedIndex(times_.size()), signedIndex(column_count_));
  return clip;
}

void appendMotionRows(const MotionInPieces& motion, char separator,
                      const std::function<void(std::string& text, std::size_t frame)>& begin,
                      const AppendBytes& append) {
  constexpr int kTimeDecimals = 6, kPositionDecimals = 4;
  constexpr std::size_t kAtOnce = 1 << 20;
  std::string text;
  motion.forEach([&](std::size_t first_frame, const PositionMatrix& positions_mm) {
    MOUTHPIECE_EXPECT(unsignedIndex(positions_mm.cols()) == 3 * motion.markerCount());
    for (Eigen::Index row = 0; row < positions_mm.rows(); ++row) {
      const std::size_t frame = first_frame + unsignedIndex(row);
      begin(text, frame);
      appendFixed(text, asReal(frame) / motion.frame_rate_hz, kTimeDecimals);
      for (const double value : positions_mm.row(row)) {
        text += separator;
        if (std::isfinite(value)) appendFixed(text, value, kPositionDecimals);
      }
      text += '\n';
      if (text.size() < kAtOnce) continue;
      append(text);
      text.clear();
    }
  });
  append(text);
}

void expectWritableNames(const std::vector<std::string>& marker_names, std::string_view forbidden,
                         std::string_view format, std::string_view place) {
  for (const std::string& name : marker_names) {
    if (!name.empty() && name.find_first_of(forbidden) == std::string::npos && trimmed(name) == name) continue;
    throw InputError(format, place,
                     fmt::format("found marker name \"{}\"; expected no {}, line end or outer blank", printable(name),
                                 forbidden.starts_with(',') ? "comma, quote" : "tab"));
  }
}

void expectDistinctNames(const std::vector<std::string>& names, std::string_view file, std::string_view place) {
  std::set<std::string_view> seen;
  for (const std::string& name : names) {
    if (name.empty()) throw InputError(file, place, "found a marker without a name");
    if (!seen.insert(name).second) {
      throw InputError(file, place, fmt::format("found marker {} twice; expected each name once", printable(name)));
    }
  }
}

}  // namespace mouthpiece
