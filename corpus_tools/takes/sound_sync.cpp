#include "corpus_tools/takes/sound_sync.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <span>
#include <unsupported/Eigen/FFT>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr int kSyncRateHz = 8000;
constexpr double kLowestHz = 200, kHighestHz = 3500;
constexpr Seconds kLeastSound = 0.5;
/// What is looked for, its loudest: a minute tells most; where clocks drift it smears, and less tells more.
constexpr Seconds kMostOwn = 60, kLessOwn = 8;
/// Places that near to each other are one.
constexpr Seconds kOnePlace = 0.05;
/// How much likelier the place must be than any other (docs/formats/arkit.md).
constexpr double kSureLikeness = 2;
/// Clocks are compared by windows, over a minute at least; none of them is off by more than a thousandth.
constexpr Seconds kWindow = 4, kLeastSpan = 60, kSlack = 0.01;
constexpr double kMostDrift = 1e-3, kSureDrift = 3, kMostDriftError = 1e-5;

using Spectrum = Eigen::VectorXcf;

AudioClip prepared(const AudioClip& clip, std::string_view what) {
  if (clip.duration() < kLeastSound)
    throw InputError(fmt::format("{:.2f} s of {} are too few to find one sound in another; expected {:.1f} s",
                                 clip.duration(), what, kLeastSound));
  return clip.sample_rate_hz == kSyncRateHz ? clip : resampleAudio(clip, kSyncRateHz);
}

/// Where the loudest stretch of that many samples begins.
std::size_t loudestStretch(const std::vector<float>& samples, std::size_t length) {
  if (samples.size() <= length) return 0;
  double power = 0, most = -1;
  std::size_t best = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    power += double{samples[i]} * samples[i];
    if (i >= length) power -= double{samples[i - length]} * samples[i - length];
    if (i + 1 >= length && power > most) {
      most = power;
      best = i + 1 - length;
    }
  }
  return best;
}

/// The phase transform of one block: how alike they are at each shift of `own`, at most 1.
class PhaseCorrelator {
 public:
  PhaseCorrelator(std::span<const float> own, Eigen::Index size) : size_(size) {
    own_ = spectrumOf(own);
    const double bin_hz = double{kSyncRateHz} / asReal(size);
    first_ = static_cast<Eigen::Index>(kLowestHz / bin_hz);
    last_ = static_cast<Eigen::Index>(kHighestHz / bin_hz);
  }

  Eigen::VectorXf operator()(std::span<const float> block) {
    const Spectrum other = spectrumOf(block);
    Spectrum phases = Spectrum::Zero(size_);
    for (Eigen::Index i = first_; i < last_; ++i) {
      const std::complex<float> product = other(i) * std::conj(own_(i));
      const float weight = std::abs(product);
      if (!(weight > 0)) continue;
      phases(i) = product / weight;
      phases(size_ - i) = std::conj(phases(i));
    }
    Eigen::VectorXf likeness;
    fft_.inv(likeness, phases);
    return likeness * (asFloat(asReal(size_)) / asFloat(asReal(2 * (last_ - first_))));
  }

 private:
  Spectrum spectrumOf(std::span<const float> samples) {
    Eigen::VectorXf padded = Eigen::VectorXf::Zero(size_);
    std::copy(samples.begin(), samples.end(), padded.begin());
    Spectrum spectrum;
    fft_.fwd(spectrum, padded);
    return spectrum;
  }

  Eigen::Index size_, first_ = 0, last_ = 0;
  Eigen::FFT<float> fft_;
  Spectrum own_;
};

