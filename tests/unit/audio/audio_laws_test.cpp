// What holds for resampling, spectra, pitch and joining whatever the sound.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "audio/pitch_track.h"
#include "audio/sound_joiner.h"
#include "audio/spectral_frames.h"
#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr int kRateHz = 16000;

/// Noise without much above 3 kHz, quieter at its ends.
AudioClip murmur(unsigned seed, Seconds duration, int rate_hz = kRateHz) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.1);
  AudioClip clip{rate_hz, {}};
  const auto count = static_cast<std::size_t>(duration * rate_hz);
  const double keep = std::exp(-2 * std::numbers::pi * 800 / rate_hz);
  double once = 0, twice = 0, thrice = 0;
  for (std::size_t i = 0; i < count; ++i) {
    once += (1 - keep) * (noise(random) - once);
    twice += (1 - keep) * (once - twice);
    thrice += (1 - keep) * (twice - thrice);
    const double place = static_cast<double>(i) / static_cast<double>(count);
    clip.samples.push_back(static_cast<float>(4 * thrice * std::sin(std::numbers::pi * place)));
  }
  return clip;
}

/// Harmonics that fall off as a voice's do.
AudioClip voice(double hz, Seconds duration, double level = 0.05, int rate_hz = kRateHz) {
  AudioClip clip{rate_hz, {}};
  for (std::size_t i = 0; i < static_cast<std::size_t>(duration * rate_hz); ++i) {
    const double phase = 2 * std::numbers::pi * hz * static_cast<double>(i) / rate_hz;
    double sample = 0;
    for (int h = 1; h * hz < 0.45 * rate_hz && h <= 12; ++h) sample += std::sin(h * phase + 0.3 * h * h) / h;
    clip.samples.push_back(static_cast<float>(level * sample));
  }
  return clip;
}

AudioClip scaled(AudioClip clip, float factor) {
  for (float& sample : clip.samples) sample *= factor;
  return clip;
}

AudioClip sumOf(AudioClip a, const AudioClip& b) {
  for (std::size_t i = 0; i < a.samples.size(); ++i) a.samples[i] += b.samples[i];
  return a;
}

double largestDifference(const AudioClip& a, const AudioClip& b) {
  EXPECT_EQ(a.samples.size(), b.samples.size());
  double largest = 0;
  for (std::size_t i = 0; i < std::min(a.samples.size(), b.samples.size()); ++i)
    largest = std::max<double>(largest, std::abs(a.samples[i] - b.samples[i]));
  return largest;
}

double meanSquare(const AudioClip& clip) {
  double sum = 0;
  for (const float sample : clip.samples) sum += static_cast<double>(sample) * sample;
  return sum / static_cast<double>(clip.samples.size());
}

constexpr std::pair<int, int> kRates[] = {
    {16000, 48000}, {44100, 16000}, {32000, 16000}, {16000, 22050}, {8000, 11025}};

TEST(ResampleLaws, IsLinear) {
  for (const auto& [from, to] : kRates) {
    const AudioClip a = murmur(1, 0.2, from), b = murmur(2, 0.2, from);
    const AudioClip of_sum = resampleAudio(sumOf(a, scaled(b, 0.5F)), to);
    const AudioClip sum_of = sumOf(resampleAudio(a, to), scaled(resampleAudio(b, to), 0.5F));
    EXPECT_LT(largestDifference(of_sum, sum_of), 1e-6) << from << " to " << to;
  }
}

TEST(ResampleLaws, LengthIsTheSameTime) {
  for (const auto& [from, to] : kRates) {
    for (const std::size_t count : {1U, 2U, 159U, 160U, 4410U, 44099U}) {
      const AudioClip clip = resampleAudio({from, std::vector<float>(count, 0.1F)}, to);
      EXPECT_EQ(clip.samples.size(), (count * static_cast<std::size_t>(to) + static_cast<std::size_t>(from) - 1) /
                                         static_cast<std::size_t>(from));
      for (const float sample : clip.samples) ASSERT_TRUE(std::isfinite(sample));
    }
    EXPECT_TRUE(resampleAudio({from, {}}, to).samples.empty());
  }
}

TEST(ResampleLaws, ThereAndBackIsTheSameSound) {
  for (const int rate : {22050, 32000, 44100, 48000}) {
    const AudioClip sound = resampleAudio(murmur(5, 0.4, 12000), kRateHz);  // nothing above 6 kHz
    AudioClip back = resampleAudio(resampleAudio(sound, rate), kRateHz);
    back.samples.resize(sound.samples.size());
    EXPECT_LT(largestDifference(back, sound), 2e-5) << rate << " Hz: 80 dB under the sound";
  }
}

