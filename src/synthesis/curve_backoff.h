#pragma once

#include <functional>
#include <vector>

#include "motion/blend.h"
#include "synthesis/curve_options.h"
#include "synthesis/utterance_animation.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

/// Captured units in a row; what lies between two such runs is made of curves.
struct CapturedRun {
  std::vector<SelectedUnit> units;  ///< at least one; phones index the whole line
  [[nodiscard]] PhoneRange phones() const { return {units.front().phones.first, units.back().phones.last}; }
};

/// Chooses units for all of the line but the pairs of phones that the corpus lacks: each stretch between two such pairs
/// is selected by itself. The runs cover the line except for gaps of at least one pair.
std::vector<CapturedRun> selectAroundGaps(const SpeechLabels& labels, const UnitDatabase& database,
                                          const SelectionOptions& options);
/// The same of units that were chosen before: stand-ins make the gaps.
std::vector<CapturedRun> runsOf(const std::vector<SelectedUnit>& units);

/// The phones between the runs, each with one phone shared on either side where there is a run.
std::vector<PhoneRange> gapsBetween(const std::vector<CapturedRun>& runs, std::size_t phone_count);

/// Makes the captured motion of some units at some times: times x (3 * markers), mm, no NaN.
using RenderUnits = std::function<PositionMatrix(const std::vector<SelectedUnit>&, const std::vector<Seconds>&)>;

/// The line's motion, for each gap as the curves have it, blended with the runs inside the shared phones as a unit is.
/// The curves are led to meet the captured poses at both joins; the offset fades out over at most kOffsetReach, and
/// contacts are kept. Without runs: the curves alone.
struct ComposedMotion {
  PositionMatrix positions_mm;
  std::vector<Seconds> joins;  ///< middles of the blends between runs and curves
};
ComposedMotion composeRuns(const SpeechLabels& labels, const std::vector<CapturedRun>& runs, const RenderUnits& render,
                           const CurveSet& curves, const VocalStyle& style, const VisemePoses& visemes,
                           const MarkerPositions& neutral_mm, const std::vector<Seconds>& times, Seconds overlap,
                           BlendKind blend);
inline constexpr Seconds kOffsetReach = 0.4;

}  // namespace mouthpiece
