#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "audio/audio_clip.h"
#include "tracking/face_tracker.h"

namespace mouthpiece {

struct VideoReading {
  int sound_rate_hz = 16000;
  std::size_t longest_side = 1280;  ///< larger images are made smaller
};

struct VideoSound {
  std::vector<Seconds> times;  ///< of each image, from the file's first stamp, rising
  AudioClip sound;             ///< mono, from the first image's time on; no samples where the video has none
};

/// Reads a video through the program ffmpeg, upright and with square pixels; `see` gets one image after another. Only
/// the file itself is opened, whatever it refers to. Of images of one time the first is shown. Throws InputError when
/// there is no ffmpeg, no picture, or the file cannot be read or (MP4, Matroska) is not whole, and what `see` throws.
VideoSound readVideo(const std::filesystem::path& path, const VideoReading& options,
                     const std::function<void(const VideoImage&)>& see);

}  // namespace mouthpiece
