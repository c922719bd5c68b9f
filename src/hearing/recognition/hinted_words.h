#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "hearing/recognition/known_lines.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// A word or phrase of a hint that may be what was heard as other words.
struct HintedPlace {
  std::size_t first = 0, end = 0;  ///< of these words of the labels, the first and behind the last
  std::vector<std::string> words;  ///< in their place
  double apart = 0;                ///< the price of the edits from one's phones to the other's, a phone of the longer
};

/// Where words and phrases of `hint` sound much like other words of `heard`, the nearest first. Words that the hint
/// has, too, stay, unless a longer phrase of it takes them in.
std::vector<HintedPlace> hintedPlaces(const KnownLines& hint, const SpeechLabels& heard);

}  // namespace mouthpiece
