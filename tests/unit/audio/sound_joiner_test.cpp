#include "audio/sound_joiner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace mouthpiece {
namespace {

constexpr int kJoinedRateHz = 16000;

/// A buzz like a voice's: a few harmonics of a pitch that may change, `level` high.
AudioClip buzz(Seconds duration, const std::function<double(Seconds)>& hz, double level = 0.1) {
  AudioClip clip{kJoinedRateHz, {}};
  double phase = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(duration * kJoinedRateHz); ++i) {
    phase += 2 * std::numbers::pi * hz(static_cast<double>(i) / kJoinedRateHz) / kJoinedRateHz;
    double sample = 0;
    for (int harmonic = 1; harmonic <= 8; ++harmonic) sample += std::cos(harmonic * phase) / harmonic;
    clip.samples.push_back(static_cast<float>(level * sample));
  }
  return clip;
}

AudioClip hiss(Seconds duration, double level) {
  AudioClip clip{kJoinedRateHz, {}};
  std::mt19937 random(7);
  std::normal_distribution<float> normal(0, static_cast<float>(level));
  for (std::size_t i = 0; i < static_cast<std::size_t>(duration * kJoinedRateHz); ++i)
    clip.samples.push_back(normal(random));
  return clip;
}

double rms(const AudioClip& clip, Seconds from, Seconds to) {
  double energy = 0;
  const auto begin = static_cast<std::size_t>(from * kJoinedRateHz), end = static_cast<std::size_t>(to * kJoinedRateHz);
  for (std::size_t i = begin; i < end; ++i) energy += static_cast<double>(clip.samples[i]) * clip.samples[i];
  return std::sqrt(energy / static_cast<double>(end - begin));
}

TEST(PitchTrack, FollowsVibratoToWithinTenCents) {
  const auto hz = [](Seconds time) {
    return 220 * std::pow(2, 0.5 / 12 * std::sin(2 * std::numbers::pi * 5.5 * time));
  };
  const PitchTrack pitch = trackPitch(buzz(1.0, hz));
  for (Seconds time = 0.1; time < 0.9; time += 0.01) {
    ASSERT_GT(pitch.hzAt(time), 0) << time;
    EXPECT_NEAR(1200 * std::log2(pitch.hzAt(time) / hz(time)), 0, 10) << "cents at " << time;
  }
}

TEST(PitchTrack, HissAndSilenceHaveNone) {
  for (const AudioClip& clip : {hiss(0.5, 0.1), AudioClip{kJoinedRateHz, std::vector<float>(8000, 0.0F)}}) {
    const PitchTrack pitch = trackPitch(clip);
    std::size_t voiced = 0;
    for (const PitchFrame& frame : pitch.frames) voiced += frame.hz > 0 ? 1 : 0;
    EXPECT_LT(voiced, pitch.frames.size() / 20);
  }
}

TEST(PitchMarks, OneAPeriodAtTheSamePlaceOfEach) {
  const AudioClip clip = buzz(0.5, [](Seconds) { return 160.0; });
  const PitchMarks marks = findPitchMarks(clip, trackPitch(clip));
  std::size_t voiced = 0;
  for (std::size_t i = 1; i < marks.marks.size(); ++i) {
    ASSERT_LT(marks.marks[i - 1].sample, marks.marks[i].sample);
    if (!marks.marks[i - 1].voiced || !marks.marks[i].voiced) continue;
    ++voiced;
    EXPECT_NEAR(static_cast<double>(marks.marks[i].sample - marks.marks[i - 1].sample), 100, 2);
  }
  EXPECT_GT(voiced, 60U);
  EXPECT_EQ(marks.marks.front().sample, 0U);
  EXPECT_EQ(marks.marks.back().sample, clip.samples.size());
}

