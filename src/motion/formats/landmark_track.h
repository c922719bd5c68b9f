#pragma once

#include <filesystem>
#include <string_view>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

struct LandmarkTrackOptions {
  double frame_rate_hz = 0;  ///< 0: the file's own "fps" or times
  /// A single camera does not tell size: the median distance of the outer eye corners is set to this.
  double eye_corners_mm = 90;
};

/// Reads a MediaPipe FaceMesh track (docs/formats/landmark_track.md): JSON with frames of 468 or 478 landmarks, in
/// image coordinates. Gives the layout's markers that have a landmark, in mm: X image right, Y up, Z to the camera,
/// head motion left in; a frame without a face is NaN. Throws InputError with the frame for what is no such track.
MotionClip readLandmarkTrack(const std::filesystem::path& path, const MarkerLayout& layout,
                             const LandmarkTrackOptions& options = {});
MotionClip parseLandmarkTrack(std::string_view json_text, std::string_view file, const MarkerLayout& layout,
                              const LandmarkTrackOptions& options = {});

}  // namespace mouthpiece
