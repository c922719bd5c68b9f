#include <aubio/aubio.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "audio/pitch_track.h"
#include "audio/spectral_frames.h"
#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// Frees one of aubio's objects by its own function.
template <auto Function>
struct DeleteBy {
  template <typename T>
  void operator()(T* object) const {
    Function(object);
  }
};
using AubioVector = std::unique_ptr<fvec_t, DeleteBy<del_fvec>>;

/// A sound at 16 kHz as aubio takes it: hop by hop, in windows that end with the samples just given. Frame i here is
/// the window whose middle lies at i * hop of the sound; beyond the sound is silence. An hour's sound is not held a
/// second time: `clip` must outlive this.
class AubioFrames {
 public:
  static constexpr int kRateHz = 16000;

  AubioFrames(const AudioClip& clip, Seconds step, std::size_t window)
      : hop_(unsignedIndex(std::lround(step * kRateHz))),
        window_(window),
        warm_up_((window + hop_ - 1) / hop_),
        lead_(warm_up_ * hop_ - window / 2),
        resampled_(clip.sample_rate_hz == kRateHz ? AudioClip() : resampleAudio(clip, kRateHz)),
        sound_(clip.sample_rate_hz == kRateHz ? clip.samples : resampled_.samples),
        count_(sound_.size() / hop_ + 1) {}
  AubioFrames(const AubioFrames&) = delete;
  AubioFrames& operator=(const AubioFrames&) = delete;

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] uint_t hop() const { return static_cast<uint_t>(hop_); }
  /// With the silence around the sound.
  [[nodiscard]] std::size_t size() const { return lead_ + count_ * hop_ + 2 * window_; }
  [[nodiscard]] std::vector<float> samples() const {
    std::vector<float> all(size());
    copy(0, all);
    return all;
  }
  /// Of the samples.
  [[nodiscard]] std::size_t middleOf(std::size_t frame) const { return frame * hop_ + lead_; }
  [[nodiscard]] Eigen::VectorXf window(std::size_t frame) const {
    Eigen::VectorXf samples(signedIndex(window_));
    copy(middleOf(frame) - window_ / 2, {samples.data(), window_});
    return samples;
  }

  /// Calls `give` with every hop of samples, and `take` with every frame as soon as aubio has heard the whole of it.
  template <typename Give, typename Take>
  void run(Give give, Take take) const {
    const AubioVector input(new_fvec(hop()));
    for (std::size_t step = 0; step + 1 < count_ + warm_up_; ++step) {
      copy(std::min(step * hop_, size() - hop_), {input->data, hop_});
      give(input.get());
      if (step + 1 >= warm_up_) take(step + 1 - warm_up_);
    }
  }

 private:
  /// Samples from `first` on.
  void copy(std::size_t first, std::span<float> out) const {
    std::fill(out.begin(), out.end(), 0.0F);
    const std::size_t begin = std::max(first, lead_), end = std::min(first + out.size(), lead_ + sound_.size());
    if (begin < end) std::copy_n(&sound_[begin - lead_], end - begin, &out[begin - first]);
  }

  std::size_t hop_, window_, warm_up_, lead_;
  AudioClip resampled_;  ///< where the sound has another rate
  std::span<const float> sound_;
  std::size_t count_;
};

constexpr std::size_t kPitchWindow = 1024;  // 64 ms; twice as long flattens vibrato

double levelDb(const Eigen::Ref<const Eigen::VectorXf>& samples) {
  return 10 * std::log10(samples.cast<double>().squaredNorm() / asReal(samples.size()) + 1e-12);
}

/// How alike the periods before and after `middle` are (normalised correlation). aubio's own confidence stays 0 for
/// yinfft.
double clarityAt(const std::vector<float>& samples, std::size_t middle, double period) {
  const std::size_t length = unsignedIndex(std::lround(period));
  if (length == 0 || middle < length || middle + length > samples.size()) return 0;
  const Eigen::Map<const Eigen::VectorXf> before(&samples[middle - length], signedIndex(length));
  const Eigen::Map<const Eigen::VectorXf> after(&samples[middle], signedIndex(length));
  return before.dot(after) / std::sqrt(before.squaredNorm() * after.squaredNorm() + 1e-12F);
}

/// Another period than the tracker's own must repeat better by this much. Voices double their period at times: both are
/// alike then, and the tracker goes by its neighbours' pitch more often than not.
constexpr double kSurelyBetter = 0.1;

/// How alike `count` samples around `middle` are to those `lag` later.
double likenessAt(const std::vector<float>& samples, std::size_t middle, std::size_t lag, std::size_t count) {
  const std::size_t half = (count + lag) / 2;
  if (lag == 0 || middle < half || middle - half + count + lag > samples.size()) return -1;
  const Eigen::Index size = signedIndex(count);
  const Eigen::Map<const Eigen::VectorXf> early(&samples[middle - half], size),
      late(&samples[middle - half + lag], size);
  return early.dot(late) / std::sqrt(early.squaredNorm() * late.squaredNorm() + 1e-12F);
}

