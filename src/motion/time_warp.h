#pragma once

#include <span>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

/// What happens at `source` in the capture shall happen at `target` in the utterance.
struct TimeKnot {
  Seconds source = 0;
  Seconds target = 0;
};

/// The piecewise linear time map of EDGE 5.1.2, with a knot at each phone boundary; beyond the outer knots time runs on
/// at the capture's own speed (slope 1). Rises strictly, so it can be inverted.
class TimeWarp {
 public:
  /// Throws InputError unless there is a knot, all are finite, and both columns rise strictly.
  explicit TimeWarp(std::vector<TimeKnot> knots);

  [[nodiscard]] Seconds targetFromSource(Seconds source) const;
  [[nodiscard]] Seconds sourceFromTarget(Seconds target) const;
  [[nodiscard]] std::span<const TimeKnot> knots() const { return knots_; }

 private:
  std::vector<TimeKnot> knots_;
};

}  // namespace mouthpiece
