#include <algorithm>
#include <filesystem>
#include <fstream>

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

/// Labels before any sound, both as in a line that is spoken whole.
TEST(FliteVoice, TellsWhatItSaysBeforeItsSoundIsMade) {
  for (const char* name : {"flite:slt", "flite:rms", "flite:awb", "flite:kal16"}) {
    const auto voice = makeVoice(name);
    for (const char* text : {"we'll see my mother's ship, at one", "It is one. ... It is two!"}) {
      const SpokenLine whole = voice->speak(text);
      SpeechLabels labels;
      std::vector<float> samples;
      std::size_t sounds_since = 0, utterances = 0;
      voice->speakInPieces(text, [&](const SpokenPiece& piece) {
        EXPECT_NE(piece.labels.phones.empty(), piece.audio.samples.empty());
        if (!piece.labels.phones.empty()) {
          EXPECT_NEAR(labels.duration(), static_cast<double>(samples.size()) / whole.audio.sample_rate_hz, 1e-9);
          utterances == 0 ? void(labels = piece.labels) : appendSpeechLabels(labels, piece.labels);
          EXPECT_TRUE(utterances++ == 0 || sounds_since > 3) << name << ' ' << sounds_since;
          sounds_since = 0;
          return;
        }
        ++sounds_since;
        EXPECT_EQ(piece.audio.sample_rate_hz, whole.audio.sample_rate_hz);
        samples.insert(samples.end(), piece.audio.samples.begin(), piece.audio.samples.end());
      });
      EXPECT_GT(sounds_since, 3U) << name;
      EXPECT_EQ(samples, whole.audio.samples) << name;
      EXPECT_EQ(namesOf(labels), namesOf(whole.labels));
      EXPECT_EQ(wordsOf(labels), wordsOf(whole.labels));
      ASSERT_EQ(labels.phones.size(), whole.labels.phones.size());
      for (std::size_t i = 0; i < labels.phones.size(); ++i)
        EXPECT_NEAR(labels.phones[i].span.end, whole.labels.phones[i].span.end, 1e-4) << name << ' ' << i;
    }
  }
}

/// Who takes the pieces may speak himself, and give up.
TEST(FliteVoice, WhoTakesPiecesMaySpeakAndGiveUp) {
  const auto voice = makeVoice("flite:slt"), other = makeVoice("flite:kal16");
  const SpokenLine whole = voice->speak("the time is now");
  struct Enough {};
  std::size_t pieces = 0;
  const auto take = [&](const SpokenPiece&) {
    EXPECT_FALSE(other->speak("no").audio.samples.empty());
    if (++pieces == 3) throw Enough();
  };
  EXPECT_THROW(voice->speakInPieces("the time is now, and it will not come again", take), Enough);
  EXPECT_EQ(pieces, 3U);
  EXPECT_EQ(voice->speak("the time is now").audio.samples, whole.audio.samples);
  EXPECT_THROW(voice->speakInPieces("...", [](const SpokenPiece&) {}), InputError);
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

/// Flite takes AM for "in the morning", which it does not say, and HI for Hawaii.
TEST(FliteVoice, SaysEveryWordInCapitals) {
  const auto voice = makeVoice("flite:rms");
  EXPECT_EQ(wordsOf(voice->speak("I AM HERE").labels), "I AM HERE");
  EXPECT_EQ(wordsOf(voice->speak("HI DAD").labels), "HI DAD");
  std::ifstream lines(std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "tests/data/everyday.txt");
  std::size_t said = 0;
  for (std::string line; std::getline(lines, line); ++said) {
    std::transform(line.begin(), line.end(), line.begin(), [](char c) { return c >= 'a' && c <= 'z' ? c - 32 : c; });
    const SpokenLine loud = voice->speak(line);
    EXPECT_EQ(wordsOf(loud.labels), plainWordsOf(loud.text)) << line;
  }
  EXPECT_GE(said, 50U);
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
