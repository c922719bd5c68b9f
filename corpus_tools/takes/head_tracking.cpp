#include "corpus_tools/takes/head_tracking.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/errors.h"
#include "base/statistics.h"
#include "corpus_tools/takes/pose_fit.h"

namespace mouthpiece {
namespace {

/// The mean shapes need no more frames than this of each take.
constexpr std::size_t kShapeFramesPerTake = 25;

using OptionalPoses = std::vector<std::optional<RigidMotion>>;

std::vector<std::size_t> allMarkers(const MotionClip& clip) {
  std::vector<std::size_t> all(clip.markerCount());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

void appendShapes(std::vector<MarkerPositions>& shapes, const MotionClip& clip,
                  const std::vector<std::size_t>& markers) {
  const std::size_t step = std::max<std::size_t>(1, clip.frameCount() / kShapeFramesPerTake);
  for (std::size_t frame = 0; frame < clip.frameCount(); frame += step) {
    shapes.push_back(pickMarkers(clip.pose(FrameIndex(frame)), markers));
  }
}

MarkerPositions jigShape(const std::vector<RawTake>& takes, const HeadTrackingOptions& options) {
  std::vector<MarkerPositions> shapes;
  for (const RawTake& take : takes) appendShapes(shapes, take.jig, allMarkers(take.jig));
  return meanShape(shapes, options.least_jig_markers, PoseScale::kFixed);
}

/// The stable markers as they lie in the jig's frame, so that both references share one head.
MarkerPositions stableShapeInJigFrame(const std::vector<RawTake>& takes, const MarkerPositions& jig_mm,
                                      const MarkerLayout& layout, const HeadTrackingOptions& options) {
  std::vector<MarkerPositions> shapes;
  for (const RawTake& take : takes) {
    const HeadReference jig_only{jig_mm, MarkerPositions(0, 3)};
    try {
      appendShapes(shapes, withoutHeadMotion(take.face, trackHead(take, jig_only, layout, options)),
                   stableMarkers(layout));
    } catch (const InputError&) {
      continue;  // a take without the jig; reported when it is cleaned
    }
  }
  if (shapes.empty()) return MarkerPositions(0, 3);
  MarkerPositions middle(shapes.front().rows(), 3);
  for (Eigen::Index marker = 0; marker < middle.rows(); ++marker) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<double> seen;
      for (const MarkerPositions& shape : shapes) {
        if (std::isfinite(shape(marker, axis))) seen.push_back(shape(marker, axis));
      }
      middle(marker, axis) = median(std::move(seen));
    }
  }
  return middle;
}

/// One size for a whole take: the median over its frames of the best-fitting one.
double equalizingScale(const MotionClip& face, const std::vector<std::size_t>& stable, const HeadReference& reference,
                       const HeadTrackingOptions& options) {
  std::vector<MarkerPositions> shapes;
  appendShapes(shapes, face, stable);
  std::vector<double> scales;
  for (const MarkerPositions& shape : shapes) {
    if (sharedMarkers(shape, reference.stable_mm) < options.least_skin_markers) continue;
    if (const auto fit = fitPose(shape, reference.stable_mm, PoseScale::kFree, options.fit))
      scales.push_back(fit->scale);
  }
  return median(std::move(scales), 1);
}

RigidMotion interpolated(const RigidMotion& from, const RigidMotion& to, double share) {
  const Eigen::Quaterniond turn = Eigen::Quaterniond(from.rotation).slerp(share, Eigen::Quaterniond(to.rotation));
  return {turn.toRotationMatrix(), (1 - share) * from.translation_mm + share * to.translation_mm};
}

/// Frames without a pose take one between their neighbours', or the nearest one at the ends.
std::vector<RigidMotion> bridged(const OptionalPoses& poses) {
  std::vector<std::size_t> known;
  for (std::size_t frame = 0; frame < poses.size(); ++frame) {
    if (poses[frame]) known.push_back(frame);
  }
  std::vector<RigidMotion> full;
  for (std::size_t frame = 0; frame < poses.size(); ++frame) {
    const auto after = std::lower_bound(known.begin(), known.end(), frame);
    if (after == known.end()) {
      full.push_back(*poses[known.back()]);
    } else if (*after == frame || after == known.begin()) {
      full.push_back(*poses[*after]);
    } else {
      const std::size_t before = *(after - 1);
      const double share = asReal(frame - before) / asReal(*after - before);
      full.push_back(interpolated(*poses[before], *poses[*after], share));
    }
  }
  return full;
}

/// Weights of the frames [first, first + size) in the smoothed pose of `frame`: a straight line fitted with Gaussian
/// weights. In the middle of a take that is the Gaussian mean; at its ends a mean would pull the head back.
Eigen::VectorXd smoothingWeights(std::ptrdiff_t frame, std::ptrdiff_t first, std::ptrdiff_t size, double sigma_frames) {
  const Eigen::ArrayXd away = Eigen::ArrayXd::LinSpaced(size, asReal(first - frame), asReal(first + size - 1 - frame));
  const Eigen::ArrayXd gauss = (-0.5 * (away / sigma_frames).square()).exp();
  const double s0 = gauss.sum(), s1 = (gauss * away).sum(), s2 = (gauss * away.square()).sum();
  return (gauss * (s2 - s1 * away) / (s0 * s2 - s1 * s1)).matrix();
}

/// Smooths rotations (as quaternions of one sign) and the place of `centre`, a point of the head: smoothing the
/// translations themselves would shift the face by the lever arm to the world's origin.
std::vector<RigidMotion> smoothed(const std::vector<RigidMotion>& poses, const Eigen::Vector3d& centre,
                                  double sigma_frames) {
  const auto count = signedIndex(poses.size());
  const auto reach = static_cast<std::ptrdiff_t>(std::ceil(4 * sigma_frames));
  if (reach < 1 || count < 3) return poses;
  Eigen::MatrixX4d turns(count, 4);
  Eigen::MatrixX3d centres(count, 3);
  for (std::ptrdiff_t frame = 0; frame < count; ++frame) {
    const RigidMotion& pose = poses[unsignedIndex(frame)];
    turns.row(frame) = Eigen::Quaterniond(pose.rotation).coeffs().transpose();
    if (frame > 0 && turns.row(frame).dot(turns.row(frame - 1)) < 0) turns.row(frame) *= -1;
    centres.row(frame) = pose.inverse().apply(centre).transpose();
  }
  std::vector<RigidMotion> result;
  for (std::ptrdiff_t frame = 0; frame < count; ++frame) {
    const std::ptrdiff_t first = std::max<std::ptrdiff_t>(0, frame - reach);
    const std::ptrdiff_t size = std::min(count - 1, frame + reach) - first + 1;
    const Eigen::VectorXd weights = smoothingWeights(frame, first, size, sigma_frames);
    const Eigen::Vector4d turn = turns.middleRows(first, size).transpose() * weights;
    const Eigen::Vector3d place = centres.middleRows(first, size).transpose() * weights;
    const Eigen::Matrix3d rotation = Eigen::Quaterniond(Eigen::Vector4d(turn.normalized())).toRotationMatrix();
    result.push_back({rotation, centre - rotation * place});
  }
  return result;
}

Eigen::Vector3d centreOf(const MarkerPositions& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (!points.row(i).allFinite()) continue;
    sum += points.row(i).transpose();
    count += 1;
  }
  return sum / count;
}

