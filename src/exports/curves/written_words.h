#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// A word of a text, or some that are said as one, and when.
struct WrittenWord {
  TimeSpan span;
  std::string text;
};

/// The words of `labels` as `text` (UTF-8) writes them, with its punctuation, capitals and numbers: "$5," for "five
/// dollars". Where the text does not tell which of it a word is, the word stands as it is spoken; so do all for an
/// empty text. Words without a name are left out.
std::vector<WrittenWord> writtenWords(const SpeechLabels& labels, std::string_view text);

}  // namespace mouthpiece
