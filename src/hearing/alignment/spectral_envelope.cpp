#include "hearing/alignment/phone_decoder.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "audio/pitch_track.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

// The model's feat.params and PocketSphinx' defaults.
constexpr int kRateHz = 16000;
constexpr std::size_t kHop = 160, kWindow = 410, kTransform = 512;
constexpr Eigen::Index kBins = kTransform / 2 + 1, kBands = 25;
constexpr double kLowestHz = 130, kHighestHz = 6800, kLifter = 22, kPreEmphasis = 0.97;
constexpr double kBinHz = asReal(kRateHz) / kTransform;
/// Energies of 16-bit samples: less is digital silence.
constexpr double kSilentEnergy = 1e-4;

constexpr double kLowestPitchHz = 60, kHighestPitchHz = 1100;

double melOf(double hz) { return 2595 * std::log10(1 + hz / 700); }
double hzOf(double mel) { return 700 * (std::pow(10, mel / 2595) - 1); }

/// bands x bins: triangles of one area, evenly spaced in mel, their corners on bins.
Eigen::MatrixXd melBands() {
  const double low = melOf(kLowestHz), step = (melOf(kHighestHz) - low) / (kBands + 1);
  const auto corner = [&](Eigen::Index i) { return std::round(hzOf(low + asReal(i) * step) / kBinHz) * kBinHz; };
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(kBands, kBins);
  for (Eigen::Index band = 0; band < kBands; ++band) {
    const double left = corner(band), middle = corner(band + 1), right = corner(band + 2);
    for (Eigen::Index bin = 0; bin < kBins; ++bin) {
      const double hz = asReal(bin) * kBinHz;
      const double height = std::min((hz - left) / (middle - left), (right - hz) / (right - middle));
      weights(band, bin) = std::max(0.0, height) * 2 / (right - left);
    }
  }
  return weights;
}

}  // namespace

/// The orthonormal cosine transform, liftered.
Eigen::MatrixXd frontEndCosines(std::size_t count) {
  Eigen::MatrixXd rows(count, kBands);
  for (Eigen::Index k = 0; k < rows.rows(); ++k) {
    const auto order = asReal(k);
    const double lift = 1 + kLifter / 2 * std::sin(std::numbers::pi * order / kLifter);
    for (Eigen::Index band = 0; band < kBands; ++band) {
      rows(k, band) = lift * std::sqrt((k == 0 ? 1.0 : 2.0) / kBands) *
                      std::cos(std::numbers::pi * order * (asReal(band) + 0.5) / kBands);
    }
  }
  return rows;
}

namespace {

class FrontEnd {
 public:
  explicit FrontEnd(std::size_t count) : bands_(melBands()), cosines_(frontEndCosines(count)), frame_(kTransform) {
    transform_.SetFlag(Eigen::FFT<double>::HalfSpectrum);
    for (std::size_t n = 0; n < kWindow; ++n)
      window_.push_back(0.54 - 0.46 * std::cos(2 * std::numbers::pi * asReal(n) / (kWindow - 1)));
  }

  /// Zero beyond the last sample.
  Eigen::VectorXd powerAt(std::span<const std::int16_t> samples, std::size_t start) {
    std::fill(frame_.begin(), frame_.end(), 0.0);
    for (std::size_t n = 0; n < kWindow && start + n < samples.size(); ++n) {
      const double before = start + n > 0 ? samples[start + n - 1] : 0;
      frame_[n] = (samples[start + n] - kPreEmphasis * before) * window_[n];
    }
    transform_.fwd(spectrum_, frame_);
    Eigen::VectorXd power(kBins);
    for (Eigen::Index bin = 0; bin < kBins; ++bin) power(bin) = std::norm(spectrum_[unsignedIndex(bin)]);
    return power;
  }

  [[nodiscard]] Eigen::VectorXd cepstraOf(const Eigen::VectorXd& power) const {
    return cosines_ * ((bands_ * power).array() + kSilentEnergy).log().matrix();
  }

 private:
  Eigen::MatrixXd bands_, cosines_;
  Eigen::FFT<double> transform_;
  std::vector<double> window_, frame_;
  std::vector<std::complex<double>> spectrum_;
};

/// Averaged under a triangle that reaches `pitch_hz` to both sides, which joins the harmonics' tops by straight lines;
/// below the pitch it is what it is there.
Eigen::VectorXd spectralEnvelope(const Eigen::VectorXd& power, double pitch_hz) {
  const double width = pitch_hz / kBinHz;
  Eigen::VectorXd smooth(kBins);
  for (Eigen::Index bin = 0; bin < kBins; ++bin) {
    const double middle = std::max(asReal(bin), width);
    const auto last = static_cast<Eigen::Index>(std::floor(middle + width));
    double sum = 0, weights = 0;
    for (auto at = static_cast<Eigen::Index>(std::ceil(middle - width)); at <= last; ++at) {
      const double weight = 1 - std::abs(asReal(at) - middle) / width;
      sum += weight * power(at < kBins ? at : 2 * (kBins - 1) - at);  // mirrored at the upper end
      weights += weight;
    }
    smooth(bin) = sum / weights;
  }
  return smooth;
}

/// The highest pitch within the window of frame `frame`; 0 where it is not voiced.
double pitchWithin(const PitchTrack& pitch, std::size_t frame) {
  double hz = 0;
  for (std::size_t i = frame; i < std::min(frame + 3, pitch.frames.size()); ++i) hz = std::max(hz, pitch.frames[i].hz);
  return hz;
}

}  // namespace

void useSpectralEnvelope(std::span<const std::int16_t> samples, std::vector<std::vector<float>>& cepstra) {
  if (cepstra.empty()) return;
  AudioClip clip{kRateHz, {}};
  for (const std::int16_t sample : samples) clip.samples.push_back(static_cast<float>(sample) / 32768.0F);
  const PitchTrack pitch =
      trackPitch(clip, {.step = asReal(kHop) / kRateHz, .lowest_hz = kLowestPitchHz, .highest_hz = kHighestPitchHz});
  FrontEnd front_end(cepstra.front().size());
  for (std::size_t frame = 0; frame < cepstra.size(); ++frame) {
    const double hz = pitchWithin(pitch, frame);
    if (hz <= 0) continue;
    const Eigen::VectorXd power = front_end.powerAt(samples, frame * kHop);
    // The difference only, so that frames with and without a pitch are of one kind.
    const Eigen::VectorXd change = front_end.cepstraOf(spectralEnvelope(power, hz)) - front_end.cepstraOf(power);
    for (std::size_t k = 0; k < cepstra[frame].size(); ++k) cepstra[frame][k] += asFloat(change(signedIndex(k)));
  }
}

std::vector<float> frontEndCepstra(std::span<const std::int16_t> samples, std::size_t start, std::size_t count) {
  FrontEnd front_end(count);
  const Eigen::VectorXf cepstra = front_end.cepstraOf(front_end.powerAt(samples, start)).cast<float>();
  return {cepstra.begin(), cepstra.end()};
}

}  // namespace mouthpiece