/// Fills poses, counts and squared residuals frame by frame.
OptionalPoses posesOf(const RawTake& take, const HeadReference& reference, const std::vector<std::size_t>& stable,
                      const HeadTrackingOptions& options, HeadTrack& track) {
  OptionalPoses poses(take.face.frameCount());
  double squared_sum = 0;
  std::size_t markers = 0;
  for (std::size_t frame = 0; frame < poses.size(); ++frame) {
    const MarkerPositions jig = take.jig.pose(FrameIndex(frame));
    const bool by_jig = sharedMarkers(jig, reference.jig_mm) >= options.least_jig_markers;
    const MarkerPositions source =
        by_jig ? jig : MarkerPositions(track.scale * pickMarkers(take.face.pose(FrameIndex(frame)), stable));
    const MarkerPositions& target = by_jig ? reference.jig_mm : reference.stable_mm;
    if (!by_jig && sharedMarkers(source, target) < options.least_skin_markers) continue;
    const std::optional<PoseFit> fit = fitPose(source, target, PoseScale::kFixed, options.fit);
    if (!fit) continue;  // all on one line
    poses[frame] = fit->target_from_source;
    ++(by_jig ? track.jig_frames : track.skin_frames);
    squared_sum += fit->squared_residuals_mm2;
    markers += fit->shared_markers;
  }
  if (markers > 0) track.residual_rms_mm = std::sqrt(squared_sum / asReal(markers));
  return poses;
}

