#include <algorithm>
#include <cmath>
#include <numbers>

#include "corpus_tools/sample/actor_performance.h"
#include "corpus_tools/sample/sample_random.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {
namespace {

enum Stream : std::uint64_t { kBlinkStream = 20, kBrowStream, kAccentStream };

// Blinks: Volkmann and Moore 1978, Evinger 1991 (closing about twice as fast as opening); while speaking about one
// in 2.5 s.
constexpr Seconds kBlinkInterval = 2.5, kShortestBlinkInterval = 0.8;
constexpr Seconds kLidClosingStage = 0.014, kLidOpeningStage = 0.028;  ///< of each movementStep stage
constexpr Seconds kLidsShut = 0.07;                                    ///< from half shut to half open

constexpr Seconds kBrowCorrelation = 0.7;
constexpr double kBrowDrift = 0.5;      ///< of brow_shape
constexpr double kAccentShare = 0.3;    ///< of the stressed syllables get a brow accent
constexpr Seconds kAccentWidth = 0.15;  ///< deviation of its bell

Eigen::VectorXd blinkDepth(const ActorOptions& options) {
  SampleRandom random(options.seed, kBlinkStream);
  const auto frames = static_cast<Eigen::Index>(options.frame_count);
  const Seconds duration = static_cast<double>(frames) / options.frame_rate_hz;
  Eigen::VectorXd depth = Eigen::VectorXd::Zero(frames);
  // The first one may have begun before the take.
  for (Seconds at = random.uniform(-0.2, kBlinkInterval); at < duration;
       at += kShortestBlinkInterval + random.waiting(kBlinkInterval - kShortestBlinkInterval)) {
    const double size = random.uniform(0.85, 1.0);
    const Seconds shut = kLidsShut * random.uniform(0.8, 1.4);
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      const Seconds time = static_cast<double>(frame) / options.frame_rate_hz - at;
      const Seconds late = kMovementStages * (kLidOpeningStage - kLidClosingStage);
      const double now =
          size * (movementStep(time, kLidClosingStage) - movementStep(time - shut + late, kLidOpeningStage));
      depth(frame) = std::max(depth(frame), now);
    }
  }
  return depth;
}

Eigen::VectorXd browHeight(const SpeechLabels& labels, const ActorOptions& options) {
  Eigen::VectorXd height =
      kBrowDrift * smoothNoise(options.seed, kBrowStream, kBrowCorrelation, options.frame_rate_hz, options.frame_count);
  SampleRandom random(options.seed, kAccentStream);
  for (const LabelledSyllable& syllable : labels.syllables) {
    if (syllable.stress != 1 || random.uniform() >= kAccentShare) continue;
    const double size = random.uniform(0.4, 1.2);
    const Seconds middle = labels.spanOf(syllable.phones).middle();
    for (Eigen::Index frame = 0; frame < height.size(); ++frame) {
      const double z = (static_cast<double>(frame) / options.frame_rate_hz - middle) / kAccentWidth;
      height(frame) += size * std::exp(-0.5 * z * z);
    }
  }
  return height;
}

}  // namespace

Eigen::VectorXd smoothNoise(std::uint64_t seed, std::uint64_t stream, Seconds correlation, double frame_rate_hz,
                            std::size_t frame_count) {
  // White noise a tenth of the correlation apart, smoothed by a Gaussian: infinitely smooth, and the same curve at
  // any frame rate.
  const Seconds step = correlation / 10;
  const Seconds reach = 4 * correlation;
  const auto frames = static_cast<Eigen::Index>(frame_count);
  const auto knots = static_cast<std::size_t>((static_cast<double>(frames) / frame_rate_hz + 2 * reach) / step) + 2;
  SampleRandom random(seed, stream);
  std::vector<double> white(knots);
  for (double& value : white) value = random.normal();
  // A Gaussian of deviation s/sqrt(2) gives the correlation exp(-t^2 / (2 s^2)).
  const double deviation = correlation / std::numbers::sqrt2;
  const double norm = std::sqrt(step / (deviation * std::sqrt(std::numbers::pi)));
  Eigen::VectorXd curve = Eigen::VectorXd::Zero(frames);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const Seconds time = static_cast<double>(frame) / frame_rate_hz + reach;
    const auto first = static_cast<std::size_t>((time - reach) / step);
    const auto last = std::min(knots - 1, static_cast<std::size_t>((time + reach) / step));
    for (std::size_t knot = first; knot <= last; ++knot) {
      const double z = (time - static_cast<double>(knot) * step) / deviation;
      curve(frame) += norm * white[knot] * std::exp(-0.5 * z * z);
    }
  }
  return curve;
}

Eigen::MatrixXd actorExpression(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options) {
  return blinkDepth(options) * model.blink_shape + browHeight(labels, options) * model.brow_shape;
}

}  // namespace mouthpiece
