#include "tracking/marker_refining.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/index.h"
#include "base/smooth_step.h"
#include "base/statistics.h"
#include "motion/cleaning/repairs.h"
#include "motion/cleaning/rigid.h"

namespace mouthpiece {
namespace {

/// Pairs across the opening, next to its middle.
constexpr std::array<std::pair<Eigen::Index, Eigen::Index>, 3> kInnerLips{{{13, 14}, {82, 87}, {312, 317}}};
constexpr Eigen::Index kUpperLip = 0, kLowerLip = 17;
/// Brow, bridge, forehead, temples and eye corners: what speech moves least.
constexpr std::array<Eigen::Index, 34> kHeadLandmarks{10,  151, 9,   8,  168, 6,   197, 195, 5,   33, 133, 263,
                                                      362, 103, 332, 67, 297, 54,  284, 109, 338, 21, 251, 127,
                                                      356, 162, 389, 69, 299, 108, 337, 104, 333, 4};
/// How far the inner lips open, over what they read while touching, until the lips no longer count as closed.
constexpr double kOpeningMm = 0.7;
constexpr Eigen::Index kRestFrames = 8;  // a third of a second at 25 Hz

double innerGap(const FaceLandmarks& face) {
  double sum = 0;
  for (const auto& [upper, lower] : kInnerLips) sum += (face.row(upper) - face.row(lower)).norm();
  return sum / asReal(kInnerLips.size());
}

MarkerPositions headPoints(const FaceLandmarks& face, double scale) {
  MarkerPositions points(signedIndex(kHeadLandmarks.size()), 3);
  for (std::size_t i = 0; i < kHeadLandmarks.size(); ++i) {
    const auto point = face.row(kHeadLandmarks[i]);
    points.row(signedIndex(i)) = scale * Eigen::RowVector3d(point.x(), -point.y(), -point.z());
  }
  return points;
}

/// Three places on the head, decimetres apart, that stand for its motion.
const Eigen::Matrix3d kPlaces = (Eigen::Matrix3d() << -60, 0, 0, 60, 0, 0, 0, 80, -60).finished();

/// Where the head is in each frame, relative to its first; none where it is not seen. Smoothed by itself: a head is
/// heavier than lips.
std::vector<std::optional<RigidMotion>> headMotions(const FaceTrack& track, double scale) {
  std::optional<MarkerPositions> first;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  MotionClip places{track.frame_rate_hz, {"a", "b", "c"}, {}};
  places.positions_mm.setConstant(signedIndex(track.frames.size()), 9, std::nan(""));
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (!track.frames[frame]) continue;
    const MarkerPositions points = headPoints(*track.frames[frame], scale);
    if (!first) {
      first = points;
      middle = points.colwise().mean().transpose();
    }
    const auto motion = fitRigidMotion(*first, points, {.robust_rounds = 2});
    if (!motion) continue;
    for (Eigen::Index i = 0; i < 3; ++i)
      places.positions_mm.block<1, 3>(signedIndex(frame), 3 * i) =
          motion->apply(middle + kPlaces.row(i).transpose()).transpose();
  }
  const MotionClip smooth = smoothMotion(places).clip;
  const MarkerPositions still = kPlaces.rowwise() + middle.transpose();
  std::vector<std::optional<RigidMotion>> motions;
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame)
    motions.push_back(fitRigidMotion(still, smooth.pose(FrameIndex(frame)), {.robust_rounds = 0}));
  return motions;
}

/// The clip seen from the head, or back from there.
void moveFrames(MotionClip& clip, const std::vector<std::optional<RigidMotion>>& motions, bool to_head) {
  for (std::size_t frame = 0; frame < clip.frameCount(); ++frame) {
    if (!motions[frame]) continue;
    const RigidMotion motion = to_head ? motions[frame]->inverse() : *motions[frame];
    for (Eigen::Index i = 0; i < signedIndex(clip.markerCount()); ++i) {
      auto point = clip.positions_mm.block<1, 3>(signedIndex(frame), 3 * i);
      point = motion.apply(point.transpose()).transpose().eval();
    }
  }
}

/// 1 while the lips touch, 0 when they are clearly open.
double closedness(double inner_gap_mm, const FilmedPerson& person) {
  return 1 - smoothStep((inner_gap_mm - person.inner_closed_mm) / kOpeningMm);
}

struct Lips {
  std::optional<MarkerIndex> upper, lower, right, left;

  Lips(const MotionClip& clip, const MarkerLayout& layout) {
    const auto find = [&](MarkerRole role) -> std::optional<MarkerIndex> {
      const auto marker = layout.findRole(role);
      return marker ? clip.findMarker(layout.markers[marker->value].name) : std::nullopt;
    };
    upper = find(MarkerRole::kUpperLip);
    lower = find(MarkerRole::kLowerLip);
    right = find(MarkerRole::kRightLipCorner);
    left = find(MarkerRole::kLeftLipCorner);
  }
  [[nodiscard]] bool areThere() const { return upper && lower && right && left; }
};

