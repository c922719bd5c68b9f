#pragma once

#include <filesystem>
#include <functional>

#include "audio/audio_clip.h"
#include "exports/film/picture.h"

namespace mouthpiece {

/// Pictures at a steady rate and the sound to them, both beginning at 0 s.
struct Film {
  double frame_rate_hz = 30;
  std::size_t frame_count = 0;
  std::size_t width = 1280, height = 720;
  /// Draws one; called from several threads.
  std::function<void(std::size_t frame, Picture& picture)> paint;
  const AudioClip& sound;
};

/// Writes it through the program ffmpeg as the path's ending says: .mp4 (H.264, AAC), .webm (VP9, Opus), .gif (no
/// sound, at most 25 pictures a second, half as large), or .zip (a PNG a picture and the sound). `tell`, where there is
/// one, hears after each batch how many frames are done. Throws InputError without ffmpeg, or where it fails.
void writeFilm(const std::filesystem::path& path, const Film& film,
               const std::function<void(std::size_t frames_done)>& tell = nullptr);

}  // namespace mouthpiece