/// The tracker at times takes a harmonic, or a half or a third of the pitch, for the pitch: of its multiples and parts
/// one whose period repeats much better.
double setOctaveRight(const std::vector<float>& samples, std::size_t middle, double hz, const PitchOptions& options) {
  const std::size_t count = unsignedIndex(std::lround(2 * AubioFrames::kRateHz / hz));
  const auto repeats = [&](double candidate) {
    const std::size_t lag = unsignedIndex(std::lround(AubioFrames::kRateHz / candidate));
    double likeness = -1;  // between whole samples a period repeats less well
    for (const std::size_t near : {lag - 1, lag, lag + 1})
      likeness = std::max(likeness, likenessAt(samples, middle, near, count));
    return likeness;
  };
  double best_hz = hz, best = repeats(hz) + kSurelyBetter;
  for (const double multiple : {2., 3., 1. / 2, 1. / 3}) {
    const double candidate = hz * multiple;
    if (candidate < options.lowest_hz || candidate > options.highest_hz) continue;
    const double likeness = repeats(candidate);
    if (likeness <= best) continue;
    best = likeness;
    best_hz = candidate;
  }
  return best_hz;
}

}  // namespace

double PitchTrack::hzAt(Seconds time) const {
  const double place = time / step;
  if (!(place >= 0) || place > asReal(frames.size()) - 1) return 0;
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, frames.size() - 1);
  if (frames[before].hz <= 0 || frames[after].hz <= 0) return 0;
  return std::lerp(frames[before].hz, frames[after].hz, place - asReal(before));
}

PitchTrack trackPitch(const AudioClip& clip, const PitchOptions& options) {
  const AubioFrames sound(clip, options.step, kPitchWindow);
  const std::vector<float> samples = sound.samples();
  const std::unique_ptr<aubio_pitch_t, DeleteBy<del_aubio_pitch>> pitch(
      new_aubio_pitch("yinfft", kPitchWindow, sound.hop(), AubioFrames::kRateHz));
  const AubioVector output(new_fvec(1));
  if (!pitch || !output) throw InternalError("aubio could not set up its pitch tracker");
  aubio_pitch_set_unit(pitch.get(), "Hz");
  std::vector<double> levels;
  for (std::size_t frame = 0; frame < sound.count(); ++frame) levels.push_back(levelDb(sound.window(frame)));
  const double least_level = std::max(-200.0, *std::max_element(levels.begin(), levels.end())) + options.least_level_db;
  PitchTrack track{options.step, std::vector<PitchFrame>(sound.count())};
  sound.run([&](const fvec_t* hop) { aubio_pitch_do(pitch.get(), hop, output.get()); },
            [&](std::size_t frame) {
              double hz = output->data[0];
              if (!(hz >= options.lowest_hz && hz <= options.highest_hz)) return;
              const std::size_t middle = sound.middleOf(frame);
              hz = setOctaveRight(samples, middle, hz, options);
              const double confidence = clarityAt(samples, middle, AubioFrames::kRateHz / hz);
              const bool is_voiced = confidence >= options.least_confidence && levels[frame] >= least_level;
              track.frames[frame] = {is_voiced ? hz : 0, std::clamp(confidence, 0.0, 1.0)};
            });
  return track;
}

Eigen::Index SpectralFrames::rowAt(Seconds time) const {
  return std::clamp<Eigen::Index>(std::lround(time / step), 0, std::max<Eigen::Index>(mfcc.rows() - 1, 0));
}

SpectralFrames spectralFrames(const AudioClip& clip, Seconds step) {
  constexpr uint_t kWindow = 512, kBands = 40;
  const AubioFrames sound(clip, step, kWindow);
  const std::unique_ptr<aubio_pvoc_t, DeleteBy<del_aubio_pvoc>> vocoder(new_aubio_pvoc(kWindow, sound.hop()));
  const std::unique_ptr<aubio_mfcc_t, DeleteBy<del_aubio_mfcc>> cepstrum(
      new_aubio_mfcc(kWindow, kBands, SpectralFrames::kCoefficients, AubioFrames::kRateHz));
  const AubioVector output(new_fvec(SpectralFrames::kCoefficients));
  const std::unique_ptr<cvec_t, DeleteBy<del_cvec>> spectrum(new_cvec(kWindow));
  if (!vocoder || !cepstrum || !output || !spectrum) throw InternalError("aubio could not set up its cepstrum");
  SpectralFrames frames{step, {}, {}};
  frames.mfcc.resize(signedIndex(sound.count()), SpectralFrames::kCoefficients);
  frames.level_db.resize(frames.mfcc.rows());
  sound.run([&](const fvec_t* hop) { aubio_pvoc_do(vocoder.get(), hop, spectrum.get()); },
            [&](std::size_t frame) {
              const Eigen::Index row = signedIndex(frame);
              aubio_mfcc_do(cepstrum.get(), spectrum.get(), output.get());
              for (Eigen::Index k = 0; k < SpectralFrames::kCoefficients; ++k)
                frames.mfcc(row, k) = std::isfinite(output->data[k]) ? output->data[k] : 0.0F;
              frames.level_db(row) = 10.0F * std::log10(sound.window(frame).squaredNorm() / kWindow + 1e-10F);
            });
  return frames;
}

}  // namespace mouthpiece