TEST(ResampleLaws, KeepsTimeAndEnergy) {
  for (const auto& [from, to] : kRates) {
    AudioClip clip{from, std::vector<float>(static_cast<std::size_t>(from / 2), 0.0F)};
    // A bump of 20 ms at 0.2 s.
    for (std::size_t i = 0; i < clip.samples.size(); ++i) {
      const double away = (static_cast<double>(i) / from - 0.2) / 0.005;
      clip.samples[i] = static_cast<float>(0.5 * std::exp(-0.5 * away * away));
    }
    const AudioClip other = resampleAudio(clip, to);
    const auto top = std::max_element(other.samples.begin(), other.samples.end()) - other.samples.begin();
    EXPECT_NEAR(static_cast<double>(top) / to, 0.2, 1.0 / to);
    EXPECT_NEAR(meanSquare(other) / meanSquare(clip), 1, 2e-3) << from << " to " << to;
  }
}

TEST(BandEnergy, OfAllBandsIsThatOfTheSound) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<float> noise(0, 0.1F);
    AudioClip clip{44100, {}};
    for (int i = 0; i < 44100; ++i) clip.samples.push_back(noise(random));
    double sum = 0;
    for (double low = 0; low < 22050; low += 2205) sum += bandEnergy(clip, {0, 1}, low, low + 2205);
    EXPECT_NEAR(sum / meanSquare(clip), 1, 0.03) << "Parseval, seed " << seed;
  }
}

TEST(BandEnergy, OfAToneLiesWhereTheToneDoes) {
  for (const double hz : {500.0, 3000.0, 9000.0, 15000.0}) {
    AudioClip clip{44100, {}};
    for (int i = 0; i < 44100; ++i)
      clip.samples.push_back(static_cast<float>(0.4 * std::sin(2 * std::numbers::pi * hz * i / 44100)));
    EXPECT_NEAR(bandEnergy(clip, {0, 1}, hz - 400, hz + 400), 0.08, 0.002) << "half of 0.4 squared";
    EXPECT_LT(bandEnergy(clip, {0, 1}, hz + 600, 22050), 1e-5);
    EXPECT_NEAR(bandEnergy(scaled(clip, 0.5F), {0, 1}, hz - 400, hz + 400), 0.02, 0.001);
  }
}

TEST(BandEnergy, IsNoneWhereNothingSounds) {
  const AudioClip clip = murmur(1, 0.5);
  EXPECT_EQ(bandEnergy(clip, {0.7, 0.9}, 0, 8000), 0) << "after the end";
  EXPECT_EQ(bandEnergy(clip, {0.3, 0.2}, 0, 8000), 0) << "a span that is none";
  EXPECT_EQ(bandEnergy(clip, {0, 0.5}, 9000, 20000), 0) << "above half the rate";
  EXPECT_EQ(bandEnergy({kRateHz, {}}, {0, 1}, 0, 8000), 0);
}

TEST(BandLevels, FollowATone) {
  for (const int rate_hz : {16000, 44100}) {
    AudioClip clip{.sample_rate_hz = rate_hz, .samples = {}};
    for (int i = 0; i < rate_hz; ++i) {
      const double amplitude = 2 * i < rate_hz ? 0.4 : 0.04;
      clip.samples.push_back(
          static_cast<float>(amplitude * std::sin(2 * std::numbers::pi * 1000 * static_cast<double>(i) / rate_hz)));
    }
    const std::vector<double> in = bandLevelsDb(clip, 600, 4000, 0.01), out = bandLevelsDb(clip, 2000, 4000, 0.01);
    ASSERT_EQ(in.size(), 101U);
    EXPECT_NEAR(in[25], 10 * std::log10(0.08), 0.2);
    EXPECT_NEAR(in[75], 10 * std::log10(0.0008), 0.2);
    EXPECT_LT(out[25], -60);
  }
}

