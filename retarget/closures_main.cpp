// retarget check --corpus, a part of the program: the captured closures of a corpus, played on a fitted face.
#include <algorithm>
#include <cmath>
#include <random>

#include "deform/bezier_surface.h"
#include "programs/program.h"
#include "retarget/commands.h"
#include "retarget/face_rig.h"
#include "retarget/lip_contact.h"
#include "units/corpus.h"

namespace mouthpiece {
namespace {

constexpr Seconds kReach = 0.02;       ///< beyond both ends of a B P M: label error
constexpr double kClosedShare = 0.25;  ///< of the take's range of openings: what counts as closed in the capture

/// The frame of each B P M in which the captured mouth is closed furthest, where it closes at all.
std::vector<std::size_t> closedFrames(const CorpusTake& take) {
  const auto upper = take.motion.findMarker("LIP_UP_MID");
  const auto lower = take.motion.findMarker("LIP_LO_MID");
  std::vector<std::size_t> frames;
  if (!upper || !lower || take.motion.frameCount() == 0 || !take.motion.positions_mm.allFinite()) return frames;
  std::vector<double> opening;
  for (FrameIndex frame{0}; frame.value < take.motion.frameCount(); ++frame.value)
    opening.push_back((take.motion.position(frame, *upper) - take.motion.position(frame, *lower)).norm());
  const auto [low, high] = std::minmax_element(opening.begin(), opening.end());
  const double closed_below = *low + kClosedShare * (*high - *low);
  for (const LabelledPhone& phone : take.labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    const double rate = take.motion.frame_rate_hz;
    const auto first = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil((phone.span.start - kReach) * rate)));
    const auto last = std::min(static_cast<std::ptrdiff_t>(opening.size()) - 1,
                               static_cast<std::ptrdiff_t>(std::floor((phone.span.end + kReach) * rate)));
    if (last < first) continue;
    const auto tightest = std::min_element(opening.begin() + first, opening.begin() + last + 1);
    if (*tightest < closed_below) frames.push_back(static_cast<std::size_t>(tightest - opening.begin()));
  }
  return frames;
}

/// The largest angle between neighbouring patches over frames drawn from the whole corpus.
void checkEdges(const FaceRig& rig, const ControlMesh& control_mesh, const Corpus& corpus, const ActorPose& actor,
                ClosureCheck& check) {
  constexpr std::size_t kPoses = 1000;
  const BezierSurface surface(control_mesh);
  std::vector<const CorpusTake*> takes;
  for (const CorpusTake& take : corpus.takes) {
    if (take.motion.frameCount() > 0 && take.motion.positions_mm.allFinite()) takes.push_back(&take);
  }
  std::mt19937 random(66);
  for (; !takes.empty() && check.poses < kPoses; ++check.poses) {
    MotionClip frame = takes[random() % takes.size()]->motion;
    frame.positions_mm = frame.positions_mm.row(static_cast<Eigen::Index>(random() % frame.frameCount())).eval();
    const PositionMatrix control = rig.retarget(frame, &actor);
    const auto pose =
        surface.pose(controlPoints(control_mesh, {control.data(), static_cast<std::size_t>(control.cols())}));
    check.patch_edge_angle_max_deg = std::max(check.patch_edge_angle_max_deg, surface.maxNormalAngleAcrossEdges(pose));
  }
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

ClosureCheck checkClosures(const FaceRig& rig, const ControlMesh& control_mesh, const Corpus& corpus, bool quiet) {
  const double mm = 1000 * rig.mesh().metres_per_unit;
  const LipContactMeter meter(rig.mesh(), control_mesh);
  ClosureCheck check;
  const LipContact at_rest = meter.measure(rig.mesh().vertices);
  check.overlap_at_rest_mm = mm * at_rest.overlap;
  check.in_teeth_at_rest_mm = mm * at_rest.in_teeth;
  const ActorPose actor{corpus.neutral_pose_mm, closedLipsMm(corpus)};
  ProgressBar progress("retarget check", corpus.takes.size(), quiet);
  std::vector<double> gaps;
  VertexPositions vertices;
  for (const CorpusTake& take : corpus.takes) {
    progress.advance();
    const std::vector<std::size_t> frames = closedFrames(take);
    if (frames.empty()) continue;
    const PositionMatrix control = rig.retarget(take.motion, &actor);
    for (const std::size_t frame : frames) {
      const auto row = static_cast<Eigen::Index>(frame);
      rig.deform({control.row(row).data(), static_cast<std::size_t>(control.cols())}, TonguePose{}, vertices);
      const LipContact contact = meter.measure(vertices);
      gaps.push_back(mm * contact.gap);
      check.touching += mm * contact.gap <= kTouchMm ? 1 : 0;
      check.overlap_mm = std::max(check.overlap_mm, mm * contact.overlap);
      check.in_teeth_mm = std::max(check.in_teeth_mm, mm * contact.in_teeth);
    }
  }
  checkEdges(rig, control_mesh, corpus, actor, check);
  check.closures = gaps.size();
  check.gap_median_mm = quantile(gaps, 0.5);
  check.gap_p95_mm = quantile(gaps, 0.95);
  return check;
}

}  // namespace mouthpiece
