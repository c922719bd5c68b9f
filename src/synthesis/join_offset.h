#pragma once

#include <span>
#include <vector>

#include "synthesis/fragment.h"
#include "synthesis/join.h"

namespace mouthpiece {

/// By how much the markers of two fragments lie apart at the middle of their join. Left to the blend alone, 3 mm in 60
/// ms are a jerk; so the fragments are first led towards each other, the one before over `reach_before` up to the join,
/// the one after over `reach_after` from there, each by its share. Neither reach touches a phone whose lips must close
/// or touch the teeth: there a shift would open them.
struct JoinOffset {
  Seconds time = 0;
  Seconds reach_before = 0;
  Seconds reach_after = 0;
  Eigen::RowVectorXd offset_mm;  ///< after - before, all columns; 0 where not seen

  [[nodiscard]] Eigen::RowVectorXd shiftOfBefore(Seconds at) const;
  [[nodiscard]] Eigen::RowVectorXd shiftOfAfter(Seconds at) const;
};

/// One for each join, joins[i] lying between fragments i and i + 1.
std::vector<JoinOffset> findJoinOffsets(const SpeechLabels& line, const std::vector<UnitFragment>& fragments,
                                        const std::vector<JoinSpans>& joins);

}  // namespace mouthpiece
