#include "hearing/tags/hear_tags.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "base/text_numbers.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {
namespace {

constexpr int kRate = 16000;

/// A tone with twenty harmonics through the formants of an A; vibrato of 6 Hz and half a semitone from `vibrato_from`.
AudioClip sungVowel(double hz, Seconds duration, Seconds vibrato_from, int rate = kRate) {
  AudioClip clip{.sample_rate_hz = rate, .samples = {}};
  double phase = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(duration * rate); ++i) {
    const double t = static_cast<double>(i) / rate;
    const double swing = t >= vibrato_from ? 0.5 * std::sin(2 * std::numbers::pi * 6 * (t - vibrato_from)) : 0;
    phase += 2 * std::numbers::pi * hz * std::exp2(swing / 12) / rate;
    double sample = 0;
    for (int h = 1; h <= 20; ++h) {
      const double f = h * hz;
      const double gain = 1 / (1 + std::pow((f - 750) / 150, 2)) + 0.6 / (1 + std::pow((f - 1250) / 200, 2)) + 0.05;
      sample += gain / std::sqrt(h) * std::sin(h * phase);
    }
    clip.samples.push_back(static_cast<float>(0.1 * sample));
  }
  return clip;
}

SpeechLabels labelsOf(std::vector<PhoneSegment> phones, Seconds duration) {
  for (PhoneSegment& phone : phones) phone.word = 0;
  return buildSpeechLabels(std::move(phones), std::vector<std::string>{"la"}, duration);
}

TEST(HearTags, FindsNoteAndVibratoOfAHeldVowel) {
  const AudioClip clip = sungVowel(220, 2.0, 0.7);
  const SpeechLabels labels = labelsOf({{Phone::kAA, {0.0, 2.0}}}, 2.0);
  const AudioTags tags = hearTags(clip, &labels);
  EXPECT_EQ(tags.f0.size(), 201U);
  ASSERT_FALSE(tags.notes.empty());
  EXPECT_NEAR(tags.notes[0].hz, 220, 220 * 0.006);  // 10 cents
  ASSERT_EQ(tags.vibrato.size(), 1U);
  EXPECT_NEAR(tags.vibrato[0].rate_hz, 6, 0.2);
  EXPECT_NEAR(tags.vibrato[0].depth_semitones, 0.5, 0.12);
  EXPECT_NEAR(tags.vibrato[0].span.start, 0.75, 0.12);
}

/// "ma ma" on one pitch: what parts the notes is the second M.
TEST(HearTags, SyllablesOnOnePitchAreNotesEachWithoutLabels) {
  AudioClip clip = sungVowel(220, 1.2, 9);
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double time = static_cast<double>(i) / kRate;
    if (time > 0.5 && time < 0.58) clip.samples[i] *= 0.25F;
  }
  const AudioTags tags = hearTags(clip, nullptr);
  ASSERT_EQ(tags.notes.size(), 2U);
  EXPECT_NEAR(tags.notes[0].span.end, 0.5, 0.03);
  EXPECT_NEAR(tags.notes[1].span.start, 0.58, 0.03);
  EXPECT_NEAR(tags.notes[1].hz, 220, 220 * 0.006);
}

TEST(HearTags, HearsNoPitchOutsideVowels) {
  const AudioClip clip = sungVowel(220, 1.5, 9);
  const SpeechLabels labels = labelsOf({{Phone::kM, {0.1, 0.6}}, {Phone::kAA, {0.6, 1.2}}}, 1.5);
  for (const PitchSample& sample : hearTags(clip, &labels).f0) {
    EXPECT_TRUE(!sample.voiced || (sample.time >= 0.6 && sample.time < 1.2)) << sample.time;
  }
}

TEST(HearTags, ConsonantsHaveHighFrequencyEnergyWhereTheRateAllows) {
  AudioClip clip{.sample_rate_hz = 44100, .samples = std::vector<float>(44100, 0.0F)};
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.1F);
  for (std::size_t i = 8820; i < 17640; ++i) clip.samples[i] = noise(random);
  const SpeechLabels labels =
      labelsOf({{Phone::kS, {0.2, 0.4}}, {Phone::kAA, {0.4, 0.6}}, {Phone::kM, {0.6, 0.8}}}, 1.0);
  const AudioTags tags = hearTags(clip, &labels);
  ASSERT_EQ(tags.consonants.size(), 2U);
  // White noise of variance 0.01: 12 of 22.05 kHz of it lie in the band.
  EXPECT_NEAR(tags.consonants[0].energy, 0.01 * 12 / 22.05, 0.0008);
  EXPECT_LT(tags.consonants[1].energy, 1e-6);
  EXPECT_EQ(tags.consonant_low_hz, 8000);
  // Without that band the highest octave there is, whether the rate ends there or the sound does.
  const AudioTags low = hearTags(resampleAudio(clip, 16000), &labels);
  ASSERT_EQ(low.consonants.size(), 2U);
  EXPECT_EQ(low.consonant_low_hz, 4000);
  EXPECT_GT(low.consonants[0].energy, 100 * low.consonants[1].energy);
  const AudioTags filled = hearTags(resampleAudio(resampleAudio(clip, 16000), 44100), &labels);
  EXPECT_LT(filled.consonant_low_hz, 8000);
  EXPECT_GT(filled.consonants[0].energy, 100 * filled.consonants[1].energy);
}

