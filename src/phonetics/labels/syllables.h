#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "phonetics/language/language.h"

namespace mouthpiece {

/// A syllable of one word: phones [first, first + count) of it.
struct WordSyllable {
  std::size_t first = 0;
  std::size_t count = 0;
  bool operator==(const WordSyllable&) const = default;
};

/// Cuts the phones of one word (no silence among them) into syllables, one a vowel, by maximal onset: of the
/// consonants between two vowels, the longest tail that can begin a word of the language opens the second syllable.
/// A word without a vowel is one syllable.
std::vector<WordSyllable> syllabify(std::span<const Phone> word, const Language& language = english());

/// The syllable that most likely bears the primary stress, where a lexicon does not say: the first whose vowel is
/// not the language's reduced one (AH), else the first.
std::size_t likelyStressedSyllable(std::span<const Phone> word, std::span<const WordSyllable> syllables,
                                   const Language& language = english());

/// Whether `consonants` can open a syllable (the empty onset can, vowels cannot).
bool isLegalOnset(std::span<const Phone> consonants, const Language& language = english());

}  // namespace mouthpiece
