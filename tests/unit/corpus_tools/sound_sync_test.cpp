// One sound found in another that another microphone heard, and a clap in a sound.
#include "corpus_tools/takes/sound_sync.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>

#include "base/files.h"
#include "base/index.h"
#include "corpus_tools/takes/lip_sync.h"
#include "support/error_of.h"
#include "support/run_program.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr int kSoundRateHz = 16000;

/// Noise in syllables: as loud as speech is at times.
AudioClip babble(Seconds length, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> some(0, 1);
  AudioClip clip{kSoundRateHz, {}};
  double loud = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(length * kSoundRateHz); ++i) {
    if (i % 2000 == 0) loud = some(random) < 0.3 ? 0 : some(random);
    clip.samples.push_back(asFloat(0.05 * loud * noise(random)));
  }
  return clip;
}

/// As a microphone across the room hears it: the walls' answer over a fifth of a second, no bass, and noise of its own.
AudioClip acrossTheRoom(const AudioClip& near, double noise_level, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  std::vector<std::pair<std::size_t, double>> echoes{{0, 1.0}};
  std::uniform_int_distribution<std::size_t> when(40, 3200);
  for (int i = 0; i < 60; ++i) {
    const std::size_t delay = when(random);
    echoes.emplace_back(delay, 0.4 * noise(random) * std::exp(-asReal(delay) / 1000));
  }
  AudioClip far{near.sample_rate_hz, std::vector<float>(near.samples.size(), 0.0F)};
  for (const auto& [delay, strength] : echoes) {
    for (std::size_t i = delay + 1; i < far.samples.size(); ++i)
      far.samples[i] += asFloat(strength * (near.samples[i - delay] - 0.9 * near.samples[i - delay - 1]));
  }
  for (float& sample : far.samples) sample += asFloat(noise_level * noise(random));
  return far;
}

AudioClip part(const AudioClip& clip, Seconds from, Seconds to) {
  const auto sample = [&](Seconds time) { return clip.samples.begin() + std::lround(time * clip.sample_rate_hz); };
  return {clip.sample_rate_hz, {sample(from), sample(to)}};
}

TEST(SoundSync, FindsASoundInWhatARecorderHeard) {
  const AudioClip whole = babble(40, 1), recorder = acrossTheRoom(whole, 0.002, 2);
  for (const Seconds begin : {0.0, 3.21, 17.77, 36.0}) {
    const SoundPlace place = placeOfSameSound(part(whole, begin, begin + 4), recorder);
    EXPECT_NEAR(place.late, -begin, 0.002);
    EXPECT_TRUE(place.is_sure) << place.likeness << " " << place.likeness_apart;
  }
  // The recorder was switched on later, and off before the end.
  const SoundPlace late = placeOfSameSound(part(whole, 5, 15), part(recorder, 7, 13));
  EXPECT_NEAR(late.late, 2, 0.002);
  EXPECT_TRUE(late.is_sure);
}

TEST(SoundSync, IsNotSureOfAnotherSound) {
  EXPECT_FALSE(placeOfSameSound(babble(4, 3), acrossTheRoom(babble(40, 1), 0.002, 2)).is_sure);
  EXPECT_FALSE(placeOfSameSound({kSoundRateHz, std::vector<float>(32000, 0.0F)}, babble(10, 1)).is_sure);
  EXPECT_NE(errorOf([] { placeOfSameSound(babble(0.3, 1), babble(10, 1)); }).find("0.30 s"), std::string::npos);
}

/// Sounds of a real speaker, end to end.
AudioClip speech(std::size_t first, std::size_t count) {
  const fs::path takes = fs::path(MOUTHPIECE_SOURCE_DIR) / "../shared/capture/grid_s1/takes";
  AudioClip all{kSoundRateHz, {}};
  if (!fs::exists(takes)) return all;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(takes)) {
    if (entry.path().extension() == ".wav") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  for (std::size_t i = first; i < std::min(first + count, files.size()); ++i) {
    const AudioClip one = readAudio(files[i], {.most = 60});
    all.samples.insert(all.samples.end(), one.samples.begin(), one.samples.end());
  }
  return all;
}

