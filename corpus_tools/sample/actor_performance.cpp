#include "corpus_tools/sample/actor_performance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/errors.h"
#include "corpus_tools/sample/sample_random.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {
namespace {

enum Stream : std::uint64_t {
  kTargetStream = 1,
  kTimingStream,
  kClosureStream,
  kBreathStream,
  kBlinkStream = 20,
  kBrowStream,
  kAccentStream,
  kDriftStream = 100
};

constexpr Seconds kTimingSpread = 0.005, kLargestTimingShift = 0.010;
constexpr Seconds kDriftCorrelation = 0.5;
constexpr double kDriftShare = 0.8;       ///< of `variation`
constexpr double kClosureSpreadMm = 0.2;  ///< between repetitions of a closure, at 10 % variation

// The lips' own movement into contact (docs/theory/corpus_tools/actor_model.md, "Closures").
constexpr Seconds kClosureTimeConstant = 0.011;
constexpr Seconds kClosureLead = 0.028;      ///< closed before the label's start, when the sound has fallen; but M,
constexpr Seconds kReleaseLead = 0.025;      ///< and half open before its end: M sounds while they are closed
constexpr Seconds kShortestClosure = 0.070;  ///< from half closed to half open
constexpr double kLabiodentalShare = 0.4;    ///< F V are less exact than B P M
constexpr double kPartedMm = 1.0;            ///< all phones but B P M keep the lips this far open, as the capture does
constexpr double kContactSoftnessMm = 0.5, kPartedSoftnessMm = 1.0;

/// Moves inner boundaries a little, in order and without emptying a segment.
void varyTiming(std::vector<SpeechSegment>& segments, const ActorOptions& options) {
  SampleRandom random(options.seed, kTimingStream);
  for (std::size_t i = 1; i < segments.size(); ++i) {
    SpeechSegment& left = segments[i - 1];
    SpeechSegment& right = segments[i];
    const Seconds room = 0.2 * std::min(left.span.duration(), right.span.duration());
    const Seconds limit = std::min(room, kLargestTimingShift);
    const Seconds shift = std::clamp(kTimingSpread * 10 * options.variation * random.normal(), -limit, limit);
    left.span.end += shift;
    right.span.start += shift;
  }
}

/// Targets, segments x components.
Eigen::MatrixXd segmentTargets(const ActorModel& model, const std::vector<SpeechSegment>& segments,
                               const ActorOptions& options) {
  const Eigen::Index components = model.componentCount();
  SampleRandom random(options.seed, kTargetStream), breath(options.seed, kBreathStream);
  Eigen::MatrixXd targets = Eigen::MatrixXd::Zero(signedIndex(segments.size()), components);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Eigen::VectorXd target = Eigen::VectorXd::Zero(components);
    for (const SegmentFeature& feature : segments[i].features) {
      const auto known = model.targets.find(feature.name);
      if (known != model.targets.end()) target += feature.weight * known->second;
    }
    if (segments[i].in_speech && options.restore_variance) {
      target -= model.speech_mean;
      target.array() *= model.gain.array();
      target += model.speech_mean;
    }
    if (options.variation > 0) {
      // People breathe in more or less; otherwise the size of the change is that of the component.
      if (segments[i].breath) target *= breath.uniform(0.5, 1.5);
      if (segments[i].in_speech) {
        for (double& value : target) value += options.variation * random.normal();
      }
    }
    targets.row(signedIndex(i)) = target.transpose();
  }
  return targets;
}

/// 0 to 1 in each frame: how far the lips have come into a movement held from about `span.start` to `span.end`.
Eigen::VectorXd heldMovement(const TimeSpan& span, const ActorOptions& options) {
  const Seconds delay = kMovementStages * kClosureTimeConstant;
  Eigen::VectorXd held(signedIndex(options.frame_count));
  for (Eigen::Index frame = 0; frame < held.size(); ++frame) {
    const Seconds time = asReal(frame) / options.frame_rate_hz + delay;
    held(frame) =
        movementStep(time - span.start, kClosureTimeConstant) - movementStep(time - span.end, kClosureTimeConstant);
  }
  return held;
}

/// The opening cannot fall under `floor`, and comes to it as softly as `softness` says, both in mm.
double softlyAbove(double floor, double softness, double opening) {
  const double above = (opening - floor) / softness;
  return above > 30 ? opening : floor + softness * std::log1p(std::exp(above));
}