bool showsJig(const RawTake& take, const HeadReference& reference, const HeadTrackingOptions& options) {
  for (std::size_t frame = 0; frame < take.jig.frameCount(); ++frame) {
    if (sharedMarkers(take.jig.pose(FrameIndex(frame)), reference.jig_mm) >= options.least_jig_markers) return true;
  }
  return false;
}

Eigen::Vector3d place(const MarkerPositions& pose, std::size_t marker) {
  return pose.row(signedIndex(marker)).transpose();
}

struct CanthusPair {
  Eigen::Vector3d right, left;
};

/// Of all mirrored pairs of the region "canthus" the one farthest apart.
CanthusPair outerCanthi(const MarkerPositions& neutral, const MarkerLayout& layout) {
  std::optional<CanthusPair> outer;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region != "canthus" || layout.markers[marker].side != Side::kRight) continue;
    const CanthusPair pair{place(neutral, marker), place(neutral, layout.markers[marker].mirror.value)};
    if (!pair.right.allFinite() || !pair.left.allFinite()) continue;
    if (!outer || (pair.left - pair.right).norm() > (outer->left - outer->right).norm()) outer = pair;
  }
  if (!outer || (outer->left - outer->right).norm() < 1e-3) {
    throw InputError(
        fmt::format("layout {} has no seen pair of markers in the region \"canthus\"; the face's axes need "
                    "the outer corners of the eyes",
                    layout.name));
  }
  return *outer;
}

/// Mean of the seen markers of a region, midline or sides only. nullopt when there is none.
std::optional<Eigen::Vector3d> regionMean(const MarkerPositions& neutral, const MarkerLayout& layout,
                                          std::string_view region, bool midline) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    const LayoutMarker& known = layout.markers[marker];
    if (known.region != region || (known.side == Side::kMiddle) != midline) continue;
    if (!place(neutral, marker).allFinite()) continue;
    sum += place(neutral, marker);
    ++count;
  }
  if (count == 0) return std::nullopt;
  return Eigen::Vector3d(sum / count);
}

}  // namespace

std::vector<std::size_t> stableMarkers(const MarkerLayout& layout) {
  std::vector<std::size_t> stable;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].stable) stable.push_back(marker);
  }
  return stable;
}

HeadReference estimateHeadReference(const std::vector<RawTake>& takes, const MarkerLayout& layout,
                                    const HeadTrackingOptions& options) {
  HeadReference reference;
  reference.jig_mm = jigShape(takes, options);
  if (reference.jig_mm.rows() > 0) {
    reference.stable_mm = stableShapeInJigFrame(takes, reference.jig_mm, layout, options);
    return reference;
  }
  std::vector<MarkerPositions> shapes;
  for (const RawTake& take : takes) appendShapes(shapes, take.face, stableMarkers(layout));
  const PoseScale scale = options.equalize_scale ? PoseScale::kFree : PoseScale::kFixed;
  reference.stable_mm = meanShape(shapes, options.least_skin_markers, scale);
  if (reference.stable_mm.rows() == 0) {
    throw InputError(
        fmt::format("no frame of any take shows {} jig markers or {} stable markers of layout {}; "
                    "expected enough to find the head",
                    options.least_jig_markers, options.least_skin_markers, layout.name));
  }
  return reference;
}

