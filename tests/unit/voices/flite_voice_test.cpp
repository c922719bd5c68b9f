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
  EXPECT_EQ(wordsOf(line.labels), "it is one it is two is it three");
  EXPECT_EQ(voice->speak("almost ten").audio.samples, voice->speak("almost ten").audio.samples);
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
