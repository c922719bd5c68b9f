#pragma once

#include <optional>
#include <string_view>

#include "phonetics/text/lexicon.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Labels that know phones only, given the words of `text`: word by word, some pronunciation of the lexicon must spell
/// the next phones, pauses between words left aside. nullopt when a word is unknown or the phones do not fit.
std::optional<SpeechLabels> withWords(const SpeechLabels& labels, std::string_view text, const Lexicon& lexicon);

}  // namespace mouthpiece
