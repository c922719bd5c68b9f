#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "phonetics/language/phone.h"

namespace mouthpiece {

/// A syllable of one word: phones [first, first + count) of it.
struct WordSyllable {
  std::size_t first = 0;
  std::size_t count = 0;
  bool operator==(const WordSyllable&) const = default;
};

/// Cuts the phones of one word (no silence among them) into syllables, one a vowel, by maximal onset: of the
/// consonants between two vowels, the longest tail that can begin an English word opens the second syllable.
/// A word without a vowel is one syllable.
std::vector<WordSyllable> syllabify(std::span<const Phone> word);

/// The syllable that most likely bears the primary stress, where a lexicon does not say: the first whose vowel is
/// not a schwa (AH), else the first.
std::size_t likelyStressedSyllable(std::span<const Phone> word, std::span<const WordSyllable> syllables);

/// Whether `consonants` can open an English syllable (the empty onset can).
bool isLegalOnset(std::span<const Phone> consonants);

}  // namespace mouthpiece
