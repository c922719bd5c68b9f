#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "corpus_tools/takes/sound_sync.h"
#include "corpus_tools/takes/take_files.h"
#include "motion/marker_layout.h"
#include "tracking/marker_refining.h"

namespace mouthpiece {

/// What is known of a filmed person, as JSON. readPerson() throws InputError for another file.
FilmedPerson readPerson(const std::filesystem::path& file);
void writePerson(const std::filesystem::path& file, const FilmedPerson& person);

struct VideoTakesOptions {
  MarkerLayout layout;  ///< those of its markers that have a FaceMesh landmark are written
  /// Distance of the person's outer eye corners; none: from the size of the irises. What is found out about the person
  /// in the first clips stays in person.json for later ones.
  std::optional<double> eye_corners_mm;
  bool plain_markers = false;  ///< as the tracker gives them, without refineMarkers()
  bool again = false;          ///< also what is done already
  double least_seen = 0.8;     ///< share of the frames with a face, below which a clip is left out
  int sound_rate_hz = 16000;
  /// What one recorder heard while all clips were filmed: laid beside each by the clip's own sound, where it has none
  /// by the lips, and taken in its stead; none where it has no samples.
  AudioClip recorder;
  std::size_t jobs = 0;  ///< clips at a time; 0: as many as the machine has threads
};

struct VideoTake {
  std::string name;
  double frame_rate_hz = 0;
  double seen_share = 0;
  std::size_t frames = 0;
  bool had_even_steps = true;
  std::optional<SoundPlace> recorder;  ///< where the recorder's sound begins beside it
};

struct VideoTakes {
  std::vector<VideoTake> takes;  ///< made now, by name
  std::size_t kept = 0;          ///< made before and newer than their clips
  std::vector<LeftOutTake> left_out;
  FilmedPerson person;
};

/// Makes takes of videos of one person: NAME.c3d and NAME.wav in `folder` for each clip NAME.*, with the NAME.txt and
/// the NAME.TextGrid that lie beside the clip. A clip that cannot be used is left out, with the reason. A take is
/// written whole or not at all. `models` holds the tracker's networks. Throws InputError when two clips have one name,
/// when no clip is given, and when the networks or ffmpeg are missing.
VideoTakes trackVideos(const std::vector<std::filesystem::path>& clips, const std::filesystem::path& folder,
                       const std::filesystem::path& models, const VideoTakesOptions& options,
                       const std::function<void(std::size_t done, std::size_t total)>& progress);

}  // namespace mouthpiece