/// The place of `own`'s loudest `length` samples.
SoundPlace placeOfLoudest(const std::vector<float>& own, const std::vector<float>& other, std::size_t length) {
  const std::size_t from = loudestStretch(own, length);
  const std::span<const float> part = std::span(own).subspan(from, length);
  std::size_t size = std::size_t{1} << 16U;
  while (size < 4 * length) size *= 2;
  // Before and after the other there is silence: it may begin later and end earlier.
  std::vector<float> padded(length, 0.0F);
  padded.insert(padded.end(), other.begin(), other.end());
  padded.resize(padded.size() + length, 0.0F);
  PhaseCorrelator correlate(part, signedIndex(size));
  std::vector<float> likeness;  // by the sample of `padded` at which the part begins
  for (std::size_t first = 0; first + length <= padded.size(); first += size - length) {
    const auto count = std::min(size, padded.size() - first);
    const Eigen::VectorXf found = correlate(std::span(padded).subspan(first, count));
    const auto valid = signedIndex(std::min(size - length, padded.size() - length - first + 1));
    likeness.insert(likeness.end(), found.begin(), found.begin() + valid);
  }
  const auto best = std::max_element(likeness.begin(), likeness.end());
  const auto near = static_cast<std::ptrdiff_t>(kOnePlace * kSyncRateHz);
  SoundPlace place;
  place.likeness = *best;
  for (auto one = likeness.begin(); one != likeness.end(); ++one) {
    if (std::abs(one - best) >= near) place.likeness_apart = std::max(place.likeness_apart, double{*one});
  }
  place.late = (asReal(from + length) - asReal(best - likeness.begin())) / kSyncRateHz;
  place.is_sure = place.likeness > kSureLikeness * place.likeness_apart;
  return place;
}

/// One window of `own` found in the other.
struct Match {
  double at = 0;    ///< second of the other
  double late = 0;  ///< how much later it is in `own`
};

/// Walks from one window of `own` to the next, each found near where the last one lay. A window that is not told from
/// its neighbourhood is left out.
class ClockWalk {
 public:
  ClockWalk(std::span<const float> own, std::span<const float> other) : own_(own), other_(other) {}

  /// From sample `first` of `own` onwards, or backwards, at which the other is `late`.
  void walk(std::ptrdiff_t first, double late, bool backwards) {
    constexpr auto kLength = static_cast<std::ptrdiff_t>(kWindow * kSyncRateHz);
    Seconds unseen = 0;
    for (; first >= 0 && first + kLength <= std::ssize(own_); first += backwards ? -kLength : kLength) {
      const auto match = find(first, kLength, late, kSlack + kMostDrift * (unseen += kWindow));
      if (!match) continue;
      matches_.push_back(*match);
      late = match->late;
      unseen = 0;
    }
  }

  [[nodiscard]] const std::vector<Match>& matches() const { return matches_; }

 private:
  std::optional<Match> find(std::ptrdiff_t first, std::ptrdiff_t length, double late, Seconds reach) {
    constexpr Eigen::Index kSize = 1 << 16U;
    const auto around = static_cast<std::ptrdiff_t>((reach + 2 * kOnePlace) * kSyncRateHz);
    const auto begin = first - std::lround(late * kSyncRateHz) - around, end = begin + length + 2 * around;
    if (begin < 0 || end > std::ssize(other_) || end - begin > kSize) return std::nullopt;
    const Eigen::VectorXf likeness = PhaseCorrelator(own_.subspan(unsignedIndex(first), unsignedIndex(length)), kSize)(
        other_.subspan(unsignedIndex(begin), unsignedIndex(end - begin)));
    Eigen::Index best = 0;
    const float most = likeness.head(2 * around + 1).maxCoeff(&best);
    const auto near = static_cast<std::ptrdiff_t>(kOnePlace * kSyncRateHz);
    for (Eigen::Index i = 0; i <= 2 * around; ++i) {
      if (std::abs(i - best) >= near && kSureLikeness * likeness(i) > most) return std::nullopt;
    }
    const double middle = asReal(begin + best) + asReal(length) / 2;
    return Match{middle / kSyncRateHz, asReal(first - begin - best) / kSyncRateHz};
  }

  std::span<const float> own_, other_;
  std::vector<Match> matches_;
};

/// The line late + drift * at through most of the windows (Theil 1950, Sen 1968), and where it begins.
void addDrift(const std::vector<Match>& matches, SoundPlace& place) {
  const auto [first, last] =
      std::minmax_element(matches.begin(), matches.end(), [](const Match& a, const Match& b) { return a.at < b.at; });
  if (matches.size() < 8 || last->at - first->at < kLeastSpan) return;
  std::vector<double> slopes, lates, rests;
  double mean = 0, spread = 0;
  for (const Match& one : matches) {
    mean += one.at / asReal(matches.size());
    for (const Match& other : matches) {
      if (other.at - one.at > (last->at - first->at) / 4)
        slopes.push_back((other.late - one.late) / (other.at - one.at));
    }
  }
  if (slopes.empty()) return;
  const double slope = median(std::move(slopes));
  for (const Match& one : matches) {
    lates.push_back(one.late - slope * one.at);
    spread += (one.at - mean) * (one.at - mean);
  }
  const double late = median(lates);
  for (const double one : lates) rests.push_back(std::abs(one - late));
  // As exact as a line by least squares would be; the sounds' samples are no finer than this.
  const double noise = std::max(1.4826 * median(std::move(rests)), 0.3 / kSyncRateHz);
  const double error = noise / std::sqrt(spread);
  if (error > kMostDriftError || std::abs(slope) > kMostDrift) return;
  place.drift = std::abs(slope) > kSureDrift * error ? slope : 0;
  if (*place.drift != 0) place.late = late;
}

}  // namespace

