#include "corpus_tools/research/evaluation/noises.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr int kRateHz = 16000;
constexpr double kTurn = 2 * std::numbers::pi;

using Random = std::mt19937_64;
using Samples = std::vector<double>;

/// In (-1, 1), the same with any standard library.
double symmetric(Random& random) { return 2 * (static_cast<double>(random() >> 11U) / 9007199254740992.0) - 1; }

double meanSquare(const Samples& samples) {
  double sum = 0;
  for (const double sample : samples) sum += sample * sample;
  return sum / std::max(1.0, asReal(samples.size()));
}

/// Of the louder half of its hundredths of a second.
double speechPower(const AudioClip& clip) {
  constexpr std::size_t kFrame = kRateHz / 100;
  Samples powers;
  for (std::size_t first = 0; first + kFrame <= clip.samples.size(); first += kFrame) {
    double sum = 0;
    for (std::size_t i = first; i < first + kFrame; ++i) sum += double{clip.samples[i]} * double{clip.samples[i]};
    powers.push_back(sum / kFrame);
  }
  std::sort(powers.rbegin(), powers.rend());
  powers.resize((powers.size() + 1) / 2);
  double sum = 0;
  for (const double power : powers) sum += power;
  return sum / std::max(1.0, asReal(powers.size()));
}

/// White noise through `poles` poles at `corner_hz`.
Samples falling(std::size_t count, double corner_hz, int poles, Random& random) {
  const double keep = std::exp(-kTurn * corner_hz / kRateHz);
  Samples samples(count), state(unsignedIndex(poles), 0.0);
  for (double& sample : samples) {
    sample = symmetric(random);
    for (double& pole : state) sample = pole = keep * pole + (1 - keep) * sample;
  }
  return samples;
}

void add(Samples& sum, const Samples& other, double power) {
  const double scale = std::sqrt(power / std::max(meanSquare(other), 1e-20));
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += scale * other[i];
}

Samples office(std::size_t count, const std::vector<AudioClip>& voices, Random& random) {
  constexpr std::size_t kVoices = 10;
  constexpr double kVentilationHz = 200, kVentilation = 0.25;
  Samples sum(count, 0.0);
  for (std::size_t voice = 0; voice < kVoices && !voices.empty(); ++voice) {
    const AudioClip& clip = voices[random() % voices.size()];
    if (clip.samples.empty()) continue;
    const std::size_t begin = random() % clip.samples.size();
    Samples said(count);
    for (std::size_t i = 0; i < count; ++i) said[i] = double{clip.samples[(begin + i) % clip.samples.size()]};
    add(sum, said, 1.0 / kVoices);
  }
  add(sum, falling(count, kVentilationHz, 1, random), kVentilation);
  return sum;
}

Samples street(std::size_t count, Random& random) {
  constexpr double kCornerHz = 150, kSwellDb = 4, kSlowestHz = 0.3, kFastestHz = 0.8;
  Samples sum = falling(count, kCornerHz, 1, random);
  const double hz = kSlowestHz + (kFastestHz - kSlowestHz) * 0.5 * (1 + symmetric(random)), phase = symmetric(random);
  for (std::size_t i = 0; i < count; ++i) {
    const double swell = kSwellDb * std::sin(kTurn * (hz * asReal(i) / kRateHz + phase));
    sum[i] *= std::pow(10.0, swell / 20);
  }
  return sum;
}

/// A tone that dies away, with overtones.
void addTone(Samples& sum, std::size_t begin, double hz, double loud, Seconds lasts) {
  constexpr int kOvertones = 6;
  const auto end = std::min(sum.size(), begin + static_cast<std::size_t>(4 * lasts * kRateHz));
  for (int overtone = 1; overtone <= kOvertones; ++overtone) {
    for (std::size_t i = begin; i < end; ++i) {
      const double time = asReal(i - begin) / kRateHz;
      sum[i] += loud / overtone * std::exp(-time / lasts) * std::sin(kTurn * overtone * hz * time);
    }
  }
}

Samples music(std::size_t count, Random& random) {
  constexpr Seconds kBeat = 0.3;
  constexpr double kRootHz = 130.8;  // C3
  constexpr std::array<int, 4> kRoots{0, 5, 7, 9};
  constexpr std::array<int, 3> kChord{0, 4, 7};
  const auto pitch = [&](int semitones) { return kRootHz * std::pow(2.0, semitones / 12.0); };
  Samples sum(count, 0.0);
  int root = 0;
  for (std::size_t beat = 0; asReal(beat) * kBeat * kRateHz < asReal(count); ++beat) {
    const auto begin = static_cast<std::size_t>(asReal(beat) * kBeat * kRateHz);
    if (beat % 4 == 0) {
      root = kRoots[random() % kRoots.size()];
      for (const int third : kChord) addTone(sum, begin, pitch(root + third), 0.3, 0.6);
    }
    addTone(sum, begin, pitch(12 + root + kChord[random() % kChord.size()]), 0.4, 0.2);
    Samples drum(count, 0.0);
    const double decay = beat % 2 == 0 ? 0.06 : 0.02;
    for (std::size_t i = begin; i < count; ++i)
      drum[i] = 0.5 * std::exp(-asReal(i - begin) / kRateHz / decay) * symmetric(random);
    for (std::size_t i = begin; i < count; ++i) sum[i] += drum[i];
  }
  return sum;
}

AudioClip heardAt16k(const AudioClip& clip) {
  return clip.sample_rate_hz == kRateHz ? clip : resampleAudio(clip, kRateHz);
}

}  // namespace

std::string_view noiseName(Noise noise) {
  return noise == Noise::kOffice ? "office" : noise == Noise::kStreet ? "street" : "music";
}

AudioClip inNoise(const AudioClip& speech, Noise noise, double snr_db, const std::vector<AudioClip>& voices,
                  std::uint64_t seed) {
  AudioClip clip = heardAt16k(speech);
  const std::size_t count = clip.samples.size();
  Random random(seed);
  const Samples made = noise == Noise::kOffice   ? office(count, voices, random)
                       : noise == Noise::kStreet ? street(count, random)
                                                 : music(count, random);
  Samples scaled(count, 0.0);
  add(scaled, made, speechPower(clip) * std::pow(10.0, -snr_db / 10));
  for (std::size_t i = 0; i < count; ++i) clip.samples[i] += static_cast<float>(scaled[i]);
  return clip;
}

AudioClip inRoom(const AudioClip& speech, Seconds reverberation, std::uint64_t seed) {
  constexpr Seconds kFirstEcho = 0.002;
  const double e_fold = reverberation / (3 * std::numbers::ln10);  // 60 dB are three decades of the amplitude
  AudioClip clip = heardAt16k(speech);
  Random random(seed);
  std::vector<float> echoes(static_cast<std::size_t>(reverberation * kRateHz));
  double power = 0;
  for (std::size_t i = static_cast<std::size_t>(kFirstEcho * kRateHz); i < echoes.size(); ++i) {
    echoes[i] = static_cast<float>(std::exp(-asReal(i) / kRateHz / e_fold) * symmetric(random));
    power += double{echoes[i]} * double{echoes[i]};
  }
  const auto scale = static_cast<float>(1 / std::sqrt(std::max(power, 1e-20)));
  std::vector<float> heard = clip.samples;
  for (std::size_t tap = 0; tap < echoes.size(); ++tap) {
    const float weight = scale * echoes[tap];
    for (std::size_t i = tap; i < heard.size(); ++i) heard[i] += weight * clip.samples[i - tap];
  }
  clip.samples = std::move(heard);
  return clip;
}

}  // namespace mouthpiece
