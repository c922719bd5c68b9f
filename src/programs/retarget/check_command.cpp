// retarget check --corpus, a part of the program: the captured closures of a corpus, played on a fitted face.
#include <algorithm>
#include <cmath>
#include <random>
#include <span>

#include "deform/surface/bezier_surface.h"
#include "deform/kernel/welding.h"
#include "motion/resample.h"
#include "programs/program.h"
#include "programs/retarget/commands.h"
#include "retarget/rig/face_rig.h"
#include "retarget/rig/lip_contact.h"
#include "synthesis/lips.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

constexpr Seconds kReach = 0.02;       ///< beyond both ends of a B P M: label error
constexpr double kClosedShare = 0.25;  ///< of the take's range of openings: what counts as closed in the capture

/// Distance of the outer lips in every frame; empty where the take does not tell.
std::vector<double> openingsOf(const CorpusTake& take) {
  const auto upper = take.motion.findMarker("LIP_UP_MID");
  const auto lower = take.motion.findMarker("LIP_LO_MID");
  std::vector<double> opening;
  if (!upper || !lower || !take.motion.positions_mm.allFinite()) return opening;
  for (FrameIndex frame{0}; frame.value < take.motion.frameCount(); ++frame.value)
    opening.push_back((take.motion.position(frame, *upper) - take.motion.position(frame, *lower)).norm());
  return opening;
}

using Openings = std::span<const double>;

/// The openings in a phone and `reach` around it.
Openings inPhone(const std::vector<double>& opening, double rate_hz, const TimeSpan& span, Seconds reach) {
  const auto first = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil((span.start - reach) * rate_hz)));
  const auto last = std::min(static_cast<std::ptrdiff_t>(opening.size()) - 1,
                             static_cast<std::ptrdiff_t>(std::floor((span.end + reach) * rate_hz)));
  if (last < first) return {};
  return Openings(opening).subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(last - first + 1));
}

/// The frame of each B P M in which the captured mouth is closed furthest, where it closes at all.
std::vector<std::size_t> closedFrames(const CorpusTake& take, const std::vector<double>& opening) {
  std::vector<std::size_t> frames;
  const auto [low, high] = std::minmax_element(opening.begin(), opening.end());
  for (const LabelledPhone& phone : take.labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    const Openings own = inPhone(opening, take.motion.frame_rate_hz, phone.span, kReach);
    const auto tightest = std::min_element(own.begin(), own.end());
    if (tightest != own.end() && *tightest < *low + kClosedShare * (*high - *low))
      frames.push_back(static_cast<std::size_t>(&*tightest - opening.data()));
  }
  return frames;
}

/// Of all takes together, every eighth phone that is neither B P M nor silence: where it is widest.
class OtherPhones {
 public:
  std::vector<std::size_t> widestFrames(const CorpusTake& take, const std::vector<double>& opening) {
    constexpr std::size_t kEach = 8;
    std::vector<std::size_t> frames;
    for (const LabelledPhone& phone : take.labels.phones) {
      if (isBilabial(phone.phone) || phone.phone == Phone::kSil || count_++ % kEach != 0) continue;
      const Openings own = inPhone(opening, take.motion.frame_rate_hz, phone.span, 0);
      const auto widest = std::max_element(own.begin(), own.end());
      if (widest != own.end()) frames.push_back(static_cast<std::size_t>(&*widest - opening.data()));
    }
    return frames;
  }

 private:
  std::size_t count_ = 0;
};

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
    const FaceMotion on_face = rig.retarget(frame, &actor);
    const auto pose = surface.pose(controlPoints(control_mesh, on_face.pose(FrameIndex{0})));
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
  const Welding welding = weldSplitTriangles(rig.mesh());
  const LipContactMeter meter(welding.isNothing() ? rig.mesh() : welding.mesh, control_mesh);
  ClosureCheck check;
  const auto contactIn = [&](const VertexPositions& pose) {
    return meter.measure(welding.isNothing() ? pose : welding.weldedFromGiven(pose));
  };
  const LipContact at_rest = contactIn(rig.mesh().vertices);
  check.overlap_at_rest_mm = mm * at_rest.overlap;
  check.in_teeth_at_rest_mm = mm * at_rest.in_teeth;
  const ActorPose actor{corpus.neutral_pose_mm, closedLipsMm(corpus)};
  ProgressBar progress("retarget check", corpus.takes.size(), quiet);
  std::vector<double> gaps;
  VertexPositions vertices;
  OtherPhones others;
  for (const CorpusTake& take : corpus.takes) {
    progress.advance();
    const std::vector<double> opening = openingsOf(take);
    if (opening.empty()) continue;
    const std::vector<std::size_t> closed = closedFrames(take, opening), open = others.widestFrames(take, opening);
    const std::vector<Seconds> times = frameTimes(0, take.motion.frameCount(), take.motion.frame_rate_hz);
    const FaceMotion on_face = rig.retarget(take.motion, &actor, lipsFromPhones(take.labels, times));
    const auto contactAt = [&](std::size_t frame) {
      rig.deform(on_face.pose(FrameIndex{frame}), TonguePose{}, vertices);
      return contactIn(vertices);
    };
    for (const std::size_t frame : closed) {
      const LipContact contact = contactAt(frame);
      gaps.push_back(mm * contact.gap);
      check.touching += mm * contact.gap <= kTouchMm ? 1 : 0;
      check.overlap_mm = std::max(check.overlap_mm, mm * contact.overlap);
      check.in_teeth_mm = std::max(check.in_teeth_mm, mm * contact.in_teeth);
    }
    for (const std::size_t frame : open) check.others_touching += mm * contactAt(frame).gap <= kTouchMm ? 1 : 0;
    check.others += open.size();
  }
  checkEdges(rig, control_mesh, corpus, actor, check);
  check.closures = gaps.size();
  check.gap_median_mm = quantile(gaps, 0.5);
  check.gap_p95_mm = quantile(gaps, 0.95);
  return check;
}

}  // namespace mouthpiece
