#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "base/index.h"
#include "base/statistics.h"
#include "hearing/tags/vowel_spectra.h"

namespace mouthpiece {
namespace {

constexpr std::size_t kPitchWindow = 640;  // 40 ms
constexpr std::size_t kPitchTransform = 2048;
constexpr Eigen::Index kShortestLag = kVowelSoundRateHz / 800;
constexpr Eigen::Index kLongestLag = kVowelSoundRateHz / 70;
constexpr std::size_t kPitchBins = 320;  // to 2500 Hz: overtones above do not tell the pitch
constexpr double kPeriodic = 0.5;        // a frame's autocorrelation at its period, at least
constexpr double kLongLagCost = 0.02;    // an octave
constexpr Eigen::Index kNearFrames = 3;  // to both sides of the one whose pitch is a median
constexpr std::size_t kVoicedNear = 3;   // frames among those with a pitch of their own, at least
constexpr double kUnvoicedHz = 100;
constexpr Eigen::Index kMargin = 64;   // bins mirrored at both ends of a spectrum
constexpr double kLowestLevel = -12;   // nepers
constexpr Eigen::Index kAveraged = 2;  // frames to both sides

/// Autocorrelations at the lags 0 to kLongestLag by way of the power spectrum.
class Autocorrelation {
 public:
  Autocorrelation() : window_(kPitchWindow) {
    transform_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    for (std::size_t i = 0; i < kPitchWindow; ++i) {
      window_[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (asReal(i) + 0.5) / kPitchWindow);
    }
    own_ = of(window_, kPitchTransform / 2 + 1);
    own_ /= own_(0);
  }

  /// Of 640 samples, 1 at lag 0 and at the period of what repeats.
  Eigen::VectorXd normalised(const double* samples) {
    double mean = 0;
    for (std::size_t i = 0; i < kPitchWindow; ++i) mean += samples[i];
    mean /= kPitchWindow;
    std::vector<double> frame(kPitchWindow);
    for (std::size_t i = 0; i < kPitchWindow; ++i) frame[i] = (samples[i] - mean) * window_[i];
    Eigen::VectorXd r = of(frame, kPitchBins);
    r /= r(0) + kVowelSilent;
    return r.cwiseQuotient(own_);
  }

 private:
  Eigen::VectorXd of(std::vector<double> frame, std::size_t bins) {
    frame.resize(kPitchTransform, 0.0);
    transform_.fwd(spectrum_, frame);
    for (std::size_t bin = 0; bin < spectrum_.size(); ++bin) {
      spectrum_[bin] = bin < bins ? std::norm(spectrum_[bin]) : 0.0;
    }
    transform_.inv(frame, spectrum_, kPitchTransform);
    return Eigen::Map<const Eigen::VectorXd>(frame.data(), kLongestLag + 1);
  }

  Eigen::FFT<double> transform_;
  std::vector<double> window_;
  std::vector<std::complex<double>> spectrum_;
  Eigen::VectorXd own_;
};

/// The pitch whose peak is highest, 0 when none is high enough.
double pitchOf(const Eigen::VectorXd& r) {
  Eigen::Index best = 0;
  double best_score = kPeriodic;
  for (Eigen::Index lag = kShortestLag; lag < kLongestLag; ++lag) {
    if (r(lag) < r(lag - 1) || r(lag) < r(lag + 1)) continue;
    const double octaves = std::log2(asReal(lag) / kShortestLag);
    const double score = r(lag) * (1 - kLongLagCost * octaves);
    if (score <= best_score) continue;
    best = lag;
    best_score = score;
  }
  if (best == 0) return 0;
  const double bend = r(best - 1) - 2 * r(best) + r(best + 1);
  const double shift = bend < 0 ? 0.5 * (r(best - 1) - r(best + 1)) / bend : 0;
  return kVowelSoundRateHz / (asReal(best) + std::clamp(shift, -1.0, 1.0));
}

/// The median of the voiced frames around each, where there are enough of them.
Eigen::VectorXd medianPitch(const Eigen::VectorXd& found) {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(found.size());
  std::vector<double> voiced;
  for (Eigen::Index frame = 0; frame < found.size(); ++frame) {
    voiced.clear();
    const Eigen::Index last = std::min(frame + kNearFrames, found.size() - 1);
    for (Eigen::Index k = std::max<Eigen::Index>(frame - kNearFrames, 0); k <= last; ++k) {
      if (found(k) > 0) voiced.push_back(found(k));
    }
    if (voiced.size() < kVoicedNear) continue;
    result(frame) = interpolatedQuantile(voiced, 0.5);
  }
  return result;
}

Eigen::VectorXd framesPitch(const AudioClip& sound, Eigen::Index frames) {
  std::vector<double> padded(kPitchWindow / 2, 0.0);
  padded.insert(padded.end(), sound.samples.begin(), sound.samples.end());
  padded.resize(unsignedIndex(frames * kVowelHop) + kPitchWindow, 0.0);
  Autocorrelation autocorrelation;
  Eigen::VectorXd found(frames);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    found(frame) = pitchOf(autocorrelation.normalised(&padded[unsignedIndex(frame * kVowelHop)]));
  }
  return medianPitch(found);
}

/// A spectrum's sum of sums, mirrored at both ends, read between its bins.
class SumOfSums {
 public:
  explicit SumOfSums(const Eigen::VectorXd& power) {
    double sum = 0, sums = 0;
    const Eigen::Index bins = power.size();
    for (Eigen::Index k = 0; k < bins + 2 * kMargin; ++k) {
      Eigen::Index bin = std::abs(k - kMargin);
      if (bin >= bins) bin = 2 * (bins - 1) - bin;
      sum += power(bin);
      values_(k) = sums += sum;
    }
  }
  [[nodiscard]] double at(double place) const {
    const Eigen::Index below = std::lround(std::floor(place));
    const double share = place - asReal(below);
    return values_(below) * (1 - share) + values_(below + 1) * share;
  }