SoundPlace placeOfSameSound(const AudioClip& own, const AudioClip& sound) {
  const AudioClip whole = prepared(own, "the device's own sound"), other = prepared(sound, "the sound");
  SoundPlace place;
  for (const Seconds most : {kMostOwn, kLessOwn}) {
    const auto length = std::min(whole.samples.size(), static_cast<std::size_t>(most * kSyncRateHz));
    const SoundPlace found = placeOfLoudest(whole.samples, other.samples, length);
    if (most == kMostOwn || found.is_sure) place = found;
    if (place.is_sure || length == whole.samples.size()) break;
  }
  if (!place.is_sure || whole.duration() < kLeastSpan) return place;
  const auto first = signedIndex(loudestStretch(whole.samples, static_cast<std::size_t>(kLessOwn * kSyncRateHz)));
  ClockWalk walk(whole.samples, other.samples);
  walk.walk(first, place.late, false);
  walk.walk(first - static_cast<std::ptrdiff_t>(kWindow * kSyncRateHz), place.late, true);
  addDrift(walk.matches(), place);
  return place;
}

std::optional<Seconds> clapIn(const AudioClip& sound) {
  constexpr Seconds kStep = 0.001, kBefore = 0.1, kRise = 0.003, kOther = 0.3;
  constexpr double kSilence = 1e-8, kMostSharpDb = 40, kSureDb = 10, kLoud = 0.5;
  const auto step = static_cast<std::size_t>(std::lround(kStep * sound.sample_rate_hz));
  if (step == 0 || sound.samples.size() < 2 * step) return std::nullopt;
  std::vector<double> power;  // a millisecond each, of the sound's differences: rumble does not count
  for (std::size_t first = 1; first + step <= sound.samples.size(); first += step) {
    double sum = 0;
    for (std::size_t i = first; i < first + step; ++i) {
      const double change = double{sound.samples[i]} - sound.samples[i - 1];
      sum += change * change;
    }
    power.push_back(sum / asReal(step));
  }
  const auto before = static_cast<std::size_t>(kBefore / kStep), rise = static_cast<std::size_t>(kRise / kStep);
  const auto decibels = [](double value) { return 10 * std::log10(value + kSilence); };
  // How far each rises over the loudest moment of the tenth of a second before it, and how loud it is.
  std::vector<double> sharpness(power.size(), decibels(0));
  for (std::size_t i = rise + 1; i < power.size(); ++i) {
    const auto first = power.begin() + signedIndex(i > before + rise ? i - before - rise : 0);
    const double earlier = *std::max_element(first, power.begin() + signedIndex(i - rise));
    sharpness[i] = std::min(kMostSharpDb, decibels(power[i]) - decibels(earlier)) + decibels(power[i]);
  }
  const auto clap = std::max_element(sharpness.begin(), sharpness.end());
  if (power[unsignedIndex(clap - sharpness.begin())] < kLoud * *std::max_element(power.begin(), power.end()))
    return std::nullopt;  // a plosive in quiet speech
  const auto near = static_cast<std::ptrdiff_t>(kOther / kStep);
  for (auto other = sharpness.begin(); other != sharpness.end(); ++other) {
    if (std::abs(other - clap) >= near && *other > *clap - kSureDb) return std::nullopt;
  }
  // It begins where it first comes near to its height.
  auto begin = clap;
  while (begin != sharpness.begin() && clap - begin < signedIndex(rise) && *(begin - 1) > *clap - 10) --begin;
  return kStep * asReal(begin - sharpness.begin());
}

}  // namespace mouthpiece
