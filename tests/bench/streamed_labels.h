#pragma once

#include <string>

#include "mouthpiece/live.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Tells `stream`, whose source is labels, all phones of `labels` with their stress and words.
inline void pushLabels(LiveStream& stream, const SpeechLabels& labels) {
  for (const LabelledPhone& phone : labels.phones) {
    std::string name = phone.phone == Phone::kSil ? "sil" : std::string(phoneName(phone.phone));
    if (phone.syllable && isVowel(phone.phone))
      name += std::to_string(static_cast<int>(labels.syllables[*phone.syllable].stress));
    stream.push(LivePhone{name, phone.span, phone.word});
  }
}

}  // namespace mouthpiece