TEST(SpectralFrames, HaveARowEveryStepAndFollowTheLevel) {
  const AudioClip sound = murmur(3, 0.5);
  const SpectralFrames frames = spectralFrames(sound);
  EXPECT_EQ(frames.mfcc.rows(), 101);
  EXPECT_EQ(frames.level_db.size(), 101);
  const SpectralFrames quiet = spectralFrames(scaled(sound, 0.1F));
  for (Eigen::Index row = 20; row < 80; ++row) {
    EXPECT_NEAR(frames.level_db(row) - quiet.level_db(row), 20, 0.1) << row;
    EXPECT_GT(frames.mfcc(row, 0), quiet.mfcc(row, 0)) << "the first follows the level";
    for (Eigen::Index k = 1; k < SpectralFrames::kCoefficients; ++k)
      EXPECT_NEAR(frames.mfcc(row, k), quiet.mfcc(row, k), 0.02) << "the others do not";
  }
  EXPECT_EQ(frames.rowAt(-1), 0);
  EXPECT_EQ(frames.rowAt(0.25), 50);
  EXPECT_EQ(frames.rowAt(9), 100);
}

TEST(SpectralFrames, AreCentredOnTheirTime) {
  AudioClip click{kRateHz, std::vector<float>(8000, 0.0F)};
  click.samples[4000] = 1;
  const SpectralFrames frames = spectralFrames(click);
  for (Eigen::Index row = 0; row < frames.level_db.size(); ++row) {
    const bool is_near = std::abs(static_cast<double>(row) * frames.step - 0.25) < 0.0159;
    EXPECT_EQ(frames.level_db(row) > -60, is_near) << row << ": 32 ms about 0.25 s";
  }
}

TEST(SpectralFrames, StandSilenceAndShortSounds) {
  for (const std::size_t count : {0U, 1U, 79U, 80U, 4000U}) {
    const SpectralFrames frames = spectralFrames({kRateHz, std::vector<float>(count, 0.0F)});
    EXPECT_EQ(frames.mfcc.rows(), static_cast<Eigen::Index>(count / 80 + 1));
    EXPECT_TRUE(frames.mfcc.allFinite());
    EXPECT_TRUE(frames.level_db.allFinite());
  }
}

TEST(PitchLaws, FindsEveryPitchOfAVoiceWithinFiveCents) {
  for (double hz = 75; hz < 430; hz *= 1.0594630943592953) {
    const PitchTrack pitch = trackPitch(voice(hz, 0.5));
    for (Seconds time = 0.1; time < 0.4; time += 0.01) {
      ASSERT_GT(pitch.hzAt(time), 0) << hz << " Hz at " << time;
      EXPECT_NEAR(1200 * std::log2(pitch.hzAt(time) / hz), 0, 5) << hz << " Hz at " << time;
    }
  }
}

TEST(PitchLaws, DoesNotDependOnLevelOrRate) {
  const PitchTrack pitch = trackPitch(voice(180, 0.4));
  const PitchTrack quiet = trackPitch(voice(180, 0.4, 0.01));
  const PitchTrack fine = trackPitch(voice(180, 0.4, 0.05, 48000));
  for (Seconds time = 0.08; time < 0.32; time += 0.01) {
    EXPECT_NEAR(quiet.hzAt(time), pitch.hzAt(time), 0.05);
    EXPECT_NEAR(fine.hzAt(time), pitch.hzAt(time), 0.3);
  }
}

TEST(PitchLaws, KeepsToItsRange) {
  const PitchOptions narrow{.lowest_hz = 150, .highest_hz = 250};
  for (const double hz : {100.0, 130.0, 300.0, 420.0}) {
    for (const PitchFrame& frame : trackPitch(voice(hz, 0.3), narrow).frames) {
      EXPECT_TRUE(frame.hz == 0 || (frame.hz >= 150 && frame.hz <= 250)) << frame.hz;
      EXPECT_GE(frame.confidence, 0);
      EXPECT_LE(frame.confidence, 1);
    }
  }
}

TEST(PitchLaws, WhatCannotBeHeardHasNone) {
  AudioClip clip = voice(200, 0.8);
  for (std::size_t i = 6400; i < clip.samples.size(); ++i) clip.samples[i] *= 1e-3F;  // 60 dB down
  const PitchTrack pitch = trackPitch(clip);
  EXPECT_GT(pitch.hzAt(0.2), 0);
  EXPECT_EQ(pitch.hzAt(0.6), 0);
}

TEST(PitchTrack, IsStraightBetweenFramesAndNoneOutside) {
  const PitchTrack track{0.01, {{100, 1}, {110, 1}, {0, 0}, {200, 1}}};
  EXPECT_DOUBLE_EQ(track.hzAt(0), 100);
  EXPECT_DOUBLE_EQ(track.hzAt(0.005), 105);
  EXPECT_EQ(track.hzAt(0.015), 0) << "beside a frame without pitch";
  EXPECT_EQ(track.hzAt(0.025), 0);
  EXPECT_DOUBLE_EQ(track.hzAt(0.03), 200);
  EXPECT_EQ(track.hzAt(0.031), 0);
  EXPECT_EQ(track.hzAt(-0.001), 0);
  EXPECT_EQ(track.hzAt(NAN), 0);
  EXPECT_EQ(PitchTrack{}.hzAt(0), 0);
}

