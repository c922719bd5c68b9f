#include "tracking/marker_refining.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

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

/// The joints, then the chin, then what of the lower lip and under it the jaw carries.
constexpr Eigen::Index kJoints = 2, kJointWeight = 5;
constexpr std::array<Eigen::Index, 24> kJawLandmarks{234, 454, 152, 199, 200, 175, 148, 377, 176, 400, 208, 428,
                                                     201, 421, 171, 396, 149, 378, 18,  83,  313, 17,  84,  314};

double innerGap(const FaceLandmarks& face) {
  double sum = 0;
  for (const auto& [upper, lower] : kInnerLips) sum += (face.row(upper) - face.row(lower)).norm();
  return sum / asReal(kInnerLips.size());
}

/// The median of each coordinate; nullopt for a marker that is never seen.
std::optional<Eigen::RowVector3d> middlePlace(const MotionClip& clip, Eigen::Index marker) {
  Eigen::RowVector3d place;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const double value : clip.positions_mm.col(3 * marker + axis)) {
      if (std::isfinite(value)) values.push_back(value);
    }
    if (values.empty()) return std::nullopt;
    place(axis) = median(std::move(values));
  }
  return place;
}

MarkerPositions pointsOf(const FaceLandmarks& face, std::span<const Eigen::Index> landmarks, double scale) {
  MarkerPositions points(signedIndex(landmarks.size()), 3);
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const auto point = face.row(landmarks[i]);
    points.row(signedIndex(i)) = scale * Eigen::RowVector3d(point.x(), -point.y(), -point.z());
  }
  return points;
}

using BodyMotions = std::vector<std::optional<RigidMotion>>;  ///< one a frame; none where the body is not seen

/// Three places on the head, decimetres apart, that stand for its motion.
const Eigen::Matrix3d kPlaces = (Eigen::Matrix3d() << -60, 0, 0, 60, 0, 0, 0, 80, -60).finished();

/// A body is heavier than skin: its motion is smoothed by itself, as that of three places on it.
BodyMotions smoothBody(const BodyMotions& found, const Eigen::Matrix3d& places, double frame_rate_hz) {
  MotionClip moved{frame_rate_hz, {"a", "b", "c"}, {}};
  moved.positions_mm.setConstant(signedIndex(found.size()), 9, std::nan(""));
  for (std::size_t frame = 0; frame < found.size(); ++frame) {
    for (Eigen::Index i = 0; found[frame] && i < 3; ++i)
      moved.positions_mm.block<1, 3>(signedIndex(frame), 3 * i) =
          found[frame]->apply(places.row(i).transpose()).transpose();
  }
  const MotionClip smooth = smoothMotion(moved).clip;
  const MarkerPositions still = places;
  BodyMotions motions;
  for (std::size_t frame = 0; frame < found.size(); ++frame)
    motions.push_back(fitRigidMotion(still, smooth.pose(FrameIndex(frame)), {.robust_rounds = 0}));
  return motions;
}

/// Where the head is in each frame, relative to its first.
BodyMotions headMotions(const FaceTrack& track, double scale) {
  std::optional<MarkerPositions> first;
  BodyMotions motions(track.frames.size());
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (!track.frames[frame]) continue;
    const MarkerPositions points = pointsOf(*track.frames[frame], kHeadLandmarks, scale);
    if (!first) first = points;
    motions[frame] = fitRigidMotion(*first, points, {.robust_rounds = 2});
  }
  if (!first) return motions;
  return smoothBody(motions, kPlaces.rowwise() + first->colwise().mean(), track.frame_rate_hz);
}

