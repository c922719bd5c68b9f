#pragma once

#include <cstddef>
#include <vector>

#include "audio/pitch_track.h"

namespace mouthpiece {

/// Where a clip may be cut into grains: one mark a glottal period at the same place of every period where there is a
/// pitch, evenly spaced ones elsewhere. Marks rise; the first is at 0 and the last at the clip's end.
struct PitchMarks {
  struct Mark {
    std::size_t sample = 0;
    bool voiced = false;
  };
  std::vector<Mark> marks;

  /// The mark nearest to `sample`. There is always one.
  [[nodiscard]] std::size_t nearest(double sample) const;
};

/// Marks follow the wave from the loudest period of each voiced stretch, forth and back, by its likeness to the period
/// before (normalised correlation within a fifth of a period of where the next one is due).
PitchMarks findPitchMarks(const AudioClip& clip, const PitchTrack& pitch);

}  // namespace mouthpiece
