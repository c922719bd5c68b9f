#pragma once

#include <optional>
#include <span>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "tracking/face_track.h"

namespace mouthpiece {

/// What is the same in all videos of one person by one camera.
struct FilmedPerson {
  double eye_corners_mm = 90;  ///< distance of the outer eye corners, by which a track gets its size
  double noise_mm = 0.1;       ///< of a marker that rests, one coordinate, the head's motion taken off
  double inner_closed_mm = 0;  ///< what the distance of the inner lips reads while they touch
  double closed_lips_mm = 0;   ///< distance of the outer lips' middles while the lips touch; 0: never seen
};

/// Measures a person in some of their videos; `eye_corners_mm` overrides what the irises tell. nullopt when no frame
/// tells the size. Each track shows a face.
std::optional<FilmedPerson> measurePerson(std::span<const FaceTrack> tracks, const MarkerLayout& layout,
                                          std::optional<double> eye_corners_mm);

/// The markers of markersOf() with less of the tracker's noise and lips that close
/// (docs/theory/tracking/refined_markers.md): the head's motion is found from many landmarks and smoothed by itself,
/// the markers are smoothed relative to it with the camera's noise (smoothMotion()), and where the inner lips touch,
/// the outer lips get the distance that they have in this person when closed. Samples that were not seen stay NaN.
MotionClip refineMarkers(const FaceTrack& track, const MotionClip& markers, const MarkerLayout& layout,
                         const FilmedPerson& person);

}  // namespace mouthpiece
