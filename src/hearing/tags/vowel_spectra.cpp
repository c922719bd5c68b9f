#include "hearing/tags/vowel_spectra.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mouthpiece {
namespace {

constexpr std::size_t kWindow = 400;  // 25 ms
constexpr double kPreEmphasis = 0.97;
constexpr double kLowestHz = 80;
constexpr double kHighestHz = 7600;

double melFromHz(double hz) { return 2595 * std::log10(1 + hz / 700); }
double hzFromMel(double mel) { return 700 * (std::pow(10, mel / 2595) - 1); }

std::vector<double> paddedPreEmphasis(const std::vector<float>& samples, std::size_t frames) {
  std::vector<double> padded(kWindow / 2 + frames * kVowelHop + kWindow, 0.0);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double before = i > 0 ? kPreEmphasis * samples[i - 1] : 0.0;
    padded[kWindow / 2 + i] = samples[i] - before;
  }
  return padded;
}

std::vector<double> hammingWindow() {
  std::vector<double> window(kWindow);
  for (std::size_t i = 0; i < kWindow; ++i) {
    window[i] = 0.54 - 0.46 * std::cos(2 * std::numbers::pi * static_cast<double>(i) / (kWindow - 1));
  }
  return window;
}

}  // namespace

MelBank::MelBank() {
  const double low = melFromHz(kLowestHz);
  const double step = (melFromHz(kHighestHz) - low) / (kMelBandCount + 1);
  for (int band = 0; band < kMelBandCount; ++band) {
    const double left = hzFromMel(low + step * band);
    const double middle = hzFromMel(low + step * (band + 1));
    const double right = hzFromMel(low + step * (band + 2));
    for (std::size_t bin = 0; bin < kVowelBins; ++bin) {
      const double hz = static_cast<double>(bin) * kVowelSoundRateHz / kVowelTransform;
      const double weight = std::min((hz - left) / (middle - left), (right - hz) / (right - middle));
      weights(band, static_cast<Eigen::Index>(bin)) = std::max(weight, 0.0);
      weighted_hz(band, static_cast<Eigen::Index>(bin)) = std::max(weight, 0.0) * hz;
    }
    middle_hz(band) = middle;
    half_width_hz(band) = (right - left) / 2;
  }
}

const MelBank& MelBank::shared() {
  static const MelBank bank;
  return bank;
}

PowerFrames::PowerFrames(const AudioClip& sound)
    : count_(static_cast<Eigen::Index>(sound.samples.size() / kVowelHop + 1)),
      padded_(paddedPreEmphasis(sound.samples, static_cast<std::size_t>(count_))),
      window_(hammingWindow()),
      frame_(kVowelTransform, 0.0) {
  transform_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
}

Eigen::Index PowerFrames::read(Eigen::Index first, Eigen::MatrixXd& columns) {
  const Eigen::Index frames = std::min(columns.cols(), count_ - first);
  for (Eigen::Index k = 0; k < frames; ++k) {
    const double* start = &padded_[static_cast<std::size_t>(first + k) * kVowelHop];
    for (std::size_t i = 0; i < kWindow; ++i) frame_[i] = start[i] * window_[i];
    transform_.fwd(spectrum_, frame_);
    for (std::size_t bin = 0; bin < kVowelBins; ++bin) {
      columns(static_cast<Eigen::Index>(bin), k) = std::norm(spectrum_[bin]);
    }
  }
  return frames;
}

double quantileOf(Eigen::VectorXd values, double share) {
  std::sort(values.begin(), values.end());
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<Eigen::Index>(place);
  const Eigen::Index above = std::min(below + 1, values.size() - 1);
  return std::lerp(values(below), values(above), place - static_cast<double>(below));
}

void takeOffLoudMean(Eigen::MatrixXd& values, const Eigen::MatrixXd& bands) {
  constexpr double kLoudRange = 5;       // nepers of energy under the loudest band's 95th percentile
  constexpr double kTakenOffMean = 0.5;  // chosen on singers left out
  const Eigen::VectorXd loudest_band = bands.rowwise().maxCoeff();
  const double threshold = quantileOf(loudest_band, kVowelLoudQuantile) - kLoudRange;
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(values.cols());
  double count = 0;
  for (Eigen::Index frame = 0; frame < values.rows(); ++frame) {
    if (loudest_band(frame) <= threshold) continue;
    sum += values.row(frame);
    ++count;
  }
  if (count > 0) values.rowwise() -= kTakenOffMean / count * sum;
}

}  // namespace mouthpiece
