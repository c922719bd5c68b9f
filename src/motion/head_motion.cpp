#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "motion/rigid.h"

namespace mouthpiece {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// Rounds of "align, take the median": the median stops moving after two or three.
constexpr int kReferenceRounds = 3;

std::vector<Eigen::Index> rowsOf(std::span<const MarkerIndex> markers, std::size_t marker_count) {
  std::vector<Eigen::Index> rows;
  for (const MarkerIndex marker : markers) {
    MOUTHPIECE_EXPECT(marker.value < marker_count);
    rows.push_back(static_cast<Eigen::Index>(marker.value));
  }
  return rows;
}

/// A rotation as axis times angle, and the translation, side by side.
Eigen::Matrix<double, 1, 6> parametersOf(const RigidMotion& motion) {
  const Eigen::AngleAxisd turn(motion.rotation);
  Eigen::Matrix<double, 1, 6> parameters;
  parameters << (turn.angle() * turn.axis()).transpose(), motion.translation_mm.transpose();
  return parameters;
}

RigidMotion motionOf(const Eigen::Matrix<double, 1, 6>& parameters) {
  const Eigen::Vector3d turn = parameters.head<3>().transpose();
  const double angle = turn.norm();
  RigidMotion motion;
  if (angle > 0.0) motion.rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  motion.translation_mm = parameters.tail<3>().transpose();
  return motion;
}

/// The weighted least-squares parabola through the motions around `frame`, at `frame`. Motions are taken relative to
/// the frame's own, as small turns and shifts of `pivot_world`, where they hardly depend on each other.
RigidMotion smoothedAt(const std::vector<std::optional<RigidMotion>>& motions, std::size_t frame,
                       double half_width_frames, const Eigen::Vector3d& pivot_world) {
  const RigidMotion& own = *motions[frame];
  const RigidMotion to_pivot{Eigen::Matrix3d::Identity(), -own.apply(pivot_world)};
  const auto reach = static_cast<std::ptrdiff_t>(half_width_frames);
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 6> right_side = Eigen::Matrix<double, 3, 6>::Zero();
  int used = 0;
  for (std::ptrdiff_t offset = -reach; offset <= reach; ++offset) {
    const std::ptrdiff_t other = static_cast<std::ptrdiff_t>(frame) + offset;
    if (other < 0 || other >= static_cast<std::ptrdiff_t>(motions.size()) || !motions[static_cast<std::size_t>(other)])
      continue;
    const double u = static_cast<double>(offset) / (half_width_frames + 1.0);
    const double weight = std::pow(1.0 - std::abs(u * u * u), 3.0);
    const Eigen::Vector3d terms(1.0, u, u * u);
    // other after own^-1, seen from the pivot.
    const RigidMotion relative =
        to_pivot.after(*motions[static_cast<std::size_t>(other)]).after(own.inverse()).after(to_pivot.inverse());
    normal += weight * terms * terms.transpose();
    right_side += weight * terms * parametersOf(relative);
    ++used;
  }
  if (used < 4) return own;
  const Eigen::Matrix<double, 3, 6> parabola = normal.ldlt().solve(right_side);
  return to_pivot.inverse().after(motionOf(parabola.row(0))).after(to_pivot).after(own);
}

/// Brings all frames on one path that bends no faster than heads do. The paths are relative to each frame's own motion,
/// of which the clip's slow movement cancels: what is left is small.
void smoothHeadPath(const MotionClip& clip, std::span<const MarkerIndex> head_markers, double half_width_s,
                    std::vector<std::optional<RigidMotion>>& motions) {
  const double half_width_frames = std::floor(half_width_s * clip.frame_rate_hz);
  if (half_width_frames < 1.0) return;
  const std::vector<std::optional<RigidMotion>> rough = motions;
  for (std::size_t frame = 0; frame < motions.size(); ++frame) {
    if (!rough[frame]) continue;
    Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
    double seen = 0;
    for (const MarkerIndex marker : head_markers) {
      if (!clip.isSeen(FrameIndex(frame), marker)) continue;
      pivot += clip.position(FrameIndex(frame), marker);
      ++seen;
    }
    motions[frame] = smoothedAt(rough, frame, half_width_frames, pivot / seen);
  }
}

void applyToFrame(MotionClip& clip, std::size_t frame, const std::optional<RigidMotion>& motion) {
  auto row = clip.positions_mm.row(static_cast<Eigen::Index>(frame));
  if (!motion) {
    row.setConstant(kNan);
    return;
  }
  Eigen::Map<MarkerPositions> pose(row.data(), static_cast<Eigen::Index>(clip.markerCount()), 3);
  pose = ((pose * motion->rotation.transpose()).rowwise() + motion->translation_mm.transpose()).eval();
}

}  // namespace

HeadMotion removeHeadMotion(const MotionClip& clip, const MarkerPositions& reference,
                            std::span<const MarkerIndex> head_markers, const HeadMotionOptions& options) {
  MOUTHPIECE_EXPECT(static_cast<std::size_t>(reference.rows()) == clip.markerCount());
  const std::vector<Eigen::Index> rows = rowsOf(head_markers, clip.markerCount());
  const MarkerPositions target = reference(rows, Eigen::all);
  HeadMotion result{clip, {}, 0, 0.0};
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    const MarkerPositions pose = clip.pose(FrameIndex(frame));
    result.reference_from_world.push_back(fitRigidMotion(pose(rows, Eigen::all), target, options.fit));
    if (!result.reference_from_world.back()) ++result.frames_without_fit;
  }
  smoothHeadPath(clip, head_markers, options.smoothing_s, result.reference_from_world);

  double squared_sum = 0;
  double count = 0;
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    applyToFrame(result.still, frame, result.reference_from_world[frame]);
    const MarkerPositions pose = result.still.pose(FrameIndex(frame));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double squared = (pose.row(rows[i]) - target.row(static_cast<Eigen::Index>(i))).squaredNorm();
      if (!std::isfinite(squared)) continue;
      squared_sum += squared;
      ++count;
    }
  }
  if (count > 0) result.fit_rms_mm = std::sqrt(squared_sum / count);
  return result;
}

MarkerPositions medianAlignedPose(const MotionClip& clip, std::span<const MarkerIndex> head_markers,
                                  const RigidFitOptions& options) {
  std::size_t best_frame = 0;
  std::ptrdiff_t most_seen = -1;
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    const auto seen = std::count_if(head_markers.begin(), head_markers.end(),
                                    [&](MarkerIndex marker) { return clip.isSeen(FrameIndex(frame), marker); });
    if (seen > most_seen) {
      most_seen = seen;
      best_frame = frame;
    }
  }
  if (most_seen < 3) throw InputError("found no frame with three head markers; expected some to tell the head's place");
  std::vector<FrameIndex> frames;
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) frames.emplace_back(frame);
  MarkerPositions reference = clip.pose(FrameIndex(best_frame));
  for (int round = 0; round < kReferenceRounds; ++round) {
    reference = medianPose(removeHeadMotion(clip, reference, head_markers, {options, 0.0}).still, frames);
  }
  return reference;
}

}  // namespace mouthpiece
