#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// Reads or writes motion in the format that the name's ending tells: .c3d, .csv, .trc, in any case. Throws InputError
/// for another ending, and what the format's own reader or writer throws.
MotionClip readMotion(const std::filesystem::path& path);
void writeMotion(const std::filesystem::path& path, const MotionClip& clip);

/// True for an ending that readMotion knows.
bool isMotionFileName(const std::filesystem::path& path);

/// What a capture system calls the markers of a layout: label in its files -> name in the layout, for those markers of
/// the layout's JSON that have a "label". `layout` was read from the same text. Throws InputError for a label that two
/// markers have, or that is another marker's name.
std::map<std::string, std::string> markerLabels(std::string_view json_text, std::string_view file,
                                                const MarkerLayout& layout);

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
