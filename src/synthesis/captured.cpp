#include <algorithm>
#include <cmath>
#include <utility>

#include "base/index.h"
#include "motion/blend.h"
#include "synthesis/context_transfer.h"
#include "synthesis/stages.h"

namespace mouthpiece {

bool movesIntoContext(const std::vector<SelectedUnit>& units, const LineToRender& line) {
  const bool is_take_as_it_was =
      units.size() == 1 && isSaidAlike(line.labels, line.database.takeOf(units[0].source).labels);
  return line.options.context.enabled && line.options.selection.method == SelectionMethod::kViterbi &&
         line.database.corpus().trajectory_model != nullptr && !is_take_as_it_was;
}

PositionMatrix columnsOf(const PositionMatrix& positions, const std::vector<Eigen::Index>& columns) {
  PositionMatrix picked(positions.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i) picked.col(signedIndex(i)) = positions.col(columns[i]);
  return picked;
}

namespace {

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

/// 1 at the times at which a fragment is heard with its own sound, and softly less beside them.
Eigen::VectorXd heardShare(const std::vector<SelectedUnit>& units, std::span<const Seconds> times) {
  constexpr Seconds kFades = 0.06;
  Eigen::VectorXd share = Eigen::VectorXd::Zero(std::ssize(times));
  for (const SelectedUnit& unit : units) {
    if (!(unit.sound.duration() > 0)) continue;
    const auto first = std::lower_bound(times.begin(), times.end(), unit.sound.start - kFades);
    for (auto time = first; time != times.end() && *time < unit.sound.end + kFades; ++time) {
      const Seconds away = std::max({unit.sound.start - *time, *time - unit.sound.end, 0.0});
      double& own = share(time - times.begin());
      own = std::max(own, away < kFades ? blendWeight(BlendKind::kSmooth, away / kFades) : 0.0);
    }
  }
  return share;
}

/// Lips and sound of one recording belong together: where a fragment is heard it is seen as it was captured.
void keepHeardLips(StretchMotion& motion, const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                   const LineToRender& line) {
  const Eigen::VectorXd share = heardShare(units, times);
  if (!(share.maxCoeff() > 0)) return;
  const PositionMatrix captured = withoutUnseen(blendUnits(units, times, line, false).positions_mm, line.rest());
  const PositionMatrix lips =
      columnsOf(captured.rowwise() - Eigen::RowVectorXd(line.rest()), line.database.lipColumns());
  const auto rest_of = (1 - share.array()).matrix().asDiagonal();
  motion.positions_mm = share.asDiagonal() * captured + rest_of * motion.positions_mm;
  motion.parts.captured_mm = share.asDiagonal() * lips + rest_of * motion.parts.captured_mm;
  motion.parts.predicted_mm = rest_of * motion.parts.predicted_mm;
  motion.parts.contact_mm = rest_of * motion.parts.contact_mm;
}

/// EDGE 5.1.2 and 5.1.3, and the fragments moved into the line's context.
StretchMotion renderUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                          const LineToRender& line) {
  const bool into_context = movesIntoContext(units, line);
  const std::vector<Eigen::Index>& lips = line.database.lipColumns();
  StretchMotion motion = blendUnits(units, times, line, into_context);
  motion.parts = MovementParts::none(std::ssize(times), std::ssize(lips));
  if (into_context) {
    TransferredMotion moved = transferContext(std::move(motion.positions_mm), line.labels, line.database, units, times,
                                              line.options.context, line.heard ? &*line.heard : nullptr);
    motion.parts = {columnsOf(moved.predicted_mm, lips), columnsOf(moved.captured_mm, lips),
                    moved.contactMm(line.database.corpus().neutral_pose_mm, lips)};
    motion.positions_mm = std::move(moved.positions_mm);
  }
  motion.positions_mm = withoutUnseen(std::move(motion.positions_mm), line.rest());
  if (!into_context)
    motion.parts.captured_mm = columnsOf(motion.positions_mm.rowwise() - Eigen::RowVectorXd(line.rest()), lips);
  if (into_context && line.options.context.keep_heard) keepHeardLips(motion, units, times, line);
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
