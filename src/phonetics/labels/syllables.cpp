#include "phonetics/labels/syllables.h"

#include <algorithm>
#include <array>

namespace mouthpiece {
namespace {

constexpr bool isOneOf(Phone phone, std::initializer_list<Phone> set) {
  return std::find(set.begin(), set.end(), phone) != set.end();
}

/// Two-phone onsets: stop or fricative with an approximant, s with a voiceless stop, nasal or approximant,
/// and a consonant with Y before UW ("cute", "music").
bool isLegalPair(Phone first, Phone second) {
  using enum Phone;
  switch (second) {
    case kL:
      return isOneOf(first, {kP, kB, kK, kG, kF, kS});
    case kR:
      return isOneOf(first, {kP, kB, kT, kD, kK, kG, kF, kTH, kSH});
    case kW:
      return isOneOf(first, {kT, kD, kK, kG, kS, kTH, kHH});
    case kY:
      return isOneOf(first, {kP, kB, kT, kD, kK, kG, kF, kV, kM, kN, kHH, kL, kS, kTH});
    case kP:
    case kT:
    case kK:
    case kM:
    case kN:
    case kF:
      return first == kS;
    default:
      return false;
  }
}

}  // namespace

bool isLegalOnset(std::span<const Phone> consonants) {
  using enum Phone;
  switch (consonants.size()) {
    case 0:
      return true;
    case 1:
      return consonants[0] != kNG && !isVowel(consonants[0]);
    case 2:
      return isLegalPair(consonants[0], consonants[1]);
    case 3:  // s + voiceless stop + approximant: "spring", "splash", "street", "square", "skew"
      return consonants[0] == kS && isOneOf(consonants[1], {kP, kT, kK}) && isOneOf(consonants[2], {kL, kR, kW, kY}) &&
             isLegalPair(consonants[1], consonants[2]);
    default:
      return false;
  }
}

std::vector<WordSyllable> syllabify(std::span<const Phone> word) {
  std::vector<std::size_t> starts;
  std::size_t after_vowel = 0;  // where the consonants before the vowel at hand begin
  for (std::size_t i = 0; i < word.size(); ++i) {
    if (!isVowel(word[i])) continue;
    std::size_t onset = after_vowel;
    if (!starts.empty()) {
      while (!isLegalOnset(word.subspan(onset, i - onset))) ++onset;
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

std::size_t likelyStressedSyllable(std::span<const Phone> word, std::span<const WordSyllable> syllables) {
  for (std::size_t s = 0; s < syllables.size(); ++s) {
    const auto phones = word.subspan(syllables[s].first, syllables[s].count);
    if (std::any_of(phones.begin(), phones.end(), [](Phone p) { return isVowel(p) && p != Phone::kAH; })) return s;
  }
  return 0;
}

}  // namespace mouthpiece