TEST(SoundJoiner, OnePieceIsTheRecordingItself) {
  const MarkedSound sound = markSound(buzz(0.6, [](Seconds time) { return 120 + 60 * time; }));
  const AudioClip joined = joinSounds({{&sound, {0, 0.6}, {0, 0.6}}}, kJoinedRateHz);
  ASSERT_EQ(joined.samples.size(), sound.clip.samples.size());
  for (std::size_t i = 400; i + 400 < joined.samples.size(); ++i) {
    ASSERT_NEAR(joined.samples[i], sound.clip.samples[i], 1e-5) << i;
  }
}

TEST(SoundJoiner, PitchAndLevelMeetAtTheJoin) {
  const MarkedSound low = markSound(buzz(
      0.8, [](Seconds) { return 120.0; }, 0.06));
  const MarkedSound high = markSound(buzz(
      0.8, [](Seconds) { return 150.0; }, 0.11));
  const AudioClip joined = joinSounds({{&low, {0, 0.5}, {0, 0.5}}, {&high, {0.3, 0.8}, {0.5, 1.0}}}, kJoinedRateHz);
  const PitchTrack pitch = trackPitch(joined);
  EXPECT_NEAR(pitch.hzAt(0.2), 120, 1) << "far from the join it is the recording's own";
  EXPECT_NEAR(pitch.hzAt(0.8), 150, 1);
  EXPECT_NEAR(pitch.hzAt(0.5), std::sqrt(120.0 * 150.0), 4) << "they meet half-way";
  for (Seconds time = 0.3; time < 0.7; time += 0.01) {
    ASSERT_GT(pitch.hzAt(time), 0) << time;
    EXPECT_LT(std::abs(std::log2(pitch.hzAt(time + 0.01) / pitch.hzAt(time))), 0.05) << "no jump at " << time;
  }
  const double before = rms(joined, 0.46, 0.49), after = rms(joined, 0.51, 0.54);
  EXPECT_LT(std::abs(20 * std::log10(after / before)), 1.5) << "dB";
  EXPECT_NEAR(20 * std::log10(rms(joined, 0.8, 0.9) / rms(joined, 0.1, 0.2)), 20 * std::log10(0.11 / 0.06), 0.5);
}

/// Sample by sample nothing at the join is steeper than in the recordings.
TEST(SoundJoiner, JoinsDoNotClick) {
  const MarkedSound a = markSound(buzz(0.5, [](Seconds) { return 130.0; }));
  const MarkedSound b = markSound(buzz(0.5, [](Seconds) { return 131.0; }));
  float steepest = 0;
  for (std::size_t i = 801; i < 7200; ++i) {
    steepest = std::max(steepest, std::abs(a.clip.samples[i] - a.clip.samples[i - 1]));
  }
  for (Seconds cut = 0.2; cut < 0.21; cut += 0.0007) {  // at every phase of the period
    const AudioClip joined =
        joinSounds({{&a, {0, cut}, {0, cut}}, {&b, {0.25, 0.5}, {cut, cut + 0.25}}}, kJoinedRateHz);
    const auto end = static_cast<std::size_t>((cut + 0.05) * kJoinedRateHz);
    for (auto i = static_cast<std::size_t>((cut - 0.05) * kJoinedRateHz); i < end; ++i) {
      ASSERT_LT(std::abs(joined.samples[i] - joined.samples[i - 1]), 1.3F * steepest) << cut << " at " << i;
    }
  }
}

TEST(SoundJoiner, SlowerKeepsThePitch) {
  const MarkedSound sound = markSound(buzz(0.6, [](Seconds) { return 140.0; }));
  const AudioClip slow = joinSounds({{&sound, {0, 0.6}, {0, 0.9}}}, kJoinedRateHz);
  EXPECT_NEAR(slow.duration(), 0.9, 1e-3);
  EXPECT_NEAR(trackPitch(slow).hzAt(0.45), 140, 2);
}

TEST(SoundJoiner, NothingMakesNothing) { EXPECT_TRUE(joinSounds({}, kJoinedRateHz).samples.empty()); }

}  // namespace
}  // namespace mouthpiece
