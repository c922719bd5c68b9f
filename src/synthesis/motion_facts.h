#pragma once

#include <vector>

#include "synthesis/stages.h"

namespace mouthpiece {

/// Joins and mouth of a line's finished motion, whose rows are given in order, as many at a time as there are.
class MotionFacts {
 public:
  /// `joins`: middles of blends. `line` must outlive this.
  MotionFacts(std::vector<Seconds> joins, const LineToRender& line, std::size_t frame_count);
  void add(const PositionMatrix& rows);

  /// When all rows were given.
  [[nodiscard]] const std::vector<Join>& joins() const { return joins_; }
  [[nodiscard]] MouthFacts mouth() const;

 private:
  void look(const PositionMatrix& rows, Eigen::Index first);
  [[nodiscard]] Eigen::Index stillNeeded() const;

  const LineToRender& line_;
  Eigen::Index frame_count_, next_ = 0;  ///< next_: the frame after the last that was given
  std::vector<Seconds> times_;           ///< of the joins, rising
  std::vector<Join> joins_;
  double closed_mm_ = 0;
  std::vector<TimeSpan> bilabials_;
  std::size_t looked_at_ = 0;  ///< of them
  Eigen::Index bend_ = 1;      ///< the next frame whose neighbours are compared with it
  double squares_ = 0;
  MouthFacts mouth_;
  PositionMatrix tail_;  ///< rows before next_ that are needed again
};

}  // namespace mouthpiece
