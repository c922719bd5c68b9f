#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "audio/audio_clip.h"

namespace mouthpiece {
namespace {

/// Away from the ends, where the kernel hangs over.
constexpr double kMargin_s = 0.02;

double sineAt(double frequency_hz, double time_s) {
  return 0.5 * std::sin(2 * std::numbers::pi * frequency_hz * time_s);
}

AudioClip tone(int sample_rate_hz, double frequency_hz, double duration_s) {
  AudioClip clip{.sample_rate_hz = sample_rate_hz, .samples = {}};
  for (int i = 0; i < duration_s * sample_rate_hz; ++i) {
    clip.samples.push_back(static_cast<float>(sineAt(frequency_hz, static_cast<double>(i) / sample_rate_hz)));
  }
  return clip;
}

/// Largest distance from the ideal sine, inside the margins.
double worstError(const AudioClip& clip, double frequency_hz, double amplitude_share) {
  double worst = 0;
  for (std::size_t i = 0; i < clip.samples.size(); ++i) {
    const double time = static_cast<double>(i) / clip.sample_rate_hz;
    if (time < kMargin_s || time > clip.duration() - kMargin_s) continue;
    worst = std::max(worst, std::abs(clip.samples[i] - amplitude_share * sineAt(frequency_hz, time)));
  }
  return worst;
}

TEST(ResampleAudio, KeepsTonesInsideTheBand) {
  constexpr double kTolerance = 1e-4;  // 74 dB under the tone
  for (const auto& [from, to] :
       {std::pair{44100, 16000}, {32000, 16000}, {16000, 48000}, {16000, 22050}, {8000, 44101}}) {
    const double highest = 0.4 * std::min(from, to);
    for (const double frequency : {100.0, 1000.0, highest}) {
      const AudioClip clip = resampleAudio(tone(from, frequency, 0.2), to);
      EXPECT_EQ(clip.sample_rate_hz, to);
      EXPECT_NEAR(clip.duration(), 0.2, 1.0 / to);
      EXPECT_LT(worstError(clip, frequency, 1), kTolerance) << from << " to " << to << " at " << frequency;
    }
  }
}

TEST(ResampleAudio, StopsTonesAboveTheNewBand) {
  constexpr double kTolerance = 0.5 * 3.2e-5;  // 90 dB under the tone
  EXPECT_LT(worstError(resampleAudio(tone(48000, 8600, 0.2), 16000), 0, 0), kTolerance);
  EXPECT_LT(worstError(resampleAudio(tone(48000, 15000, 0.2), 16000), 0, 0), kTolerance);
}

TEST(ResampleAudio, KeepsConstantsExactly) {
  const AudioClip clip = resampleAudio({.sample_rate_hz = 44100, .samples = std::vector<float>(8820, 0.25F)}, 16000);
  for (std::size_t i = 400; i + 400 < clip.samples.size(); ++i) EXPECT_NEAR(clip.samples[i], 0.25F, 1e-6F);
}

TEST(ResampleAudio, ChangesNothingAtTheSameRate) {
  const AudioClip clip = tone(16000, 300, 0.1);
  EXPECT_EQ(resampleAudio(clip, 16000).samples, clip.samples);
}

TEST(StretchAudio, LowersTonesAndLastsLonger) {
  constexpr double kTolerance = 0.5 * 3.2e-4;  // 70 dB under the tone
  for (const double factor : {1.0001, 0.9998, 1.0}) {
    for (const double frequency : {100.0, 1000.0, 6400.0}) {
      const AudioClip clip = stretchAudio(tone(16000, frequency, 10), factor);
      EXPECT_NEAR(clip.duration(), 10 * factor, 1e-4);
      EXPECT_LT(worstError(clip, frequency / factor, 1), kTolerance) << factor << " at " << frequency;
    }
  }
}

TEST(LiveResampler, GivesTheSameSamplesInChunksOfAnySize) {
  std::mt19937 random(11);
  for (const int from : {16000, 22050, 44100, 48000}) {
    const AudioClip clip = tone(from, 700, 0.2);
    const std::vector<float> whole = resampleAudio(clip, 16000).samples;
    LiveResampler live(from, 16000);
    std::vector<float> made;
    for (std::size_t at = 0; at < clip.samples.size();) {
      const std::size_t count = std::min<std::size_t>(random() % 700, clip.samples.size() - at);
      live.push(std::span(clip.samples).subspan(at, count), made);
      at += count;
    }
    ASSERT_LE(made.size(), whole.size());
    EXPECT_GE(made.size() + 60, whole.size()) << from << ": the last wait for what follows";
    EXPECT_TRUE(std::equal(made.begin(), made.end(), whole.begin())) << from;
  }
}

}  // namespace
}  // namespace mouthpiece
