#pragma once

#include <vector>

#include "audio/pitch_marks.h"

namespace mouthpiece {

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
