#include "corpus_tools/takes/lip_sync.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

constexpr double kRateHz = 100;
constexpr Eigen::Index kSlow = 25;  ///< half a Hann window of a half second, in samples
constexpr Eigen::Index kWidest = 6000, kApart = 30;
constexpr Seconds kLeast = 5;
/// docs/formats/arkit.md tells what it was chosen on.
constexpr double kSure = 0.08;

/// Less its own running mean.
Eigen::VectorXd withoutSlow(const Eigen::VectorXd& values) {
  Eigen::VectorXd window(2 * kSlow + 1);
  for (Eigen::Index i = 0; i < window.size(); ++i)
    window(i) = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * asReal(i + 1) / asReal(window.size() + 1));
  window /= window.sum();
  const Eigen::Index count = values.size();
  Eigen::VectorXd padded(count + 2 * kSlow);
  padded << Eigen::VectorXd::Constant(kSlow, values(0)), values, Eigen::VectorXd::Constant(kSlow, values(count - 1));
  Eigen::VectorXd fast(count);
  for (Eigen::Index i = 0; i < count; ++i) fast(i) = values(i) - window.dot(padded.segment(i, window.size()));
  return fast;
}

/// At kRateHz; where the lips were not seen they stay as they were.
Eigen::VectorXd openingOver(const MotionClip& motion, const LipGauge& lips) {
  std::vector<double> seen = lips.overFrames(&LipGauge::opening, motion.positions_mm);
  const auto first = std::find_if(seen.begin(), seen.end(), [](double value) { return std::isfinite(value); });
  double last = first == seen.end() ? 0 : *first;
  for (double& value : seen) last = value = std::isfinite(value) ? value : last;
  Eigen::VectorXd opening(signedIndex(static_cast<std::size_t>(motion.duration() * kRateHz)));
  for (Eigen::Index i = 0; i < opening.size(); ++i) {
    const double at = std::min(asReal(i) / kRateHz * motion.frame_rate_hz, asReal(seen.size() - 1));
    const auto before = std::min(static_cast<std::size_t>(at), seen.size() - 2);
    opening(i) = std::lerp(seen[before], seen[before + 1], at - asReal(before));
  }
  return opening;
}

/// At kRateHz, dB over 40 ms; of the sound's differences, so that rumble does not count.
Eigen::VectorXd loudnessOver(const AudioClip& sound) {
  constexpr Seconds kHalf = 0.020;
  constexpr double kSilence = 1e-7;
  const std::vector<float>& samples = sound.samples;
  std::vector<double> sums(samples.size() + 1, 0.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double step = double{samples[i]} - (i > 0 ? double{samples[i - 1]} : 0.0);
    sums[i + 1] = sums[i] + step * step;
  }
  Eigen::VectorXd loudness(signedIndex(static_cast<std::size_t>(sound.duration() * kRateHz)));
  for (Eigen::Index i = 0; i < loudness.size(); ++i) {
    const auto sample = [&](Seconds time) {
      return static_cast<std::size_t>(std::clamp(time * sound.sample_rate_hz, 0.0, asReal(samples.size())));
    };
    const std::size_t from = sample(asReal(i) / kRateHz - kHalf), to = sample(asReal(i) / kRateHz + kHalf);
    const double power = to > from ? (sums[to] - sums[from]) / asReal(to - from) : 0.0;
    loudness(i) = 10 * std::log10(power + kSilence);
  }
  return loudness;
}

double correlation(const Eigen::Ref<const Eigen::VectorXd>& a, const Eigen::Ref<const Eigen::VectorXd>& b) {
  const double count = asReal(a.size()), mean_a = a.mean(), mean_b = b.mean();
  const double spread_a = a.squaredNorm() / count - mean_a * mean_a;
  const double spread_b = b.squaredNorm() / count - mean_b * mean_b;
  if (!(spread_a > 1e-12 && spread_b > 1e-12)) return 0;
  return (a.dot(b) / count - mean_a * mean_b) / std::sqrt(spread_a * spread_b);
}

void expectLong(Seconds length, std::string_view what) {
  if (length < kLeast)
    throw InputError(fmt::format("{:.1f} s of {} are too few to lay sound beside motion by the lips; expected {:.0f} s",
                                 length, what, kLeast));
}

}  // namespace

SoundPlace placeOfSound(const MotionClip& motion, const AudioClip& sound, const LipGauge& lips) {
  if (!lips.hasLips()) throw InputError("the markers have no middles of both lips; expected them to lay sound beside");
  expectLong(motion.duration(), "motion");
  expectLong(sound.duration(), "sound");
  const Eigen::VectorXd opening = withoutSlow(openingOver(motion, lips)), loudness = withoutSlow(loudnessOver(sound));
  const Eigen::Index shorter = std::min(opening.size(), loudness.size());
  std::vector<double> likeness;  // by how late the sound is, from -kWidest
  for (Eigen::Index late = -kWidest; late <= kWidest; ++late) {
    const Eigen::Index first = std::max<Eigen::Index>(0, late);
    const Eigen::Index count = std::min(opening.size(), loudness.size() + late) - first;
    // What few samples say weighs less.
    likeness.push_back(2 * count < shorter
                           ? -1
                           : correlation(opening.segment(first, count), loudness.segment(first - late, count)) *
                                 std::sqrt(asReal(count) / asReal(shorter)));
  }
  const auto best = std::max_element(likeness.begin(), likeness.end());
  SoundPlace place{asReal((best - likeness.begin()) - kWidest) / kRateHz, *best, -1, false};
  for (auto other = likeness.begin(); other != likeness.end(); ++other) {
    if (std::abs(other - best) >= kApart) place.likeness_apart = std::max(place.likeness_apart, *other);
  }
  place.is_sure = place.likeness - place.likeness_apart > kSure;
  return place;
}

AudioClip soundBeside(Seconds duration, const AudioClip& sound, Seconds late, double drift) {
  if (drift != 0) {
    // Only what lies beside the motion is stretched, with a little around it.
    constexpr Seconds kAround = 0.1;
    const auto sampleAt = [&](Seconds time) {
      const double place = (time - late) / (1 + drift) * sound.sample_rate_hz;
      return static_cast<std::ptrdiff_t>(std::clamp(place, 0.0, asReal(sound.samples.size())));
    };
    const auto first = sampleAt(-kAround), end = sampleAt(duration + kAround);
    const AudioClip part{sound.sample_rate_hz, {sound.samples.begin() + first, sound.samples.begin() + end}};
    return soundBeside(duration, stretchAudio(part, 1 + drift),
                       late + (1 + drift) * asReal(first) / sound.sample_rate_hz);
  }
  const auto count = static_cast<std::size_t>(std::lround(duration * sound.sample_rate_hz));
  const auto shift = std::lround(late * sound.sample_rate_hz);
  AudioClip beside{sound.sample_rate_hz, std::vector<float>(count, 0.0F)};
  for (std::size_t i = 0; i < count; ++i) {
    const auto from = signedIndex(i) - shift;
    if (from >= 0 && from < std::ssize(sound.samples)) beside.samples[i] = sound.samples[unsignedIndex(from)];
  }
  return beside;
}

}  // namespace mouthpiece