TEST(PitchMarks, RiseFromTheBeginningToTheEndOfAnySound) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    AudioClip clip = seed % 3 == 0 ? murmur(seed, 0.3) : voice(80 + 30 * seed, 0.02 * seed + 0.001);
    if (seed % 4 == 1) clip.samples.insert(clip.samples.end(), 3000, 0.0F);
    const std::vector<PitchMarks::Mark> marks = findPitchMarks(clip, trackPitch(clip)).marks;
    ASSERT_FALSE(marks.empty());
    EXPECT_EQ(marks.front().sample, 0U);
    EXPECT_EQ(marks.back().sample, clip.samples.size()) << "seed " << seed;
    for (std::size_t i = 1; i < marks.size(); ++i) EXPECT_LT(marks[i - 1].sample, marks[i].sample) << "seed " << seed;
  }
}

TEST(PitchMarks, NearestIsNearest) {
  const PitchMarks marks{{{0, false}, {100, true}, {180, true}, {400, false}}};
  for (double sample = -50; sample < 450; sample += 0.5) {
    const std::size_t nearest = marks.nearest(sample);
    for (const PitchMarks::Mark& other : marks.marks) {
      EXPECT_LE(std::abs(static_cast<double>(marks.marks[nearest].sample) - sample),
                std::abs(static_cast<double>(other.sample) - sample));
    }
  }
}

TEST(JoinLaws, CutAnywhereAndJoinedAgainARecordingIsItself) {
  const MarkedSound sound = markSound(voice(140, 0.8));
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<Seconds> cuts{0};
    while (cuts.back() < 0.6) cuts.push_back(cuts.back() + 0.06 + 0.2 * share(random));
    cuts.back() = 0.8;
    std::vector<SoundPiece> pieces;
    for (std::size_t i = 1; i < cuts.size(); ++i)
      pieces.push_back({&sound, {cuts[i - 1], cuts[i]}, {cuts[i - 1], cuts[i]}});
    const AudioClip joined = joinSounds(pieces, kRateHz);
    ASSERT_EQ(joined.samples.size(), sound.clip.samples.size());
    for (std::size_t i = 400; i + 400 < joined.samples.size(); ++i)
      ASSERT_NEAR(joined.samples[i], sound.clip.samples[i], 0.01) << "seed " << seed << " at " << i;
  }
}

TEST(JoinLaws, LengthIsThatOfTheLineAndNothingIsOverFullScale) {
  const MarkedSound low = markSound(voice(110, 0.6)), noise = markSound(murmur(4, 0.6)),
                    loud = markSound(voice(200, 0.6, 0.6));
  for (unsigned seed = 0; seed < 15; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(0, 1);
    std::vector<SoundPiece> pieces;
    Seconds time = 0.5 + share(random);
    const Seconds start = time;
    for (std::size_t count = 1 + seed % 5; count > 0; --count) {
      const MarkedSound* sound = std::array{&low, &noise, &loud}[random() % 3];
      const Seconds from = 0.3 * share(random), length = 0.03 + 0.25 * share(random),
                    target = length * (0.5 + 1.5 * share(random));
      pieces.push_back({sound, {from, from + length}, {time, time + target}});
      time += target;
    }
    const AudioClip joined = joinSounds(pieces, kRateHz);
    EXPECT_NEAR(static_cast<double>(joined.samples.size()), (time - start) * kRateHz, 1) << "seed " << seed;
    for (const float sample : joined.samples) {
      ASSERT_TRUE(std::isfinite(sample));
      ASSERT_LE(std::abs(sample), 1);
    }
  }
}

TEST(JoinLaws, ALineIsTheSameWheneverItBegins) {
  const MarkedSound a = markSound(voice(120, 0.5)), b = markSound(voice(170, 0.5));
  const auto lineAt = [&](Seconds start) {
    return joinSounds({{&a, {0.1, 0.4}, {start, start + 0.3}}, {&b, {0.05, 0.4}, {start + 0.3, start + 0.65}}},
                      kRateHz);
  };
  EXPECT_LT(largestDifference(lineAt(0), lineAt(2)), 1e-4);
}

}  // namespace
}  // namespace mouthpiece
