#pragma once

#include <array>
#include <string_view>

#include "phonetics/text/lexicon.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Which phones follow each other somewhere in a corpus.
class PhonePairs {
 public:
  void add(const SpeechLabels& labels);
  [[nodiscard]] bool has(Phone first, Phone second) const {
    return pairs_[static_cast<std::size_t>(first)][static_cast<std::size_t>(second)];
  }

 private:
  std::array<std::array<bool, kPhoneCount>, kPhoneCount> pairs_{};
};

/// `lexicon` for saying `line`: of each word's pronunciations the one first with which the fewest phone pairs of the
/// line are missing in the corpus ("at" as AE T or AH T); where several do, the usual one. Within the words, between
/// neighbours, and around the silence at punctuation and at the ends; next to a word that the lexicon lacks nothing is
/// judged. A word that comes twice is said alike.
Lexicon lexiconForLine(const Lexicon& lexicon, std::string_view line, const PhonePairs& pairs);

}  // namespace mouthpiece