/// Where the jaw is in each frame relative to its middle place in the clip, seen from the head: what chin and lower lip
/// tell of a body that turns about the joints before the ears.
BodyMotions jawMotions(const FaceTrack& track, const BodyMotions& head, double scale) {
  const auto count = signedIndex(kJawLandmarks.size());
  MotionClip points{track.frame_rate_hz, std::vector<std::string>(kJawLandmarks.size()), {}};
  points.positions_mm.setConstant(signedIndex(track.frames.size()), 3 * count, std::nan(""));
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (!track.frames[frame] || !head[frame]) continue;
    const MarkerPositions seen = pointsOf(*track.frames[frame], kJawLandmarks, scale);
    const RigidMotion head_from_camera = head[frame]->inverse();
    for (Eigen::Index i = 0; i < count; ++i)
      points.positions_mm.block<1, 3>(signedIndex(frame), 3 * i) =
          head_from_camera.apply(seen.row(i).transpose()).transpose();
  }
  BodyMotions motions(track.frames.size());
  MarkerPositions middle(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto place = middlePlace(points, i);
    if (!place) return motions;
    middle.row(i) = *place;
  }
  // The joints stay; they count as many times as rows stand for them.
  const auto withJoints = [&](const MarkerPositions& jaw) {
    MarkerPositions all(count + kJointWeight * kJoints, 3);
    all << jaw, middle.topRows(kJoints).replicate(kJointWeight, 1);
    all.topRows(kJoints) = middle.topRows(kJoints);
    return all;
  };
  for (std::size_t frame = 0; frame < track.frames.size(); ++frame) {
    if (points.positions_mm.row(signedIndex(frame)).allFinite())
      motions[frame] =
          fitRigidMotion(withJoints(middle), withJoints(points.pose(FrameIndex(frame))), {.robust_rounds = 0});
  }
  Eigen::Matrix3d places;
  places << middle.topRows(kJoints), middle.row(kJoints);
  return smoothBody(motions, places, track.frame_rate_hz);
}

/// The clip seen from the head, or back from there.
void moveFrames(MotionClip& clip, const BodyMotions& motions, bool to_head) {
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
  std::vector<LipSide> sides;  ///< of each marker

  Lips(const MotionClip& clip, const MarkerLayout& layout) {
    const auto find = [&](MarkerRole role) -> std::optional<MarkerIndex> {
      const auto marker = layout.findRole(role);
      return marker ? clip.findMarker(layout.markers[marker->value].name) : std::nullopt;
    };
    upper = find(MarkerRole::kUpperLip);
    lower = find(MarkerRole::kLowerLip);
    right = find(MarkerRole::kRightLipCorner);
    left = find(MarkerRole::kLeftLipCorner);
    sides.assign(clip.markerCount(), LipSide::kNone);
    for (const LayoutMarker& marker : layout.markers) {
      if (const auto index = clip.findMarker(marker.name)) sides[index->value] = marker.lip;
    }
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
    const LipSide side = lips.sides[i];
    if (side == LipSide::kNone || !clip.isSeen(frame, MarkerIndex(i))) continue;
    const double place = (clip.position(frame, MarkerIndex(i)) - (right + left) / 2).dot(across) / half_width;
    const double amount = change * std::max(0.0, 1 - place * place) * (side == LipSide::kUpper ? 1 : -1);
    clip.positions_mm.block<1, 3>(signedIndex(frame.value), signedIndex(3 * i)) += amount * up.transpose();
  }
}

/// On the outline of the face a landmark slides along the skin; the jaw carries its markers.
void moveJaw(MotionClip& clip, const MarkerLayout& layout, const BodyMotions& jaw) {
  for (const LayoutMarker& marker : layout.markers) {
    const auto found = clip.findMarker(marker.name);
    if (!found || (marker.region != "chin" && marker.region != "jaw")) continue;
    const auto column = signedIndex(found->value);
    const auto place = middlePlace(clip, column);
    for (std::size_t frame = 0; place && frame < clip.frameCount(); ++frame) {
      if (jaw[frame] && clip.isSeen(FrameIndex(frame), *found))
        clip.positions_mm.block<1, 3>(signedIndex(frame), 3 * column) =
            jaw[frame]->apply(place->transpose()).transpose();
    }
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
  const BodyMotions motions = headMotions(track, scale);
  MotionClip refined = markers;
  moveFrames(refined, motions, true);
  refined = smoothMotion(refined, {.noise_mm = person.noise_mm}).clip;
  moveJaw(refined, layout, jawMotions(track, motions, scale));
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
