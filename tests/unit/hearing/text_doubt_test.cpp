#include "hearing/alignment/text_doubt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "base/index.h"
#include "hearing/alignment/phone_ear.h"
#include "hearing/alignment/pronouncer.h"
#include "support/error_of.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;
const fs::path kGridTakes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";

bool isDoubted(ForcedAligner& aligner, const AudioClip& audio, const std::vector<TranscriptWord>& words) {
  return !doubtsAbout(aligner.align(audio, words, "line")).empty();
}

/// Voices and lines from which no weight was learnt.
TEST(TextDoubt, TellsRightTextsFromOthersFromCutAndFromChangedOnes) {
  const std::array<std::string, 3> lines{"glue the sheet to the dark blue background",
                                         "these days a chicken leg is a rare dish",
                                         "the juice of lemons makes fine punch"};
  const std::array<std::array<std::string, 2>, 3> changes{{{"blue", "green"}, {"leg", "neck"}, {"lemons", "melons"}}};
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  int right = 0, other = 0, cut = 0, changed = 0;
  for (const char* name : {"flite:rms", "flite:kal16"}) {
    const auto voice = makeVoice(name);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const AudioClip sound = voice->speak(lines[i]).audio;
      std::vector<TranscriptWord> words = pronouncer.wordsOf(lines[i]);
      right += isDoubted(aligner, sound, words) ? 1 : 0;
      other += isDoubted(aligner, sound, pronouncer.wordsOf(lines[(i + 1) % lines.size()])) ? 1 : 0;
      const auto& [said, written] = changes[i];
      std::string text = lines[i];
      text.replace(text.find(said), said.size(), written);
      changed += doubtsAbout(aligner.align(sound, pronouncer.wordsOf(text), "line")).find(written) != std::string::npos
                     ? 1
                     : 0;
      words.resize(words.size() - 3);
      cut += isDoubted(aligner, sound, words) ? 1 : 0;
    }
  }
  EXPECT_EQ(right, 0) << "of 6";
  EXPECT_EQ(other, 6) << "of 6";
  EXPECT_GE(cut, 4) << "of 6";
  EXPECT_GE(changed, 5) << "of 6";
}

/// Takes from which no weight was learnt: every fourth.
TEST(TextDoubt, BelievesTheRealSpeakersTexts) {
  if (!fs::exists(kGridTakes)) GTEST_SKIP() << "no real capture in " << kGridTakes;
  std::vector<fs::path> takes;
  for (const auto& entry : fs::directory_iterator(kGridTakes)) {
    if (entry.path().extension() == ".wav") takes.push_back(entry.path());
  }
  std::sort(takes.begin(), takes.end());
  const Pronouncer pronouncer;
  std::vector<std::vector<TranscriptWord>> texts;
  std::vector<AudioClip> sounds;
  for (std::size_t i = 0; i < takes.size(); i += 16) {
    std::ifstream file(fs::path(takes[i]).replace_extension(".txt"));
    std::string text;
    std::getline(file, text);
    texts.push_back(pronouncer.wordsOf(text));
    sounds.push_back(readAudio(takes[i]));
  }
  ASSERT_GT(sounds.size(), 10U);
  ForcedAligner aligner;
  std::size_t right = 0, other = 0;
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    right += isDoubted(aligner, sounds[i], texts[i]) ? 1U : 0U;
    other += isDoubted(aligner, sounds[i], texts[(i + texts.size() / 2) % texts.size()]) ? 1U : 0U;
  }
  EXPECT_LE(right, 1U) << "of " << sounds.size();
  EXPECT_GE(other + 1, sounds.size());
}

