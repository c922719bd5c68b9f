#include "hearing/tags/pitch_contour.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace mouthpiece {
namespace {

std::vector<double> sungTone(double rate_hz, double depth_semitones, double seconds) {
  std::vector<double> pitch;
  for (double t = 0; t < seconds; t += 0.01) {
    pitch.push_back(220 * std::exp2(depth_semitones / 12 * std::sin(2 * std::numbers::pi * rate_hz * t)));
  }
  return pitch;
}

TEST(VibratoFinder, FindsRateAndDepth) {
  for (const double rate : {5.3, 6.0, 7.0, 7.7}) {
    const auto runs = findVibrato(sungTone(rate, 0.5, 1.5));
    ASSERT_EQ(runs.size(), 1U) << rate;
    EXPECT_NEAR(runs[0].rate_hz, rate, 0.1);
    EXPECT_NEAR(runs[0].depth_semitones, 0.5, 0.06);
    EXPECT_GT(runs[0].last - runs[0].first, 110U);
  }
}

/// One period of 0.21 s in the middle of quicker ones: a person's vibrato, and no two.
TEST(VibratoFinder, OneSlowPeriodDoesNotPartIt) {
  std::vector<double> pitch(20, 220.0);
  double sign = 1;
  for (const double half : {0.08, 0.085, 0.085, 0.09, 0.105, 0.105, 0.09, 0.085, 0.08, 0.08}) {
    const auto samples = static_cast<int>(std::lround(100 * half));
    for (int i = 0; i < samples; ++i)
      pitch.push_back(220 * std::exp2(0.5 / 12 * sign * std::sin(std::numbers::pi * i / samples)));
    sign = -sign;
  }
  const std::size_t end = pitch.size();
  pitch.insert(pitch.end(), 20, 220.0);
  const auto runs = findVibrato(pitch);
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_NEAR(static_cast<double>(runs[0].first), 20, 3) << "from where it begins to swing";
  EXPECT_NEAR(static_cast<double>(runs[0].last), static_cast<double>(end), 3);
}

TEST(VibratoFinder, PeriodsOutsideAFifthToAnEighthOfASecondAreNone) {
  EXPECT_TRUE(findVibrato(sungTone(4.3, 0.5, 2)).empty());
  EXPECT_TRUE(findVibrato(sungTone(9.2, 0.5, 2)).empty());
}

TEST(VibratoFinder, OnePeriodIsNotEnough) { EXPECT_TRUE(findVibrato(sungTone(6, 0.5, 0.22)).empty()); }

TEST(VibratoFinder, MoreThanASemitoneIsNone) {
  EXPECT_TRUE(findVibrato(sungTone(6, 1.8, 1.5)).empty());   // standard deviation 1.27 semitones
  EXPECT_FALSE(findVibrato(sungTone(6, 1.2, 1.5)).empty());  // 0.85
}

TEST(VibratoFinder, TrackersNoiseIsNone) {
  std::mt19937 random(7);
  std::normal_distribution<double> cents(0, 4);
  std::vector<double> pitch;
  for (int i = 0; i < 300; ++i) pitch.push_back(220 * std::exp2(cents(random) / 1200));
  EXPECT_TRUE(findVibrato(pitch).empty());
}

TEST(VibratoFinder, TheWaveringOfAStraightToneIsNone) {
  EXPECT_TRUE(findVibrato(sungTone(6, 0.15, 1.5)).empty());
  EXPECT_FALSE(findVibrato(sungTone(6, 0.25, 1.5)).empty());
}

TEST(VibratoFinder, UnevenSwingsAreNoneWhereThatIsAsked) {
  // A tone that wavers, with one bend, as B makes between vowels.
  std::vector<double> pitch = sungTone(6.6, 0.12, 0.62);
  for (std::size_t i = 0; i < pitch.size(); ++i)
    pitch[i] *= std::exp2(-1.3 / 12 * std::exp(-std::pow((0.01 * static_cast<double>(i) - 0.417) / 0.02, 2)));
  EXPECT_FALSE(findVibrato(pitch).empty());
  EXPECT_TRUE(findVibrato(pitch, {.most_swing_ratio = 2}).empty());
  EXPECT_EQ(findVibrato(sungTone(6, 0.5, 1.5), {.most_swing_ratio = 2}).size(), 1U);
}

TEST(VibratoFinder, StandsFewSamples) {
  EXPECT_TRUE(findVibrato({}).empty());
  EXPECT_TRUE(findVibrato(std::vector<double>(3, 200.0)).empty());
}

}  // namespace
}  // namespace mouthpiece
