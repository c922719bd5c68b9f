#include "audio/pitch_track.h"

#include <aubio/aubio.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <memory>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr int kRateHz = 16000;
constexpr std::size_t kWindow = 1024;  // 64 ms; twice as long flattens vibrato (facts.md)

struct DeletePitch {
  void operator()(aubio_pitch_t* pitch) const { del_aubio_pitch(pitch); }
};
struct DeleteVector {
  void operator()(fvec_t* vector) const { del_fvec(vector); }
};
using Vector = std::unique_ptr<fvec_t, DeleteVector>;

double levelDb(const float* samples, std::size_t count) {
  double energy = 0;
  for (std::size_t i = 0; i < count; ++i) energy += static_cast<double>(samples[i]) * samples[i];
  return 10 * std::log10(energy / static_cast<double>(count) + 1e-12);
}

/// How alike the periods before and after `middle` are (normalised correlation). aubio's own confidence stays 0 for
/// yinfft.
double clarityAt(const std::vector<float>& samples, std::size_t middle, double period) {
  const auto length = static_cast<std::size_t>(std::lround(period));
  if (length == 0 || middle < length || middle + length > samples.size()) return 0;
  const Eigen::Map<const Eigen::VectorXf> before(&samples[middle - length], static_cast<Eigen::Index>(length));
  const Eigen::Map<const Eigen::VectorXf> after(&samples[middle], static_cast<Eigen::Index>(length));
  return before.dot(after) / std::sqrt(before.squaredNorm() * after.squaredNorm() + 1e-12F);
}

/// Another period than the tracker's own must repeat better by this much. Voices double their period at times: both are
/// alike then, and the tracker goes by its neighbours' pitch more often than not.
constexpr double kSurelyBetter = 0.1;

/// How alike `count` samples around `middle` are to those `lag` later.
double likenessAt(const std::vector<float>& samples, std::size_t middle, std::size_t lag, std::size_t count) {
  const std::size_t half = (count + lag) / 2;
  if (lag == 0 || middle < half || middle - half + count + lag > samples.size()) return -1;
  const auto size = static_cast<Eigen::Index>(count);
  const Eigen::Map<const Eigen::VectorXf> early(&samples[middle - half], size),
      late(&samples[middle - half + lag], size);
  return early.dot(late) / std::sqrt(early.squaredNorm() * late.squaredNorm() + 1e-12F);
}

/// The tracker at times takes a harmonic, or a half or a third of the pitch, for the pitch: of its multiples and parts
/// one whose period repeats much better.
double setOctaveRight(const std::vector<float>& samples, std::size_t middle, double hz, const PitchOptions& options) {
  const auto count = static_cast<std::size_t>(std::lround(2 * kRateHz / hz));
  const auto repeats = [&](double candidate) {
    const auto lag = static_cast<std::size_t>(std::lround(kRateHz / candidate));
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
  if (!(place >= 0) || place > static_cast<double>(frames.size()) - 1) return 0;
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, frames.size() - 1);
  if (frames[before].hz <= 0 || frames[after].hz <= 0) return 0;
  return std::lerp(frames[before].hz, frames[after].hz, place - static_cast<double>(before));
}

PitchTrack trackPitch(const AudioClip& clip, const PitchOptions& options) {
  PitchTrack track;
  track.step = options.step;
  const AudioClip sound = clip.sample_rate_hz == kRateHz ? clip : resampleAudio(clip, kRateHz);
  const auto hop = static_cast<std::size_t>(std::lround(options.step * kRateHz));
  const std::size_t count = sound.samples.size() / hop + 1;
  const std::unique_ptr<aubio_pitch_t, DeletePitch> pitch(
      new_aubio_pitch("yinfft", kWindow, static_cast<uint_t>(hop), kRateHz));
  const Vector input(new_fvec(static_cast<uint_t>(hop)));
  const Vector output(new_fvec(1));
  if (!pitch || !input || !output) throw InternalError("aubio could not set up its pitch tracker");
  aubio_pitch_set_unit(pitch.get(), "Hz");

  // aubio sees a window that ends with the samples just given: after `warm_up` hops its middle is the sound's
  // beginning.
  const std::size_t warm_up = (kWindow + hop - 1) / hop;
  const std::size_t lead = warm_up * hop - kWindow / 2;
  std::vector<float> padded(lead + count * hop + 2 * kWindow, 0.0F);
  std::copy(sound.samples.begin(), sound.samples.end(), padded.begin() + static_cast<std::ptrdiff_t>(lead));
  std::vector<double> levels(count);
  double loudest = -200;
  for (std::size_t i = 0; i < count; ++i) {
    levels[i] = levelDb(&padded[i * hop + lead - kWindow / 2], kWindow);
    loudest = std::max(loudest, levels[i]);
  }
  track.frames.resize(count);
  for (std::size_t step = 0; step < count + warm_up; ++step) {
    std::copy_n(padded.begin() + static_cast<std::ptrdiff_t>(std::min(step * hop, padded.size() - hop)), hop,
                input->data);
    aubio_pitch_do(pitch.get(), input.get(), output.get());
    if (step + 1 < warm_up) continue;
    const std::size_t frame = step + 1 - warm_up;
    if (frame >= count) break;
    double hz = output->data[0];
    const bool in_range = hz >= options.lowest_hz && hz <= options.highest_hz;
    if (in_range) hz = setOctaveRight(padded, frame * hop + lead, hz, options);
    const double confidence = in_range ? clarityAt(padded, frame * hop + lead, kRateHz / hz) : 0;
    const bool voiced = confidence >= options.least_confidence && levels[frame] >= loudest + options.least_level_db;
    track.frames[frame] = {voiced ? hz : 0, std::clamp(confidence, 0.0, 1.0)};
  }
  return track;
}

}  // namespace mouthpiece
