// What programs write now and then, beside what their documentation shows.
#include <gtest/gtest.h>

#include <string>

#include "base/errors.h"
#include "hearing/times/times_file.h"
#include "phonetics/language/language.h"

namespace mouthpiece {
namespace {

std::string phonesIn(const TimesFile& times) {
  std::string text;
  for (const PhoneSegment& phone : times.phones)
    text += (text.empty() ? "" : " ") + (phone.ipa.empty() ? std::string(phoneName(phone.phone)) : phone.ipa);
  return text;
}

std::string wordsIn(const TimesFile& times) {
  std::string text;
  for (const TimesFile::Word& word : times.words) text += (text.empty() ? "" : "|") + word.text;
  return text;
}

TEST(TimesHabits, PiecesOfElevenLabsThatEndInABlankKeepItsTime) {
  const std::string piece =
      R"({"alignment": {"chars": ["h", "i", " "], "charStartTimesMs": [0, 100, 300], "charDurationsMs": [100, 200, 500]}})";
  const TimesFile times = parseTimes(piece + "\n" + piece + "\n" + piece, "pieces.jsonl");
  ASSERT_EQ(times.words.size(), 3U);
  EXPECT_NEAR(times.words[1].span.start, 0.8, 1e-9);
  EXPECT_NEAR(times.words[2].span.start, 1.6, 1e-9);
}

TEST(TimesHabits, PiperSaysTheSoundsOfOtherLanguages) {
  std::string text;
  for (const char* symbol : {"ˈ", "ɪ", "ç", " ", "h", "ˈ", "ø", "ː", "ʁ", "ə", " ", "b", "ɔ", "̃", "ʒ", "."})
    text += (text.empty() ? "" : ", ") + (R"({"phoneme": ")" + std::string(symbol) + R"(", "num_samples": 1600})");
  const TimesFile times =
      parseTimes(R"({"sample_rate": 16000, "phoneme_alignments": [)" + text + "]}", "a.json", languageOf("de"));
  EXPECT_EQ(phonesIn(times), "ɪ ç h øː ʁ ə b ɔ̃ ʒ");
  ASSERT_GT(times.phones.size(), 3U);
  EXPECT_NEAR(times.phones[3].span.start, 0.5, 1e-9);  // from its stress mark
  EXPECT_NEAR(times.phones[3].span.end, 0.8, 1e-9);
  EXPECT_EQ(times.phones[3].stress, 1);
  EXPECT_EQ(times.phones[5].stress, 0);
}

TEST(TimesHabits, PiperSymbolsThatNobodyKnowsAreTold) {
  const TimesFile times = parseTimes(
      R"({"sample_rate": 1600, "phoneme_alignments": [{"phoneme": "a", "num_samples": 10},
          {"phoneme": "字", "num_samples": 10}]})",
      "a.json", languageOf("de"));
  EXPECT_EQ(times.phones.size(), 1U);
  ASSERT_EQ(times.not_said.size(), 1U);
  EXPECT_EQ(times.not_said.front(), "字");
}

TEST(TimesHabits, ASegmentOfWhisperXMayBeginWithAWordWithoutTimes) {
  const TimesFile times = parseTimes(
      R"({"segments": [
          {"start": 0.1, "end": 1.95, "text": "So", "words": [{"word": "So", "start": 0.1, "end": 1.95}]},
          {"start": 2.4, "end": 3.0, "text": "2 came", "words": [{"word": "2"}, {"word": "came", "start": 2.4, "end": 3.0}]},
          {"start": 3.0, "end": 4.0, "text": "1984 5", "words": [{"word": "1984"}, {"word": "5"}]},
          {"start": 4.0, "end": 4.2, "text": "1 2 3 4 5 6 7 8 9 10 11 end",
           "words": [{"word": "1"}, {"word": "2"}, {"word": "3"}, {"word": "4"}, {"word": "5"}, {"word": "6"},
                     {"word": "7"}, {"word": "8"}, {"word": "9"}, {"word": "end", "start": 4.0, "end": 4.2}]}]})",
      "x.json");
  EXPECT_EQ(wordsIn(times), "So|2|came|1984|5|1 2 3 4 5 6 7 8 9|end");
  EXPECT_NEAR(times.words[1].span.start, 2.1, 1e-9);
  EXPECT_NEAR(times.words[1].span.end, 2.4, 1e-9);
  EXPECT_NEAR(times.words[3].span.end, 3.5, 1e-9);
  EXPECT_THROW(parseTimes(R"({"segments": [{"text": "1", "words": [{"word": "1"}]}]})", "x.json"), InputError);
}

TEST(TimesHabits, GooglesLastResultRepeatsAllWordsWithTheirSpeakers) {
  const auto word = [](const std::string& text, const char* from, const char* to, const std::string& more) {
    return R"({"word": ")" + text + R"(", "startTime": ")" + from + R"(", "endTime": ")" + to + "\"" + more + "}";
  };
  const auto result = [](const std::string& words) { return R"({"alternatives": [{"words": [)" + words + "]}]}"; };
  const std::string a = word("hello", "0.5s", "1s", ""), b = word("you", "1.2s", "1.5s", "");
  const std::string both =
      word("hello", "0.5s", "1s", R"(, "speakerTag": 1)") + "," + word("you", "1.2s", "1.5s", R"(, "speakerTag": 2)");
  const TimesFile times =
      parseTimes(R"({"results": [)" + result(a) + "," + result(b) + "," + result(both) + "]}", "g.json");
  EXPECT_EQ(wordsIn(times), "hello|you");
}

TEST(TimesHabits, AWordThatAnAlignerCouldNotSpellLeavesTheOthersTheirStress) {
  const std::string csv =
      "Begin,End,Label,Type,Speaker\n0,0.5,ever,words,a\n0.5,1,zorp,words,a\n0,0.1,EH2,phones,a\n0.1,0.2,V,phones,a\n"
      "0.2,0.5,ER1,phones,a\n0.5,1,spn,phones,a\n";
  const TimesFile times = parseTimes(csv, "m.csv");
  ASSERT_EQ(times.phones.size(), 3U);
  EXPECT_EQ(times.phones[0].stress, 2);
  EXPECT_EQ(times.phones[2].stress, 1);
}

TEST(TimesHabits, LyricsComeSoonerByTheirOffset) {
  const TimesFile times = parseTimes("[offset:+500]\n[00:02.00]one two\n[00:04.00]three\n", "o.lrc");
  ASSERT_EQ(times.words.size(), 2U);
  EXPECT_NEAR(times.words[0].span.start, 1.5, 1e-9);
  EXPECT_NEAR(parseTimes("[offset: -500]\n[00:02.00]one\n", "o.lrc").words[0].span.start, 2.5, 1e-9);
  EXPECT_THROW(parseTimes("[offset:soon]\n[00:02.00]one\n", "o.lrc"), InputError);
}

TEST(TimesHabits, OfLyricsInTwoLanguagesTheFirstIsSung) {
  const TimesFile times = parseTimes(
      "[00:02.00]guten Morgen\n[00:04.00]\n[00:06.00]bis bald\n[00:02.00]good morning\n[00:06.00]see you\n", "two.lrc");
  EXPECT_EQ(wordsIn(times), "guten Morgen|bis bald");
  EXPECT_EQ(times.not_said.size(), 2U);
}

}  // namespace
}  // namespace mouthpiece
