#include <algorithm>
#include <cmath>

#include "base/index.h"
#include "synthesis/context_transfer.h"
#include "synthesis/join.h"
#include "synthesis/stages.h"

namespace mouthpiece {
namespace {

/// Whether the fragments are moved from their takes' context into the line's. A take's own sentence in its own time is
/// not: nothing makes it better than it was captured.
bool movesIntoContext(const std::vector<SelectedUnit>& units, const LineToRender& line) {
  const bool is_take_as_it_was =
      units.size() == 1 && isSaidAlike(line.labels, line.database.takeOf(units[0].source).labels);
  return line.options.context.enabled && line.options.selection.method == SelectionMethod::kViterbi &&
         line.database.corpus().trajectory_model != nullptr && !is_take_as_it_was;
}

/// Where the sound goes over from one unit to the next; none where another voice speaks.
std::optional<Seconds> soundCut(const SelectedUnit& before, const SelectedUnit& after) {
  constexpr Seconds kRounding = 1e-6;
  const bool both_sound = before.sound.duration() > 0 && after.sound.duration() > 0;
  if (!both_sound || std::abs(before.sound.end - after.sound.start) > kRounding) return std::nullopt;
  return before.sound.end;
}

TimeSpan notBefore(const TimeSpan& span, const TimeSpan& earlier) {
  return {std::max(span.start, earlier.start), std::max(span.end, earlier.end)};
}

/// Joins lie in the order of the line, so that each blend begins where the one before has begun.
std::vector<JoinSpans> placeJoins(const std::vector<UnitFragment>& fragments, const std::vector<SelectedUnit>& units,
                                  const LineToRender& line, bool search_coupling) {
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    JoinSpans join = placeJoin(line.labels, fragments[i].fragment, fragments[i + 1].fragment,
                               {line.overlap(), line.options.frame_rate_hz, search_coupling,
                                soundCut(units[fragments[i].unit], units[fragments[i + 1].unit])});
    if (!joins.empty()) {
      join.lips = notBefore(join.lips, joins.back().lips);
      join.upper_face = notBefore(join.upper_face, joins.back().upper_face);
    }
    joins.push_back(join);
  }
  return joins;
}

/// What is still NaN at a fragment's edge takes the value before, at the beginning the first one there is, and the
/// neutral pose where there is none.
PositionMatrix withoutUnseen(PositionMatrix positions, const Eigen::RowVectorXd& rest) {
  if (positions.allFinite()) return positions;
  for (Eigen::Index column = 0; column < positions.cols(); ++column) {
    auto values = positions.col(column);
    const auto first = std::find_if(values.begin(), values.end(), [](double mm) { return !std::isnan(mm); });
    double last = first == values.end() ? rest(column) : *first;
    for (double& mm : values) last = mm = std::isnan(mm) ? last : mm;
  }
  return positions;
}

/// EDGE 5.1.2 and 5.1.3: warped, resampled, blended; and moved into the line's context.
StretchMotion renderUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                          const LineToRender& line) {
  const bool into_context = movesIntoContext(units, line);
  const std::vector<UnitFragment> fragments = cutIntoFragments(line.labels, line.database, units, into_context);
  const std::vector<JoinSpans> joins =
      placeJoins(fragments, units, line, into_context && line.options.search_coupling);
  std::vector<JoinOffset> offsets;  // a bare cut, when no blend is wanted
  if (line.overlap() > 0) offsets = findJoinOffsets(line.labels, fragments, joins);
  PositionMatrix positions =
      blendFragments(fragments, joins, offsets, times, line.options.blend, line.database.corpus().layout);
  if (into_context) positions = transferContext(positions, line.labels, line.database, times, line.options.context);
  if (into_context && line.options.context.keep_contacts)
    positions = keepContacts(std::move(positions), line.labels, line.database, units, times);
  StretchMotion motion{withoutUnseen(std::move(positions), line.rest()), {}};
  for (std::size_t i = 0; i < joins.size(); ++i) {
    // Between two fragments of one unit lies a pause of the take itself.
    if (fragments[i].unit != fragments[i + 1].unit) motion.joins.push_back(joins[i].lips.middle());
  }
  return motion;
}

}  // namespace

std::vector<StretchMotion> renderCaptured(const std::vector<Stretch>& stretches, const LineToRender& line) {
  std::vector<StretchMotion> motions(stretches.size());
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (!stretches[i].units.empty())
      motions[i] = renderUnits(stretches[i].units, line.timesOf(stretches[i]), line);
  }
  return motions;
}

}  // namespace mouthpiece
