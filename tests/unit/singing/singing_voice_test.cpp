#include "singing/singing_voice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "audio/pitch_track.h"
#include "base/errors.h"
#include "singing/singing_script.h"

namespace mouthpiece {
namespace {

std::vector<SungWord> words() {
  return {{"gloria", {{{196, 1.0, false}, {220, 0.5, false}}, {{147, 0.5, false}}, {{131, 0.5, false}}}, 0.5},
          {"star", {{{262, 1.5, true}}}, 0}};
}

TEST(SingingScript, WritesATonePerSyllableAndSlurs) {
  const std::string xml = singingXml(words(), 0.4, {});
  EXPECT_NE(xml.find("<REST SECONDS=\"0.4000\">"), std::string::npos);
  EXPECT_NE(
      xml.find(
          "<DURATION SECONDS=\"1.00000+0.50000,0.50000,0.50000\"><PITCH FREQ=\"196.00+220.00,147.00,131.00\">gloria<"),
      std::string::npos);
  EXPECT_EQ(std::count(xml.begin(), xml.end(), '+'), 2 * 1 + 2 * 74);  // 1.5 s of vibrato in steps of 20 ms
}

TEST(SingingScript, FitsSyllables) {
  auto fewer = fitSyllables(words(), {2, 1});
  ASSERT_EQ(fewer[0].syllables.size(), 2U);
  EXPECT_EQ(fewer[0].syllables[1].size(), 2U);
  auto more = fitSyllables(words(), {3, 3});
  ASSERT_EQ(more[1].syllables.size(), 3U);
  EXPECT_DOUBLE_EQ(more[1].syllables[2][0].duration, 0.5);
}

TEST(SingingScript, RefusesWhatNoVoiceSings) {
  const auto with = [](SungWord word) { return std::vector<SungWord>{std::move(word)}; };
  EXPECT_NO_THROW(checkSungWords(words(), 0));
  EXPECT_THROW(checkSungWords({}, 0), InputError);
  EXPECT_THROW(checkSungWords(words(), -1), InputError);
  EXPECT_THROW(checkSungWords(with({"a\" (quit)", {{{200, 1, false}}}, 0}), 0), InputError);
  EXPECT_THROW(checkSungWords(with({"'", {{{200, 1, false}}}, 0}), 0), InputError);
  EXPECT_THROW(checkSungWords(with({"a", {}, 0}), 0), InputError);
  EXPECT_THROW(checkSungWords(with({"a", {{{NAN, 1, false}}}, 0}), 0), InputError);
  EXPECT_THROW(checkSungWords(with({"a", {{{200, 1e9, false}}}, 0}), 0), InputError);
  EXPECT_THROW(checkSungWords(with({"a", {{{200, 1, false}}}, NAN}), 0), InputError);
}

TEST(SingingVoice, SingsTonesAtTheirTimes) {
  if (!festivalAvailable()) GTEST_SKIP() << "Festival is not installed: nothing is sung";
  const SungLine sung = singWords(words(), 0.4);
  EXPECT_NEAR(sung.line.audio.duration(), 0.4 + 2.5 + 0.5 + 1.5, 0.1);
  ASSERT_EQ(sung.line.labels.words.size(), 2U);
  EXPECT_EQ(sung.line.labels.words[1].text, "star");
  ASSERT_EQ(sung.tones.size(), 5U);
  EXPECT_NEAR(sung.tones[4].span.start, 3.4, 1e-9);
  const PitchTrack pitch = trackPitch(sung.line.audio);
  for (std::size_t i = 0; i < 4; ++i) {
    // Consonants stand before the beat: the middle of a tone is surely its own.
    EXPECT_NEAR(pitch.hzAt(sung.tones[i].span.middle()), sung.tones[i].hz, 0.02 * sung.tones[i].hz) << i;
  }
  std::vector<double> semitones;
  for (Seconds t = 4.0; t < 4.6; t += 0.01) {
    const double hz = pitch.hzAt(t);
    // Single frames may be taken for an octave above or below.
    if (hz > 200 && hz < 340) semitones.push_back(12 * std::log2(hz / 262));
  }
  ASSERT_GT(semitones.size(), 50U);
  const auto [low, high] = std::minmax_element(semitones.begin(), semitones.end());
  EXPECT_NEAR(*high - *low, 1.0, 0.35);  // twice half a semitone
}

TEST(SingingVoice, SaysWhichWordItCannotSay) {
  if (!festivalAvailable()) GTEST_SKIP() << "Festival is not installed: nothing is sung";
  try {
    singWords({{"o'er", {{{200, 1, false}}}, 0}}, 0);
    FAIL() << "a word without phones was sung";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("o'er"), std::string::npos);
  }
}

}  // namespace
}  // namespace mouthpiece
