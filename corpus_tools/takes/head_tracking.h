#pragma once

#include <vector>

#include "base/time.h"
#include "corpus_tools/takes/take_files.h"
#include "motion/cleaning/rigid.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// docs/theory/corpus_tools/head_motion.md has the measurements behind these numbers.
struct HeadTrackingOptions {
  std::size_t least_jig_markers = 4;   ///< seen in a frame for the jig to decide there
  std::size_t least_skin_markers = 4;  ///< likewise for the stable markers of the face
  RigidFitOptions fit{1};              ///< more rounds shift weights from frame to frame, which shakes the head
  /// Standard deviation of the Gaussian that smooths the pose track, for takes with and without a jig: a pose's noise
  /// has a long lever to the lips.
  Seconds jig_pose_smoothing = 0.02;
  Seconds skin_pose_smoothing = 0.06;
  bool equalize_scale = true;  ///< bring takes without a jig to one size
};

/// The still head that all takes are brought to, in millimetres.
struct HeadReference {
  MarkerPositions jig_mm;     ///< the layout's jig markers; no rows when no take shows a jig
  MarkerPositions stable_mm;  ///< the layout's stable markers, in its order; no rows when they are seen too seldom
};

/// Where the head was in each frame of a take.
struct HeadTrack {
  std::vector<RigidMotion> head_from_world;  ///< one a frame; applied to scale * world
  double scale = 1;                          ///< 1 with a jig
  std::size_t jig_frames = 0;                ///< posed by the jig
  std::size_t skin_frames = 0;               ///< posed by the stable markers
  std::size_t bridged_frames = 0;            ///< too few of both seen: interpolated
  double residual_rms_mm = 0;                ///< of the markers that gave the poses
};

/// The mean shapes of jig and stable markers over all takes, in the frame of one of the takes. Throws InputError when
/// neither is seen enough.
HeadReference estimateHeadReference(const std::vector<RawTake>& takes, const MarkerLayout& layout,
                                    const HeadTrackingOptions& options = {});

/// Throws InputError, with the take's name, when no frame shows enough of jig or stable markers.
HeadTrack trackHead(const RawTake& take, const HeadReference& reference, const MarkerLayout& layout,
                    const HeadTrackingOptions& options = {});

/// `face` with the head still, in the reference's coordinates.
MotionClip withoutHeadMotion(const MotionClip& face, const HeadTrack& track);

/// The face's own axes: X along the outer canthi to the subject's left, Y from chin to forehead along the midline and
/// at right angles to X, Z out of the face, origin at the middle of the outer canthi. `neutral_mm`: the layout's
/// markers. Throws InputError when the layout or the pose lacks outer canthi, or the face is mirrored (L and R
/// exchanged).
RigidMotion faceFromHead(const MarkerPositions& neutral_mm, const MarkerLayout& layout);

/// Indices of the layout's stable markers.
std::vector<std::size_t> stableMarkers(const MarkerLayout& layout);

}  // namespace mouthpiece
