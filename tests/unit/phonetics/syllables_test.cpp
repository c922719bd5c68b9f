#include "phonetics/labels/syllables.h"

#include <gtest/gtest.h>

#include <sstream>

namespace mouthpiece {
namespace {

std::vector<Phone> phones(const std::string& names) {
  std::vector<Phone> list;
  std::istringstream stream(names);
  for (std::string name; stream >> name;) list.push_back(phoneFromName(name).value());
  return list;
}

std::string cut(const std::string& names) {
  const auto word = phones(names);
  std::string out;
  for (const auto& syllable : syllabify(word)) {
    if (!out.empty()) out += " . ";
    for (std::size_t i = 0; i < syllable.count; ++i) {
      if (i > 0) out += ' ';
      out += phoneName(word[syllable.first + i]);
    }
  }
  return out;
}

TEST(Syllables, FollowMaximalOnset) {
  EXPECT_EQ(cut("T AY M"), "T AY M");
  EXPECT_EQ(cut("AH G EH N"), "AH . G EH N");
  EXPECT_EQ(cut("S EH V AH N"), "S EH . V AH N");
  EXPECT_EQ(cut("K W AO R T ER"), "K W AO R . T ER");
  EXPECT_EQ(cut("IH G Z AE K T L IY"), "IH G . Z AE K T . L IY");
  EXPECT_EQ(cut("AE F T ER N UW N"), "AE F . T ER . N UW N");
  EXPECT_EQ(cut("EH K S T R AH"), "EH K . S T R AH");
  EXPECT_EQ(cut("S IH NG IH NG"), "S IH NG . IH NG");
  EXPECT_EQ(cut("M Y UW Z IH K"), "M Y UW . Z IH K");
  EXPECT_EQ(cut("Z IH R OW"), "Z IH . R OW");
}

TEST(Syllables, TakeWordsWithoutVowelsWhole) {
  EXPECT_EQ(cut("S"), "S");
  EXPECT_EQ(cut("SH SH"), "SH SH");
  EXPECT_EQ(cut(""), "");
}

TEST(Syllables, CoverEveryWordWithOneVowelEach) {
  // All words of up to five phones over an alphabet that tries the onset rules.
  const auto alphabet = phones("AA IY S T R NG Y");
  for (std::size_t code = 1; code < 7 * 7 * 7 * 7 * 7; ++code) {
    std::vector<Phone> word;
    for (std::size_t rest = code; rest > 0; rest /= 7) word.push_back(alphabet[rest % 7]);
    std::size_t covered = 0;
    const auto syllables = syllabify(word);
    for (const auto& syllable : syllables) {
      EXPECT_EQ(syllable.first, covered);
      covered += syllable.count;
      int vowels = 0;
      for (std::size_t i = 0; i < syllable.count; ++i) vowels += isVowel(word[syllable.first + i]) ? 1 : 0;
      EXPECT_TRUE(vowels == 1 || (syllables.size() == 1 && vowels == 0));
    }
    EXPECT_EQ(covered, word.size());
  }
}

TEST(Syllables, StressTheFirstFullVowel) {
  const auto again = phones("AH G EH N");
  EXPECT_EQ(likelyStressedSyllable(again, syllabify(again)), 1U);
  const auto seven = phones("S EH V AH N");
  EXPECT_EQ(likelyStressedSyllable(seven, syllabify(seven)), 0U);
  const auto the = phones("DH AH");
  EXPECT_EQ(likelyStressedSyllable(the, syllabify(the)), 0U);
}

}  // namespace
}  // namespace mouthpiece