/// Pulls the lip opening to where a closing phone needs it, and keeps other phones from closing, along the way the
/// components open the lips together.
void closeLips(const ActorModel& model, const std::vector<SpeechSegment>& segments, const ActorOptions& options,
               Eigen::MatrixXd& components) {
  SampleRandom random(options.seed, kClosureStream);
  Eigen::VectorXd opening = components * model.openings();
  const Eigen::VectorXd uncorrected = opening;
  Eigen::VectorXd parted = Eigen::VectorXd::Zero(opening.size());  // 0 to 1: speech that must not close
  for (const SpeechSegment& segment : segments) {
    if (segment.in_speech && !isBilabial(segment.phone)) parted += heldMovement(segment.span, options);
  }
  for (const SpeechSegment& segment : segments) {
    const bool bilabial = isBilabial(segment.phone);
    if (!segment.in_speech || (!bilabial && !isLabiodental(segment.phone))) continue;
    const double spread = kClosureSpreadMm * 10 * options.variation * random.normal();
    const double goal = spread + (bilabial ? model.closures.bilabial_mm : model.closures.labiodental_mm);
    const bool nasal = isNasal(segment.phone);
    const Seconds begin = segment.span.start - (nasal ? 0 : kClosureLead);
    const Seconds end = segment.span.end - (nasal ? 0 : kReleaseLead);
    const Eigen::VectorXd held = heldMovement({begin, std::max(end, begin + kShortestClosure)}, options);
    const double share = bilabial ? 1.0 : kLabiodentalShare;
    opening.array() += share * held.array() * (goal - opening.array());
    if (bilabial) parted.array() *= 1 - held.array();
  }
  for (Eigen::Index frame = 0; frame < opening.size(); ++frame) {
    const double floor = model.closures.contact_mm + parted(frame) * (kPartedMm - model.closures.contact_mm);
    const double softness = kContactSoftnessMm + parted(frame) * (kPartedSoftnessMm - kContactSoftnessMm);
    opening(frame) = softlyAbove(floor, softness, opening(frame));
  }
  components += (opening - uncorrected) * model.closing.transpose();
}

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
  const auto frames = signedIndex(options.frame_count);
  const Seconds duration = asReal(frames) / options.frame_rate_hz;
  Eigen::VectorXd depth = Eigen::VectorXd::Zero(frames);
  // The first one may have begun before the take.
  for (Seconds at = random.uniform(-0.2, kBlinkInterval); at < duration;
       at += kShortestBlinkInterval + random.waiting(kBlinkInterval - kShortestBlinkInterval)) {
    const double size = random.uniform(0.85, 1.0);
    const Seconds shut = kLidsShut * random.uniform(0.8, 1.4);
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      const Seconds time = asReal(frame) / options.frame_rate_hz - at;
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
      const double z = (asReal(frame) / options.frame_rate_hz - middle) / kAccentWidth;
      height(frame) += size * std::exp(-0.5 * z * z);
    }
  }
  return height;
}

}  // namespace

Eigen::MatrixXd actorComponents(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options) {
  std::vector<SpeechSegment> segments = speechSegments(labels);
  if (options.variation > 0) varyTiming(segments, options);
  const Eigen::MatrixXd targets = segmentTargets(model, segments, options);
  Eigen::MatrixXd components(signedIndex(options.frame_count), model.componentCount());
  for (Eigen::Index i = 0; i < model.componentCount(); ++i) {
    const ActorDynamics& dynamics = model.dynamics[unsignedIndex(i)];
    components.col(i) =
        segmentWeights(segments, dynamics.time_constant, dynamics.lead, options.frame_rate_hz, options.frame_count) *
        targets.col(i);
    if (options.variation > 0) {
      components.col(i) += kDriftShare * options.variation *
                           smoothNoise(options.seed, kDriftStream + static_cast<std::uint64_t>(i), kDriftCorrelation,
                                       options.frame_rate_hz, options.frame_count);
    }
  }
  if (options.close_lips) closeLips(model, segments, options, components);
  return components;
}

MotionClip performSpeech(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options) {
  MotionClip clip;
  clip.frame_rate_hz = options.frame_rate_hz;
  clip.marker_names = model.marker_names;
  clip.positions_mm = actorComponents(model, labels, options) * model.component_shapes;
  if (options.expression) clip.positions_mm += actorExpression(model, labels, options);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(model.neutral_mm.data(), model.neutral_mm.size());
  clip.positions_mm.rowwise() += neutral;
  return clip;
}

Eigen::VectorXd smoothNoise(std::uint64_t seed, std::uint64_t stream, Seconds correlation, double frame_rate_hz,
                            std::size_t frame_count) {
  // White noise a tenth of the correlation apart, smoothed by a Gaussian: infinitely smooth, and the same curve at
  // any frame rate.
  const Seconds step = correlation / 10;
  const Seconds reach = 4 * correlation;
  const auto frames = signedIndex(frame_count);
  const auto knots = static_cast<std::size_t>((asReal(frames) / frame_rate_hz + 2 * reach) / step) + 2;
  SampleRandom random(seed, stream);
  std::vector<double> white(knots);
  for (double& value : white) value = random.normal();
  // A Gaussian of deviation s/sqrt(2) gives the correlation exp(-t^2 / (2 s^2)).
  const double deviation = correlation / std::numbers::sqrt2;
  const double norm = std::sqrt(step / (deviation * std::sqrt(std::numbers::pi)));
  Eigen::VectorXd curve = Eigen::VectorXd::Zero(frames);
  for (Eigen::Index frame = 0; frame < frames; ++frame) {
    const Seconds time = asReal(frame) / frame_rate_hz + reach;
    const auto first = static_cast<std::size_t>((time - reach) / step);
    const auto last = std::min(knots - 1, static_cast<std::size_t>((time + reach) / step));
    for (std::size_t knot = first; knot <= last; ++knot) {
      const double z = (time - asReal(knot) * step) / deviation;
      curve(frame) += norm * white[knot] * std::exp(-0.5 * z * z);
    }
  }
  return curve;
}

Eigen::MatrixXd actorExpression(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options) {
  return blinkDepth(options) * model.blink_shape + browHeight(labels, options) * model.brow_shape;
}

}  // namespace mouthpiece
