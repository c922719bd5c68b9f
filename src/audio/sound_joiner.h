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

/// A recording made ready for joining.
struct MarkedSound {
  AudioClip clip;
  PitchTrack pitch;
  PitchMarks marks;
};

MarkedSound markSound(AudioClip clip);

/// A stretch of a recording, and where it goes. Lengths may differ: then grains are dropped or repeated.
struct SoundPiece {
  const MarkedSound* sound = nullptr;
  TimeSpan source;
  TimeSpan target;
};

struct SoundJoinOptions {
  Seconds fade = 0.02;         ///< pieces are mixed so long around a join, and so much is read beyond their ends
  Seconds level_reach = 0.08;  ///< levels meet at a join and are the recordings' own so far from it
  double most_level_db = 6;    ///< a larger step of level is left at that
  Seconds pitch_reach = 0.12;  ///< likewise pitch
  double most_pitch_ratio = 1.3;
};

/// Pieces, in order and touching in target time, as one sound at `sample_rate_hz` (that of every piece). Pitch-
/// synchronous overlap-add (Moulines and Charpentier 1990): grains of two periods are set down at the line's own pitch
/// marks, so that periods of two recordings fall together where they are mixed; pitch and level meet half-way at each
/// join. Away from joins, at a piece's own length, samples are the recording's own (shifted by less than a period).
AudioClip joinSounds(const std::vector<SoundPiece>& pieces, int sample_rate_hz, const SoundJoinOptions& options = {});

}  // namespace mouthpiece