HeadTrack trackHead(const RawTake& take, const HeadReference& reference, const MarkerLayout& layout,
                    const HeadTrackingOptions& options) {
  const std::vector<std::size_t> stable = stableMarkers(layout);
  HeadTrack track;
  const bool has_jig = showsJig(take, reference, options);
  if (!has_jig && options.equalize_scale) track.scale = equalizingScale(take.face, stable, reference, options);
  const OptionalPoses poses = posesOf(take, reference, stable, options, track);
  if (track.jig_frames + track.skin_frames == 0) {
    throw InputError(take.name, "",
                     fmt::format("no frame shows {} jig markers or {} stable markers; expected enough to "
                                 "find the head",
                                 options.least_jig_markers, options.least_skin_markers));
  }
  track.bridged_frames = poses.size() - track.jig_frames - track.skin_frames;
  track.head_from_world = bridged(poses);
  const Seconds sigma = has_jig ? options.jig_pose_smoothing : options.skin_pose_smoothing;
  const Eigen::Vector3d centre = centreOf(has_jig ? reference.jig_mm : reference.stable_mm);
  track.head_from_world = smoothed(track.head_from_world, centre, sigma * take.face.frame_rate_hz);
  return track;
}

MotionClip withoutHeadMotion(const MotionClip& face, const HeadTrack& track) {
  MOUTHPIECE_EXPECT(track.head_from_world.size() == face.frameCount());
  MotionClip still = face;
  for (std::size_t frame = 0; frame < face.frameCount(); ++frame) {
    for (std::size_t marker = 0; marker < face.markerCount(); ++marker) {
      const Eigen::Vector3d world = track.scale * face.position(FrameIndex(frame), MarkerIndex(marker));
      still.positions_mm.block<1, 3>(signedIndex(frame), signedIndex(3 * marker)) =
          track.head_from_world[frame].apply(world).transpose();
    }
  }
  return still;
}

RigidMotion faceFromHead(const MarkerPositions& neutral_mm, const MarkerLayout& layout) {
  const CanthusPair canthi = outerCanthi(neutral_mm, layout);
  const Eigen::Vector3d origin = 0.5 * (canthi.left + canthi.right);
  const Eigen::Vector3d x = (canthi.left - canthi.right).normalized();
  const auto forehead = regionMean(neutral_mm, layout, "forehead", true);
  const auto chin = regionMean(neutral_mm, layout, "chin", true);
  if (!forehead || !chin) {
    throw InputError(
        fmt::format("layout {} has no seen midline markers in the regions \"forehead\" and \"chin\"; the "
                    "face's axes need both",
                    layout.name));
  }
  const Eigen::Vector3d up = *forehead - *chin;
  const Eigen::Vector3d y = (up - up.dot(x) * x).normalized();
  const Eigen::Vector3d z = x.cross(y);
  const auto nose = regionMean(neutral_mm, layout, "nose", true);
  if (nose && (*nose - origin).dot(z) <= 0) {
    throw InputError(
        fmt::format("the nose lies behind the eyes: the capture is a mirror image, or the left and right "
                    "markers of layout {} are exchanged",
                    layout.name));
  }
  RigidMotion face_from_head;
  face_from_head.rotation << x.transpose(), y.transpose(), z.transpose();
  face_from_head.translation_mm = -face_from_head.rotation * origin;
  return face_from_head;
}

}  // namespace mouthpiece