 private:
  Eigen::Matrix<double, kVowelBins + 2 * kMargin, 1> values_;
};

/// Averages the spectrum under a triangle that reaches one pitch to both sides, which joins the harmonics' tops by
/// straight lines; below the pitch it is what it is there. The triangle is the second difference of a sum of sums.
Eigen::VectorXd withoutHarmonics(Eigen::VectorXd power, double pitch_hz) {
  const double hz = pitch_hz > 0 ? pitch_hz : kUnvoicedHz;
  const double width = std::clamp(hz * kVowelTransform / kVowelSoundRateHz, 1.0, kMargin - 2.0);
  const SumOfSums sums(power);
  const Eigen::Index lowest = std::min(std::lround(std::ceil(width)), power.size() - 1);
  for (Eigen::Index bin = lowest; bin < power.size(); ++bin) {
    const double place = asReal(bin + kMargin - 1);
    const double difference = sums.at(place + width) - 2 * sums.at(place) + sums.at(place - width);
    power(bin) = std::max(difference, 0.0) / (width * width);
  }
  power.head(lowest).setConstant(power(lowest));
  return power;
}

Eigen::MatrixXd averagedOverFrames(const Eigen::MatrixXd& levels) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(levels.rows(), levels.cols());
  for (Eigen::Index frame = 0; frame < levels.rows(); ++frame) {
    for (Eigen::Index offset = -kAveraged; offset <= kAveraged; ++offset) {
      result.row(frame) += levels.row(std::clamp<Eigen::Index>(frame + offset, 0, levels.rows() - 1));
    }
  }
  return result / (2.0 * kAveraged + 1);
}

}  // namespace

VowelEnvelopes vowelEnvelopes(const AudioClip& clip) {
  MOUTHPIECE_EXPECT(clip.sample_rate_hz > 0);
  if (clip.sample_rate_hz != kVowelSoundRateHz) return vowelEnvelopes(resampleAudio(clip, kVowelSoundRateHz));
  PowerFrames frames(clip);
  VowelEnvelopes result{Eigen::MatrixXd(frames.count(), kMelBandCount), framesPitch(clip, frames.count())};
  frames.forEachBlock([&](Eigen::Index first, Eigen::MatrixXd power) {
    for (Eigen::Index k = 0; k < power.cols(); ++k)
      power.col(k) = withoutHarmonics(power.col(k), result.pitch_hz(first + k));
    result.levels.middleRows(first, power.cols()).noalias() = (MelBank::shared().weights * power).transpose();
  });
  const double loud = loudOf(result.levels.rowwise().sum()) + kVowelSilent;
  result.levels = (result.levels.array() / loud + kVowelFloor).log().max(kLowestLevel).matrix();
  result.levels = averagedOverFrames(result.levels);
  return result;
}

}  // namespace mouthpiece