/// Gives the lips of one frame the distance that they have when closed, as far as they are: markers move along the line
/// between the lips' middles, less towards the corners.
void closeLips(MotionClip& clip, FrameIndex frame, const Lips& lips, double share, double closed_lips_mm) {
  const Eigen::Vector3d upper = clip.position(frame, *lips.upper), lower = clip.position(frame, *lips.lower);
  const Eigen::Vector3d right = clip.position(frame, *lips.right), left = clip.position(frame, *lips.left);
  const double gap = (upper - lower).norm(), half_width = (left - right).norm() / 2;
  if (!(gap > 0 && half_width > 0)) return;
  const Eigen::Vector3d up = (upper - lower) / gap, across = (left - right) / (2 * half_width);
  const double change = share * (closed_lips_mm - gap) / 2;
  for (std::size_t i = 0; i < clip.markerCount(); ++i) {
    const LipSide side = lipSideOf(clip.marker_names[i]);
    if (side == LipSide::kNone || !clip.isSeen(frame, MarkerIndex(i))) continue;
    const double place = (clip.position(frame, MarkerIndex(i)) - (right + left) / 2).dot(across) / half_width;
    const double amount = change * std::max(0.0, 1 - place * place) * (side == LipSide::kUpper ? 1 : -1);
    clip.positions_mm.block<1, 3>(signedIndex(frame.value), signedIndex(3 * i)) += amount * up.transpose();
  }
}

/// A marker's noise while it rests: of all stretches of a third of a second the quietest tenth.
void addRestNoise(const MotionClip& clip, std::vector<double>& noises) {
  std::vector<double> found;
  for (Eigen::Index first = 0; first + kRestFrames <= clip.positions_mm.rows(); first += kRestFrames / 2) {
    const MotionClip part{clip.frame_rate_hz, clip.marker_names, clip.positions_mm.middleRows(first, kRestFrames)};
    if (part.positions_mm.allFinite()) found.push_back(estimateNoise(part));
  }
  std::sort(found.begin(), found.end());
  found.resize((found.size() + 9) / 10);
  noises.insert(noises.end(), found.begin(), found.end());
}

}  // namespace

std::optional<FilmedPerson> measurePerson(std::span<const FaceTrack> tracks, const MarkerLayout& layout,
                                          std::optional<double> eye_corners_mm) {
  const std::optional<double> size = eye_corners_mm ? eye_corners_mm : eyeCornersFromIrises(tracks);
  if (!size) return std::nullopt;
  FilmedPerson person{.eye_corners_mm = *size};
  std::vector<double> gaps, noises, closed;
  for (const FaceTrack& track : tracks) {
    const double scale = *size / medianEyeDistancePx(track);
    for (const auto& frame : track.frames) {
      if (frame) gaps.push_back(scale * innerGap(*frame));
    }
    MotionClip markers = markersOf(track, layout, *size, "");
    moveFrames(markers, headMotions(track, scale), true);
    addRestNoise(markers, noises);
  }
  if (!noises.empty()) person.noise_mm = median(std::move(noises));
  person.inner_closed_mm = quantile(std::move(gaps), 0.05);
  for (const FaceTrack& track : tracks) {
    const double scale = *size / medianEyeDistancePx(track);
    for (const auto& frame : track.frames) {
      if (frame && closedness(scale * innerGap(*frame), person) > 0.9)
        closed.push_back(scale * (frame->row(kUpperLip) - frame->row(kLowerLip)).norm());
    }
  }
  if (!closed.empty()) person.closed_lips_mm = median(std::move(closed));
  return person;
}

MotionClip refineMarkers(const FaceTrack& track, const MotionClip& markers, const MarkerLayout& layout,
                         const FilmedPerson& person) {
  const double scale = person.eye_corners_mm / medianEyeDistancePx(track);
  const std::vector<std::optional<RigidMotion>> motions = headMotions(track, scale);
  MotionClip refined = markers;
  moveFrames(refined, motions, true);
  refined = smoothMotion(refined, {.noise_mm = person.noise_mm}).clip;
  const Lips lips(refined, layout);
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (!track.frames[frame] || !lips.areThere() || person.closed_lips_mm <= 0) continue;
    const double share = closedness(scale * innerGap(*track.frames[frame]), person);
    if (share > 0) closeLips(refined, FrameIndex(frame), lips, share, person.closed_lips_mm);
  }
  moveFrames(refined, motions, false);
  return refined;
}

}  // namespace mouthpiece
