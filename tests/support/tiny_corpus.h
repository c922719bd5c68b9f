#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "units/file/corpus.h"

namespace mouthpiece::samples {

/// Labels of "DH-AH T-AY-M | N-AW": words apart by blanks, their phones by hyphens, "|" a pause; silence of 0.2 s at
/// the ends. Durations vary with `seed`, between 60 and 140 ms; 0: all 100 ms.
SpeechLabels tinyLabels(std::string_view words, std::uint64_t seed);

/// A take of four markers (upper lip, lower lip, chin, brow) whose lips open smoothly with the phones and shut for B P
/// M.
CorpusTake tinyTake(const std::string& name, std::string_view words, std::uint64_t seed, double frame_rate_hz = 120);

/// One take a line, named "take0", "take1", ..., with sound.
Corpus tinyCorpus(const std::vector<std::string>& lines, double frame_rate_hz = 120);

/// "the time is now", "it is ten", "a man at noon", ...: enough for a few joins.
Corpus tinyCorpus();

/// Distance of the lips, mm, in each frame.
std::vector<double> lipOpening(const MotionClip& motion);

}  // namespace mouthpiece::samples