TEST(TextDoubt, TellsSilentNoisyAndUnsteadyBackgroundsApart) {
  PhoneDecoder decoder({}, english());
  TextDoubt doubt(decoder, english());
  const std::vector<std::int16_t> voice =
      samplesToHear(makeVoice("flite:slt")->speak("the birch canoe slid on the smooth planks").audio);
  EXPECT_EQ(doubt.backgroundOf(voice).noise, 0);
  const auto under = [&](auto level) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise;
    std::vector<std::int16_t> mixed = voice;
    for (std::size_t i = 0; i < mixed.size(); ++i)
      mixed[i] = static_cast<std::int16_t>(std::clamp(mixed[i] + level(i) * noise(random), -32000.0, 32000.0));
    return doubt.backgroundOf(mixed);
  };
  const Background steady = under([](std::size_t) { return 1000.0; });
  EXPECT_GT(steady.noise, 0.3);
  EXPECT_LT(steady.unsteady, 0.1);
  const Background beats = under([](std::size_t i) { return i / 1600 % 2 == 0 ? 900.0 : 90.0; });
  EXPECT_GT(beats.noise, 0.3);
  EXPECT_GT(beats.unsteady, 0.5 * beats.noise);
  EXPECT_TRUE(doubt.judge({}, {}).words.empty());
}

/// Any words lie somewhere in a steady sound: where it is as steady as no speech, they are refused, else doubted. Words
/// that are said in one are believed.
TEST(TextDoubt, RefusesOrDoubtsAnyTextOfNoiseAndHum) {
  const AudioClip line =
      resampleAudio(makeVoice("flite:rms")->speak("the juice of lemons makes fine punch").audio, 16000);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const auto soundOf = [&](double speech, auto sampleAt) {
    AudioClip sound{16000, {}};
    for (std::size_t i = 0; i < line.samples.size(); ++i)
      sound.samples.push_back(static_cast<float>(speech * double{line.samples[i]} + sampleAt(i)));
    return sound;
  };
  const auto hiss = [&](std::size_t) { return 0.01 * normal(random); };
  const auto blip = [&](std::size_t i) {
    return hiss(i) + (i < 1280 ? 0.03 * std::sin(2 * std::numbers::pi * 1000 * asReal(i) / 16000) : 0.0);
  };
  const auto hum = [](std::size_t i) {
    double value = 0;
    for (int k = 1; k < 20; ++k) value += 0.01 / k * std::sin(2 * std::numbers::pi * 50 * k * asReal(i) / 16000 + k);
    return value;
  };
  const Pronouncer pronouncer;
  ForcedAligner aligner;
  const auto refusalOf = [&](const AudioClip& sound, const char* text) {
    return errorOf([&] { aligner.align(sound, pronouncer.wordsOf(text), "line"); });
  };
  for (const char* text : {"the juice of lemons makes fine punch", "good morning"}) {
    EXPECT_EQ(refusalOf(soundOf(0, [](std::size_t) { return 0.0; }), text),
              "line: holds silence only; expected speech");
    EXPECT_EQ(refusalOf(soundOf(0, hiss), text), "line: holds steady noise or tones only; expected speech");
    EXPECT_EQ(refusalOf(soundOf(0, hum), text), "line: holds steady noise or tones only; expected speech");
    EXPECT_TRUE(isDoubted(aligner, soundOf(0, blip), pronouncer.wordsOf(text))) << text;
  }
  EXPECT_FALSE(isDoubted(aligner, soundOf(1, hiss), pronouncer.wordsOf("the juice of lemons makes fine punch")));
  EXPECT_FALSE(isDoubted(aligner, soundOf(1, hum), pronouncer.wordsOf("the juice of lemons makes fine punch")));
}

/// So many seconds of noise round one quiet word, as loud as itself, are no reason to refuse it.
TEST(TextDoubt, OneQuietWordInNoiseIsNotRefused) {
  const AudioClip word = resampleAudio(makeVoice("flite:rms")->speak("now").audio, 16000);
  double power = 0;
  for (const float sample : word.samples) power += double{sample} * double{sample} / asReal(word.samples.size());
  constexpr double kQuiet = 0.003;
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  AudioClip sound{16000, {}};
  for (std::size_t i = 0; i < 25 * 16000; ++i) {
    const std::size_t at = i - 10 * 16000;
    const double said = i >= 10 * 16000 && at < word.samples.size() ? double{word.samples[at]} : 0.0;
    sound.samples.push_back(static_cast<float>(kQuiet * (said + std::sqrt(power) * normal(random))));
  }
  const Pronouncer pronouncer;
  EXPECT_EQ(errorOf([&] { ForcedAligner().align(sound, pronouncer.wordsOf("now"), "line"); }), "no error");
}

}  // namespace
}  // namespace mouthpiece
