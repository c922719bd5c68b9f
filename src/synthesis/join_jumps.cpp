#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "motion/resample.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

double largestStep(const PositionMatrix& rows, Eigen::Index row) {
  const Eigen::RowVectorXd step = rows.row(row + 1) - rows.row(row);
  return Eigen::Map<const MarkerPositions>(step.data(), step.size() / 3, 3).rowwise().norm().maxCoeff();
}

double largestVelocityChange(const PositionMatrix& rows, Eigen::Index row, double rate) {
  const Eigen::RowVectorXd change = (rows.row(row + 1) - 2 * rows.row(row) + rows.row(row - 1)) * rate;
  return Eigen::Map<const MarkerPositions>(change.data(), change.size() / 3, 3).rowwise().norm().maxCoeff();
}

}  // namespace

Eigen::Index joinFrame(Seconds time, double frame_rate_hz, Eigen::Index frame_count) {
  return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(time * frame_rate_hz), 0,
                                  std::max<Eigen::Index>(0, frame_count - 2));
}

Join measureJoin(const PositionMatrix& rows, Eigen::Index first, Eigen::Index frame_count, double frame_rate_hz,
                 Seconds time) {
  Join join{time, 0, 0};
  const Eigen::Index last = frame_count - 1;
  if (last < 1) return join;
  const Eigen::Index frame = joinFrame(time, frame_rate_hz, frame_count);
  join.position_jump_mm = largestStep(rows, frame - first);
  for (const Eigen::Index at : {frame, frame + 1}) {
    if (at < 1 || at >= last) continue;
    join.velocity_jump_mm_s = std::max(join.velocity_jump_mm_s, largestVelocityChange(rows, at - first, frame_rate_hz));
  }
  return join;
}

Join measureJoin(const MotionClip& motion, Seconds time) {
  return measureJoin(motion.positions_mm, 0, motion.positions_mm.rows(), motion.frame_rate_hz, time);
}

FrameChange frameChangePercentile(const Corpus& corpus, double frame_rate_hz, double percentile) {
  std::vector<double> steps;
  std::vector<double> changes;
  const auto keepSeen = [](std::vector<double>& values, double value) {
    if (std::isfinite(value)) values.push_back(value);
  };
  for (std::size_t take = 0; take < takeCount(corpus); ++take) {
    const bool on_demand = corpus.take_source != nullptr;
    const MotionClip captured = on_demand ? corpus.take_source->load(TakeIndex(take)) : corpus.takes[take].motion;
    const MotionClip motion = resampleClip(captured, frame_rate_hz);
    for (Eigen::Index frame = 0; frame + 1 < motion.positions_mm.rows(); ++frame) {
      keepSeen(steps, largestStep(motion.positions_mm, frame));
      if (frame > 0) keepSeen(changes, largestVelocityChange(motion.positions_mm, frame, frame_rate_hz));
    }
  }
  const double share = std::clamp(percentile / 100, 0.0, 1.0);
  return {quantile(std::move(steps), share, 0), quantile(std::move(changes), share, 0)};
}

}  // namespace mouthpiece
