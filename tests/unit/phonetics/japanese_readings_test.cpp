#include "phonetics/language/japanese_readings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "base/errors.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

TEST(JapaneseNumbers, AreReadAsTheyAreCounted) {
  for (const auto& [digits, reading] : std::vector<std::pair<std::string, std::string>>{
           {"0", "ゼロ"},
           {"7", "ナナ"},
           {"10", "ジュー"},
           {"16", "ジューロク"},
           {"20", "ニジュー"},
           {"99", "キュージューキュー"},
           {"100", "ヒャク"},
           {"301", "サンビャクイチ"},
           {"634", "ロッピャクサンジューヨン"},
           {"800", "ハッピャク"},
           {"1000", "セン"},
           {"2026", "ニセンニジューロク"},
           {"3333", "サンゼンサンビャクサンジューサン"},
           {"8000", "ハッセン"},
           {"10000", "イチマン"},
           {"120005", "ジューニマンゴ"},
           {"10000000", "イッセンマン"},
           {"100000000", "イチオク"},
           {"999999999999",
            "キューセンキューヒャクキュージューキューオクキューセンキューヒャクキュージューキューマン"
            "キューセンキューヒャクキュージューキュー"},
           {"007", ""},
           {"1000000000000", ""},
           {"", ""}})
    EXPECT_EQ(japaneseNumber(digits), reading) << digits;
}

std::vector<JapaneseReading> wordsOf(const std::vector<std::string>& words) {
  std::vector<JapaneseReading> read;
  for (const std::string& word : words) read.push_back({word, "ア"});
  return read;
}

TEST(JapaneseNumbers, DigitsInARowAreOneWord) {
  EXPECT_EQ(withCountedNumbers(wordsOf({"は", "６", "３", "４", "ｍ", "と", "２", "０"})),
            (std::vector<JapaneseReading>{
                {"は", "ア"}, {"634", "ロッピャクサンジューヨン"}, {"ｍ", "ア"}, {"と", "ア"}, {"20", "ニジュー"}}));
}

TEST(JapaneseNumbers, OtherDigitsStay) {
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{{},
                                                                                     {"９", "時"},
                                                                                     {"３", ".", "１", "４"},
                                                                                     {"１", "，", "０", "０", "０"},
                                                                                     {"１", "２", ":", "３", "０"},
                                                                                     {"０", "０", "７"},
                                                                                     {"数", "－", "は"}})
    EXPECT_EQ(withCountedNumbers(wordsOf(words)), wordsOf(words));
}

TEST(JapaneseReadings, UnknownWordsAreReadAsTheyStand) {
  EXPECT_EQ(katakanaOf("ぽよぽよ"), "ポヨポヨ");
  EXPECT_EQ(katakanaOf("アーん漢ｘ"), "アーン漢ｘ");
  EXPECT_EQ(latinWord("ｂｏｎＪｏｕｒ"), "bonjour");
  for (const char* other : {"", "bonjour", "ｂｏｎ１", "数", "。"}) EXPECT_EQ(latinWord(other), "");
}

TEST(JapaneseReadings, WordsOfLatinLettersAreSaidAsEnglishHasThem) {
  const auto said = [] { return japanese().say("今日はbonjourぽよぽよ", japanese()); };
  try {
    static_cast<void>(said());
  } catch (const InputError& error) {
    GTEST_SKIP() << error.what();
  }
  std::vector<std::string> words;
  for (const SaidWord& word : said()) {
    words.push_back(word.text);
    EXPECT_FALSE(word.said.phones.empty()) << word.text;
  }
  EXPECT_NE(std::find(words.begin(), words.end(), "bonjour"), words.end());
}

}  // namespace
}  // namespace mouthpiece
