#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// How fast the face moves into a segment, relative to the time constants of the components.
enum class SegmentPace { kSpeech, kClosure, kSilence };

/// A feature of a segment and how much of it there is.
struct SegmentFeature {
  std::string name;
  double weight = 1;
};

/// A stretch with one target: a phone, a half of a diphthong, or a part of a silence. The target is the weighted sum of
/// the model's contributions of its features; features the model does not know add nothing.
struct SpeechSegment {
  TimeSpan span;
  Phone phone = Phone::kSil;
  std::size_t label = 0;        ///< of SpeechLabels::phones
  bool is_second_half = false;  ///< of a diphthong
  bool in_speech = false;       ///< neither silence nor breath
  bool breath = false;          ///< the end of a silence, when the mouth opens to breathe in and to begin
  SegmentPace pace = SegmentPace::kSpeech;
  std::vector<SegmentFeature> features;
};

/// When the mouth moves in silence (docs/theory/units/prediction.md): learnt from a corpus' own silences where it has
/// enough of them (corpus_tools/building/prediction_parts.h).
struct SilenceTiming {
  Seconds breath_at_half_second = 0.35;  ///< how long before speech the mouth opens, in a silence of 0.5 s
  double breath_share = 0;               ///< of what the silence lasts beyond that
  Seconds least_breath = 0.35, most_breath = 0.35;
  /// In pauses the lips settle as after the line, rest, and open as before it; off in files from before that was so,
  /// whose models know pauses as half way to a neutral vowel.
  bool pauses_settle = true;

  /// How long before speech the mouth opens in a silence of that length; may be longer than it.
  [[nodiscard]] Seconds breathIn(Seconds silence) const;
  bool operator==(const SilenceTiming&) const = default;
};

/// Cuts labels into segments. Features of a phone: its viseme, the phone itself, and its viseme together with that of
/// the neighbours up to two away; diphthongs are two segments. HH has the viseme of what follows, ER is half R, half
/// Uh. Silences are cut into relaxation (not the first), rest and breath (not the last); rest has no features: its
/// target is the neutral pose. Those of a pause have a feature more, which the others lack.
std::vector<SpeechSegment> speechSegments(const SpeechLabels& labels, const SilenceTiming& timing = {});

/// The response, 0 to 1, of four equal first-order stages at `time` after their input steps up: starts and ends softly
/// (three continuous derivatives), and critically damped, so never overshoots.
double movementStep(Seconds time, Seconds time_constant);
inline constexpr int kMovementStages = 4;

/// How much segment i holds of one component at time t: weight_i = step_i - step_(i+1), where step_i is the movement
/// into segment i, half done at its start less `lead`. Weights sum to 1 at every time. Returns times x segments.
Eigen::MatrixXd segmentWeights(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                               std::span<const Seconds> times);
/// The same for frames at k / frame_rate_hz.
Eigen::MatrixXd segmentWeights(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                               double frame_rate_hz, std::size_t frame_count);

/// segmentWeights() times `targets` (segments x components), without the weights: time and memory grow with the line,
/// not with its square.
Eigen::MatrixXd segmentResponse(const std::vector<SpeechSegment>& segments, Seconds time_constant, Seconds lead,
                                std::span<const Seconds> times, const Eigen::MatrixXd& targets);

}  // namespace mouthpiece