TEST(HearTags, JsonHoldsTheContract) {
  const AudioClip clip = sungVowel(220, 1.0, 0.2);
  const auto json = nlohmann::json::parse(formatTagsJson(hearTags(clip, nullptr)));
  for (const char* key : {"f0", "notes", "vibrato", "vowels", "consonants"})
    ASSERT_TRUE(json.at(key).is_array()) << key;
  EXPECT_TRUE(json["f0"][50].at("voiced").get<bool>());
  EXPECT_NEAR(json["f0"][50].at("time_s").get<double>(), 0.5, 1e-9);
  EXPECT_TRUE(json["notes"][0].contains("start_s") && json["notes"][0].contains("end_s") &&
              json["notes"][0].contains("hz"));
  double sum = 0;
  for (const char* vowel : {"A", "E", "I", "O", "U", "silence"}) sum += json["vowels"][50].at(vowel).get<double>();
  EXPECT_NEAR(sum, 1, 1e-3);
}

TEST(HearTags, StandsSilenceAndTheShortestSound) {
  for (const std::size_t count : {1U, 100U, 16000U}) {
    const AudioClip clip{.sample_rate_hz = kRate, .samples = std::vector<float>(count, 0.0F)};
    const AudioTags tags = hearTags(clip, nullptr);
    EXPECT_TRUE(tags.notes.empty());
    ASSERT_EQ(soundWarnings(clip, nullptr, tags).size(), 1U);
    EXPECT_NE(soundWarnings(clip, nullptr, tags)[0].find("silent"), std::string::npos);
  }
}

TEST(SoundWarnings, NameClippingAndInstruments) {
  AudioClip clip = sungVowel(220, 3.0, 9);
  const SpeechLabels labels = labelsOf({{Phone::kAA, {1.0, 2.0}}}, 3.0);
  std::vector<std::string> warnings = soundWarnings(clip, &labels, hearTags(clip, &labels));
  ASSERT_EQ(warnings.size(), 1U);  // it sounds on through the pauses
  EXPECT_NE(warnings[0].find("instruments"), std::string::npos);
  for (float& sample : clip.samples) sample = std::clamp(sample * 20, -1.0F, 1.0F);
  warnings = soundWarnings(clip, nullptr, hearTags(clip, nullptr));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("clipped"), std::string::npos);
}

/// Praat's own pitch every 10 ms, (time, Hz) of voiced frames; empty when it is not installed.
std::vector<std::pair<double, double>> pitchByPraat(const AudioClip& clip) {
  if (std::system("command -v praat > /dev/null 2>&1") != 0) return {};
  const auto folder = std::filesystem::path(testing::TempDir()) / "mouthpiece_praat";
  std::filesystem::create_directories(folder);
  writeWav(folder / "a.wav", clip);
  FILE* script = std::fopen((folder / "a.praat").c_str(), "w");
  std::fputs(
      "Read from file: \"a.wav\"\nTo Pitch (ac): 0.01, 75, 15, \"no\", 0.03, 0.45, 0.01, 0.35, 0.14, 1000\n"
      "n = Get number of frames\nfor i to n\n  t = Get time from frame number: i\n"
      "  f = Get value in frame: i, \"Hertz\"\n  if f <> undefined\n    writeInfo: \"\"\n"
      "    appendFileLine: \"out.txt\", fixed$(t, 6), \" \", fixed$(f, 6)\n  endif\nendfor\n",
      script);
  std::fclose(script);
  std::filesystem::remove(folder / "out.txt");
  if (std::system(fmt::format("cd {} && praat --run a.praat > /dev/null 2>&1", folder.string()).c_str()) != 0)
    return {};
  std::vector<std::pair<double, double>> pitch;
  FILE* out = std::fopen((folder / "out.txt").c_str(), "r");
  for (double t = 0, hz = 0; out != nullptr && std::fscanf(out, "%lf %lf", &t, &hz) == 2;) pitch.emplace_back(t, hz);
  if (out != nullptr) std::fclose(out);
  return pitch;
}

TEST(HearTags, PitchAgreesWithPraat) {
  const AudioClip clip = sungVowel(220, 2.0, 0.5);
  const auto praat = pitchByPraat(clip);
  if (praat.empty()) GTEST_SKIP() << "Praat is not installed (apt-get install praat): its pitch is not compared";
  ASSERT_GT(praat.size(), 150U);
  const AudioTags tags = hearTags(clip, nullptr);
  double squares = 0;
  std::size_t count = 0;
  for (const auto& [time, hz] : praat) {
    const auto before = static_cast<std::size_t>(time * kPitchRateHz);
    if (time < 0.1 || time > 1.9 || !tags.f0[before].voiced || !tags.f0[before + 1].voiced) continue;
    const double ours =
        std::lerp(tags.f0[before].hz, tags.f0[before + 1].hz, time * kPitchRateHz - static_cast<double>(before));
    squares += std::pow(1200 * std::log2(ours / hz), 2);
    ++count;
  }
  ASSERT_GT(count, 150U);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 8);  // cents; the two windows differ in length
}

}  // namespace
}  // namespace mouthpiece