TEST(SoundSync, FindsARealSpeakersTakes) {
  constexpr std::size_t kTakes = 9;
  const AudioClip whole = speech(100, kTakes);
  if (whole.samples.empty()) GTEST_SKIP() << "no takes in ../shared";
  const AudioClip recorder = acrossTheRoom(whole, 0.003, 4);
  Seconds worst = 0;
  for (std::size_t i = 0; i < kTakes; ++i) {
    const Seconds begin = 2.9 * asReal(i) + 0.1234;
    const SoundPlace place = placeOfSameSound(part(whole, begin, begin + 2.5), recorder);
    EXPECT_TRUE(place.is_sure) << i << ": " << place.likeness << " " << place.likeness_apart;
    worst = std::max(worst, std::abs(place.late + begin));
    if (i % 3 == 0) {
      EXPECT_FALSE(placeOfSameSound(part(speech(200 + i, 1), 0.1, 2.6), recorder).is_sure) << i;
    }
  }
  EXPECT_LT(worst, 0.001);  // 0.15 ms
}

/// A recorder whose clock runs apart, across a room, that was switched on before or after.
TEST(SoundSync, TellsHowClocksDrift) {
  AudioClip whole = speech(0, 60);
  if (whole.samples.empty()) whole = babble(180, 7);
  for (const auto& [drift, begin] : {std::pair{50e-6, 12.3}, {-200e-6, 3.0}, {0.0, 20.0}}) {
    const AudioClip recorder = stretchAudio(acrossTheRoom(whole, 0.003, 4), 1 / (1 + drift));
    const SoundPlace place = placeOfSameSound(part(whole, begin, whole.duration() - 1), recorder);
    EXPECT_TRUE(place.is_sure) << drift;
    ASSERT_TRUE(place.drift) << drift;
    EXPECT_NEAR(*place.drift, drift, 1e-6);
    EXPECT_NEAR(place.late, -begin, 0.0005) << drift;
    // Stretched it lies beside the other to the end.
    const AudioClip beside = soundBeside(150, recorder, place.late, *place.drift);
    const SoundPlace at_the_end = placeOfSameSound(part(whole, begin + 130, begin + 140), part(beside, 125, 145));
    EXPECT_NEAR(at_the_end.late, -5, 0.0005) << drift;
  }
  EXPECT_FALSE(placeOfSameSound(part(whole, 10, 40), acrossTheRoom(whole, 0.003, 4)).drift);  // too short to tell
}

/// A burst of noise that is there at once and fades.
void addClap(AudioClip& clip, Seconds time, double height, Seconds fade, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise;
  const auto first = static_cast<std::size_t>(std::lround(time * clip.sample_rate_hz));
  for (std::size_t i = first; i < clip.samples.size(); ++i) {
    const Seconds since = asReal(i - first) / clip.sample_rate_hz;
    clip.samples[i] += asFloat(height * std::min(1.0, since / 0.001) * std::exp(-since / fade) * noise(random));
  }
}

TEST(SoundSync, FindsTheClapBesideSpeech) {
  AudioClip whole = speech(100, 6);
  if (whole.samples.empty()) whole = babble(18, 5);
  const double peak = double{*std::max_element(whole.samples.begin(), whole.samples.end())};
  EXPECT_FALSE(clapIn(whole));
  Seconds worst = 0;
  for (const double height : {0.5, 1.0}) {
    for (const Seconds time : {0.8, 3.05, 7.3, 12.02}) {
      AudioClip clapped = whole;
      addClap(clapped, time, height * peak, 0.008, static_cast<unsigned>(1000 * time));
      const auto clap = clapIn(acrossTheRoom(clapped, 0.001, 6));
      ASSERT_TRUE(clap) << height << " " << time;
      worst = std::max(worst, std::abs(*clap - time));
    }
  }
  EXPECT_LT(worst, 0.003);  // 1 ms
}

TEST(SoundSync, DoesNotChooseBetweenTwoClaps) {
  AudioClip twice{kSoundRateHz, std::vector<float>(5 * kSoundRateHz, 0.0F)};
  for (const Seconds time : {1.0, 3.0}) addClap(twice, time, 0.5, 0.01, 1);
  EXPECT_FALSE(clapIn(twice));
  EXPECT_NEAR(clapIn(part(twice, 0, 2)).value_or(0), 1, 0.002);
  EXPECT_FALSE(clapIn({kSoundRateHz, std::vector<float>(kSoundRateHz, 0.0F)}));
  EXPECT_FALSE(clapIn({kSoundRateHz, {}}));
}

}  // namespace
}  // namespace mouthpiece
