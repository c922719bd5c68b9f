#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "motion/resample.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

double largestStep(const MotionClip& motion, Eigen::Index frame) {
  const Eigen::RowVectorXd step = motion.positions_mm.row(frame + 1) - motion.positions_mm.row(frame);
  return Eigen::Map<const MarkerPositions>(step.data(), step.size() / 3, 3).rowwise().norm().maxCoeff();
}

double largestVelocityChange(const MotionClip& motion, Eigen::Index frame) {
  const auto& rows = motion.positions_mm;
  const Eigen::RowVectorXd change =
      (rows.row(frame + 1) - 2 * rows.row(frame) + rows.row(frame - 1)) * motion.frame_rate_hz;
  return Eigen::Map<const MarkerPositions>(change.data(), change.size() / 3, 3).rowwise().norm().maxCoeff();
}

}  // namespace

Join measureJoin(const MotionClip& motion, Seconds time) {
  Join join{time, 0, 0};
  const Eigen::Index last = motion.positions_mm.rows() - 1;
  if (last < 1) return join;
  const auto frame = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(time * motion.frame_rate_hz), 0, last - 1);
  join.position_jump_mm = largestStep(motion, frame);
  for (const Eigen::Index at : {frame, frame + 1}) {
    if (at < 1 || at >= last) continue;
    join.velocity_jump_mm_s = std::max(join.velocity_jump_mm_s, largestVelocityChange(motion, at));
  }
  return join;
}

FrameChange frameChangePercentile(const Corpus& corpus, double frame_rate_hz, double percentile) {
  std::vector<double> steps;
  std::vector<double> changes;
  const auto keepSeen = [](std::vector<double>& values, double value) {
    if (std::isfinite(value)) values.push_back(value);
  };
  for (std::size_t take = 0; take < corpus.takes.size(); ++take) {
    const bool on_demand = corpus.motion_source != nullptr;
    const MotionClip captured = on_demand ? corpus.motion_source->load(TakeIndex(take)) : corpus.takes[take].motion;
    const MotionClip motion = resampleClip(captured, frame_rate_hz);
    for (Eigen::Index frame = 0; frame + 1 < motion.positions_mm.rows(); ++frame) {
      keepSeen(steps, largestStep(motion, frame));
      if (frame > 0) keepSeen(changes, largestVelocityChange(motion, frame));
    }
  }
  const double share = std::clamp(percentile / 100, 0.0, 1.0);
  return {quantile(std::move(steps), share, 0), quantile(std::move(changes), share, 0)};
}

}  // namespace mouthpiece
