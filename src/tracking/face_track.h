#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "audio/audio_clip.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "tracking/face_tracker.h"
#include "tracking/video_file.h"

namespace mouthpiece {

/// A face over time, at even steps from the first image on.
struct FaceTrack {
  double frame_rate_hz = 0;
  std::vector<std::optional<FaceLandmarks>> frames;  ///< pixels; none: no face was found
  AudioClip sound;                                   ///< from the first frame on
  std::size_t images = 0;                            ///< how many the video has
  std::size_t lost_images = 0;                       ///< that should have come between those, by the usual step
  bool had_even_steps = true;                        ///< false: its times were not even; frames lie between images

  /// Frames with a face, as a share of all.
  [[nodiscard]] double seenShare() const;
  /// Images that were lost, as a share of those that should have come.
  [[nodiscard]] double lostShare() const;
};

/// Landmarks at the images' own times, rising, as a track with even steps: where the times are even to a twentieth of a
/// step the images are its frames, otherwise frames lie between images at their usual rate. 23.976, 24, 25, 29.97, 30,
/// 50, 59.94 and 60 Hz are taken for what they are.
FaceTrack evenTrack(std::span<const Seconds> times, std::vector<std::optional<FaceLandmarks>> landmarks);

/// Follows the face through a video. Throws what readVideo() throws, and InputError for a video of one image.
FaceTrack trackFace(const std::filesystem::path& video, const VideoReading& options, FaceTracker& tracker);

/// Median distance of the outer eye corners in pixels; 0 where no frame shows a face.
double medianEyeDistancePx(const FaceTrack& track);

/// The distance of a person's outer eye corners in millimetres, from the size of the irises, which is the same in all
/// adults (11.7 mm, Hashemi et al. 2012): median over the frames that look into the camera. nullopt without such.
std::optional<double> eyeCornersFromIrises(std::span<const FaceTrack> tracks);

/// The layout's markers as they are in the landmarks, millimetres: X image right, Y up, Z to the camera, head motion
/// left in; the median distance of the outer eye corners is `eye_corners_mm`. A frame without a face is NaN. Throws
/// InputError for a layout without a marker that has a landmark, and when no frame has a face; `name` is for messages.
MotionClip markersOf(const FaceTrack& track, const MarkerLayout& layout, double eye_corners_mm, std::string_view name);

}  // namespace mouthpiece
