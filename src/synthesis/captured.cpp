#include <algorithm>
#include <cmath>

#include "base/index.h"
#include "synthesis/context_transfer.h"
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

PositionMatrix columnsOf(const PositionMatrix& positions, const std::vector<Eigen::Index>& columns) {
  PositionMatrix picked(positions.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i) picked.col(signedIndex(i)) = positions.col(columns[i]);
  return picked;
}

/// EDGE 5.1.2 and 5.1.3, and the fragments moved into the line's context.
StretchMotion renderUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                          const LineToRender& line) {
  const bool into_context = movesIntoContext(units, line);
  const std::vector<Eigen::Index>& lips = line.database.lipColumns();
  StretchMotion motion = blendUnits(units, times, line, into_context);
  motion.parts = MovementParts::none(std::ssize(times), std::ssize(lips));
  if (into_context) {
    TransferredMotion moved =
        transferContext(motion.positions_mm, line.labels, line.database, units, times, line.options.context);
    motion.parts = {columnsOf(moved.predicted_mm, lips), columnsOf(moved.captured_mm, lips),
                    columnsOf(moved.contactMm(line.database.corpus().neutral_pose_mm), lips)};
    motion.positions_mm = std::move(moved.positions_mm);
  }
  motion.positions_mm = withoutUnseen(std::move(motion.positions_mm), line.rest());
  if (!into_context)
    motion.parts.captured_mm = columnsOf(motion.positions_mm.rowwise() - Eigen::RowVectorXd(line.rest()), lips);
  return motion;
}

}  // namespace

std::vector<StretchMotion> renderCaptured(const std::vector<Stretch>& stretches, const LineToRender& line) {
  std::vector<StretchMotion> motions(stretches.size());
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    if (!stretches[i].units.empty()) motions[i] = renderUnits(stretches[i].units, line.timesOf(stretches[i]), line);
  }
  return motions;
}

}  // namespace mouthpiece
