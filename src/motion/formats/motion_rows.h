#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_parts.h"
#include "motion/motion_pieces.h"

namespace mouthpiece {

/// Gathers the rows of a text table of positions; shared by the CSV and TRC readers.
class MotionRows {
 public:
  MotionRows(std::string_view file, std::size_t marker_count) : file_(file), column_count_(3 * marker_count) {}

  /// `cells`: x y z of each marker, blank or nan where it was not seen. `place` names the line in errors. Throws
  /// InputError for what is no number, too large or infinite, and for another count of cells (so memory stays in step
  /// with the file).
  void add(double time, std::span<const std::string_view> cells, double mm_per_unit, std::string_view place);

  [[nodiscard]] std::size_t rowCount() const { return times_.size(); }
  /// All rows; a sample of which one axis is missing is missing. `rate_hz` 0: from the times, which must then be even.
  [[nodiscard]] MotionClip takeClip(std::vector<std::string> marker_names, double rate_hz) const;

 private:
  [[nodiscard]] double rateFromTimes() const;
  /// Throws InputError where rows are missing, or stand at another rate.
  void expectTimesAt(double rate_hz) const;

  std::string file_;
  std::size_t column_count_;
  std::vector<double> times_;
  std::vector<double> values_;
};

/// A row a frame: its time, and each coordinate behind a `separator`, nothing where it was not seen; `begin` writes
/// what stands before a frame's time.
void appendMotionRows(const MotionInPieces& motion, char separator,
                      const std::function<void(std::string& text, std::size_t frame)>& begin,
                      const AppendBytes& append);
/// Throws InputError("FORMAT", place) for a name that is empty, has outer blanks or one of `forbidden`.
void expectWritableNames(const std::vector<std::string>& marker_names, std::string_view forbidden,
                         std::string_view format, std::string_view place);

/// Throws InputError when a name comes twice or is empty.
void expectDistinctNames(const std::vector<std::string>& names, std::string_view file, std::string_view place);

}  // namespace mouthpiece
