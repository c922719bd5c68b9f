#pragma once

#include "audio/audio_clip.h"

namespace mouthpiece {

/// Mean square of the part of `clip` within `span` that lies between the two frequencies; 0 where the span holds
/// nothing or the sampling rate does not reach the band.
double bandEnergy(const AudioClip& clip, const TimeSpan& span, double low_hz, double high_hz);

}  // namespace mouthpiece
