#include "phonetics/labels/syllables.h"

#include <algorithm>

namespace mouthpiece {

bool isLegalOnset(std::span<const Phone> consonants, const Language& language) {
  return consonants.empty() ||
         (std::none_of(consonants.begin(), consonants.end(), isVowel) && language.is_legal_onset(consonants));
}

std::vector<WordSyllable> syllabify(std::span<const Phone> word, const Language& language) {
  std::vector<std::size_t> starts;
  std::size_t after_vowel = 0;  // where the consonants before the vowel at hand begin
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (!isVowel(word[i])) continue;
    std::size_t onset = after_vowel;
    if (!starts.empty()) {
      while (!isLegalOnset(word.subspan(onset, i - onset), language)) ++onset;
    }
    starts.push_back(onset);
    after_vowel = i + 1;
  }
  if (starts.empty() && !word.empty()) starts.push_back(0);
  std::vector<WordSyllable> syllables;
  for (std::size_t s = 0; s < starts.size(); ++s) {
    const std::size_t end = s + 1 < starts.size() ? starts[s + 1] : word.size();
    syllables.push_back({starts[s], end - starts[s]});
  }
  return syllables;
}

std::size_t likelyStressedSyllable(std::span<const Phone> word, std::span<const WordSyllable> syllables,
                                   const Language& language) {
  for (std::size_t s = 0; s < syllables.size(); ++s) {
    const auto phones = word.subspan(syllables[s].first, syllables[s].count);
    const auto is_full = [&](Phone phone) { return isVowel(phone) && phone != language.reduced_vowel; };
    if (std::any_of(phones.begin(), phones.end(), is_full)) return s;
  }
  return 0;
}

}  // namespace mouthpiece
