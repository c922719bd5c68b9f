#include "audio/spectral_frames.h"

#include <aubio/aubio.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr int kRateHz = 16000;
constexpr std::size_t kWindow = 512;
constexpr uint_t kBands = 40;

template <auto Function>
struct DeleteBy {
  template <typename T>
  void operator()(T* object) const {
    Function(object);
  }
};

}  // namespace

Eigen::Index SpectralFrames::rowAt(Seconds time) const {
  return std::clamp<Eigen::Index>(std::lround(time / step), 0, std::max<Eigen::Index>(mfcc.rows() - 1, 0));
}

SpectralFrames spectralFrames(const AudioClip& clip, Seconds step) {
  const AudioClip sound = clip.sample_rate_hz == kRateHz ? clip : resampleAudio(clip, kRateHz);
  const auto hop = static_cast<std::size_t>(std::lround(step * kRateHz));
  const auto count = static_cast<Eigen::Index>(sound.samples.size() / hop + 1);
  const std::unique_ptr<aubio_pvoc_t, DeleteBy<del_aubio_pvoc>> vocoder(
      new_aubio_pvoc(kWindow, static_cast<uint_t>(hop)));
  const std::unique_ptr<aubio_mfcc_t, DeleteBy<del_aubio_mfcc>> cepstrum(
      new_aubio_mfcc(kWindow, kBands, SpectralFrames::kCoefficients, kRateHz));
  const std::unique_ptr<fvec_t, DeleteBy<del_fvec>> input(new_fvec(static_cast<uint_t>(hop)));
  const std::unique_ptr<fvec_t, DeleteBy<del_fvec>> output(new_fvec(SpectralFrames::kCoefficients));
  const std::unique_ptr<cvec_t, DeleteBy<del_cvec>> spectrum(new_cvec(kWindow));
  if (!vocoder || !cepstrum || !input || !output || !spectrum) {
    throw InternalError("aubio could not set up its cepstrum");
  }
  // The vocoder's window ends with the samples just given: after `warm_up` hops its middle is the sound's beginning.
  const std::size_t warm_up = (kWindow + hop - 1) / hop;
  const std::size_t lead = warm_up * hop - kWindow / 2;
  std::vector<float> padded(lead + static_cast<std::size_t>(count) * hop + 2 * kWindow, 0.0F);
  std::copy(sound.samples.begin(), sound.samples.end(), padded.begin() + static_cast<std::ptrdiff_t>(lead));
  SpectralFrames frames{step, {}, {}};
  frames.mfcc.resize(count, SpectralFrames::kCoefficients);
  frames.level_db.resize(count);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count) + warm_up; ++i) {
    const std::size_t from = std::min(i * hop, padded.size() - hop);
    std::copy_n(padded.begin() + static_cast<std::ptrdiff_t>(from), hop, input->data);
    aubio_pvoc_do(vocoder.get(), input.get(), spectrum.get());
    if (i + 1 < warm_up) continue;
    const auto row = static_cast<Eigen::Index>(i + 1 - warm_up);
    if (row >= count) break;
    aubio_mfcc_do(cepstrum.get(), spectrum.get(), output.get());
    for (Eigen::Index k = 0; k < SpectralFrames::kCoefficients; ++k) {
      const float value = output->data[k];
      frames.mfcc(row, k) = std::isfinite(value) ? value : 0.0F;
    }
    const Eigen::Map<const Eigen::VectorXf> window(&padded[static_cast<std::size_t>(row) * hop + lead - kWindow / 2],
                                                   kWindow);
    frames.level_db(row) = 10.0F * std::log10(window.squaredNorm() / static_cast<float>(kWindow) + 1e-10F);
  }
  return frames;
}

}  // namespace mouthpiece
