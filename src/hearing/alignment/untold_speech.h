#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// What to tell of labels that leave speech of their sound (16 kHz) out, as of a text that is a part of what is said:
/// when, and for how long; "" for nothing (docs/theory/hearing/doubt.md#speech-without-words).
std::string untoldSpeech(std::span<const std::int16_t> samples, const SpeechLabels& labels);

}  // namespace mouthpiece
