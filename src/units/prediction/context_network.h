#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/time.h"
#include "phonetics/labels/speech_labels.h"
#include "units/prediction/speech_segments.h"

namespace mouthpiece {

/// Windows before and after a moment through which a ContextNetwork sees what is said: raised cosines, narrow beside it
/// and wide further away, to 240 ms. Neighbours overlap, so that what is seen changes smoothly.
inline constexpr Eigen::Index kContextWindows = 13;
/// Further from a moment than this nothing is seen: the widest window's edge.
inline constexpr Seconds kContextReach = 0.31;

/// A stretch of speech or silence in numbers: what the mouth does in it (height, backness, rounding, place, manner),
/// how long it is, stress, speaking rate, its place in word and phrase, and the sound itself. Sounds that are made
/// alike have like numbers, so that a phone or pair that nobody has said is placed by those that somebody has.
struct ContextSegment {
  TimeSpan span;
  std::vector<std::pair<Eigen::Index, float>> features;  ///< number, value; others are 0
};

/// Names of the features in their order: what a network's rows mean, and what its file must agree with.
std::span<const std::string_view> contextFeatureNames();

/// The features of how and where a phone, or a half of a diphthong, is made: those of ContextSegment before the
/// silences.
Eigen::VectorXf articulationOf(Phone phone, bool second_half);

/// Diphthongs are two segments; silences are cut as in speechSegments().
std::vector<ContextSegment> contextSegments(const SpeechLabels& labels, const SilenceTiming& timing = {});

/// How much of `segment` each window holds, at `time`: numbers of windows and their shares, none of them zero.
void windowShares(const TimeSpan& segment, Seconds time, std::vector<std::pair<Eigen::Index, float>>& shares);

/// What is seen of a line at some times, all networks alike.
struct ContextView {
  struct Share {
    Eigen::Index time, segment, window;  ///< numbers
    float share;
  };
  Eigen::Index time_count = 0;
  std::vector<Share> shares;  ///< by time, then by segment
};
ContextView contextView(const std::vector<ContextSegment>& segments, std::span<const Seconds> times);

/// A perceptron with one hidden layer: components of the speaking face from what is said within 240 ms of a moment
/// (docs/theory/units/prediction.md). Fitted by corpus_tools/building/prediction_parts.h.
struct ContextNetwork {
  using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Matrix input;             ///< features x (windows * hidden), hidden side by side
  Eigen::RowVectorXf bias;  ///< hidden
  Matrix output;            ///< hidden x components, mm

  [[nodiscard]] Eigen::Index hiddenCount() const { return output.rows(); }
  [[nodiscard]] Eigen::Index componentCount() const { return output.cols(); }

  /// What each segment gives to each hidden unit through each window: segments x (windows * hidden).
  [[nodiscard]] Matrix given(const std::vector<ContextSegment>& segments) const;
  /// times x components; `given` of the segments that are viewed.
  [[nodiscard]] Eigen::MatrixXd at(const ContextView& view, const Matrix& given) const;
};

}  // namespace mouthpiece
