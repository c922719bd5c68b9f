#include "support/voice_testing.h"

namespace mouthpiece {
namespace {

TEST(FliteVoice, EveryVoiceSpeaksWithLabelsOnTheSoundsClock) {
  for (const char* name : {"flite:slt", "flite:rms", "flite:awb", "flite:kal16"}) {
    const SpokenLine line = makeVoice(name)->speak("the time is now");
    EXPECT_NO_THROW(expectConsistent(line.labels)) << name;
    EXPECT_NEAR(line.labels.duration(), line.audio.duration(), 1e-3) << name;
    EXPECT_LT(meanPower(line, true), 0.02 * meanPower(line, false)) << name;
    EXPECT_EQ(line.voice, name);
    EXPECT_EQ(namesOf(line.labels), "sil DH AH T AY M IH Z N AW sil") << name;
    EXPECT_EQ(wordsOf(line.labels), "the time is now");
    ASSERT_EQ(line.labels.syllables.size(), 4U);
    EXPECT_EQ(line.labels.syllables[1].stress, 1);
  }
}

TEST(FliteVoice, JoinsSentencesAndSpeaksAgain) {
  const auto voice = makeVoice("flite:kal16");
  const SpokenLine line = voice->speak("It is one. It is two! Is it three?");
  EXPECT_EQ(wordsOf(line.labels), "It is one It is two Is it three");
  EXPECT_EQ(voice->speak("almost ten").audio.samples, voice->speak("almost ten").audio.samples);
}

/// Flite says "mother" "'s", "dont" and "_a".
TEST(FliteVoice, WordsAreSpelledAsTheyAreWritten) {
  const auto voice = makeVoice("flite:kal16");
  const SpokenLine line =
      voice->speak("Don't tell my mother's friend we'll be late; it's Bob's cat, its tail and A.I.");
  EXPECT_EQ(wordsOf(line.labels), "Don't tell my mother's friend we'll be late it's Bob's cat its tail and A I");
  EXPECT_NO_THROW(expectConsistent(line.labels));
  for (const LabelledWord& word : line.labels.words) {
    const std::size_t first = *line.labels.phones[word.phones.first.value].syllable;
    const std::size_t last = *line.labels.phones[word.phones.last.value].syllable;
    EXPECT_EQ(last - first, word.text == "mother's" ? 1U : 0U) << word.text;
  }
}

TEST(FliteVoice, SurvivesOddAndLongTexts) {
  const auto voice = makeVoice("flite:kal16");
  std::string longest;
  while (longest.size() < 10000) longest += "(ten) \"past\" five\\ ";
  for (const std::string& text :
       {std::string("a"), std::string("1"), std::string("''s"), std::string("$5"), std::string("10:30 A.M."), longest,
        std::string(10000, 'a'), std::string(1000, '7')}) {
    EXPECT_NO_THROW(expectConsistent(voice->speak(text).labels)) << text.substr(0, 20);
  }
}

TEST(FliteVoice, RefusesTheSameTextsAsFestival) {
  const auto voice = makeVoice("flite:kal16");
  EXPECT_THROW(voice->speak(""), InputError);
  EXPECT_THROW(voice->speak("\u041F"), InputError);
}

}  // namespace
}  // namespace mouthpiece
