#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/time.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/speech_finder.h"

namespace mouthpiece {

/// How much of a sound a network hears as phones, not as silence.
Seconds heardAsPhones(const HeardPhones& heard);

/// The `stretches` of a sound that findSpeech() found and, outside of them, what a network hears as phones in all of it
/// (hearPhones()): noise covers what is said softly. Speech that touches is one stretch, of kLongestStretch at most.
std::vector<SoundStretch> withHeardSpeech(std::vector<SoundStretch> stretches, const HeardPhones& heard);

/// A stretch of a sound.
struct Said {
  Seconds start = 0;
  /// With a little of what lies around it that nobody says; with two seconds on either side, whatever they are.
  std::span<const std::int16_t> samples, with_margins, around;
};

/// What is said in a sound, 16 kHz, whose `stretches` findSpeech() found: those of speech that lie no farther apart
/// than `pause` are one, 20 s at most.
std::vector<Said> whatIsSaid(std::span<const std::int16_t> samples, const std::vector<SoundStretch>& stretches,
                             Seconds pause);

}  // namespace mouthpiece
