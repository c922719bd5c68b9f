#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "motion/arkit_shapes.h"
#include "motion/head_pose.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

// What a face does beside speaking (docs/theory/expression.md).

/// What moves lids, brows and forehead.
enum class UpperFaceSource {
  kMouth,     ///< brows by the fragments that move the mouth, lids at rest
  kCaptured,  ///< stretches of the corpus, chosen for them by stress, phrase and pause
  kRules,     ///< blinks and brows drawn at random by rates from the literature
  kBest       ///< captured where the corpus' lids move, else rules
};

/// A pose that lies over all of a line: weights of ARKit's 52 shapes, each in [0, 1].
using MoodPose = std::array<double, 52>;
/// "anger" "disgust" ...
std::vector<std::string_view> moodNames();
/// One of moodNames(), or a file of JSON with weights by ARKit's names (ends in .json); after a colon how strong it is,
/// 0 to 1 (1 without one). Throws InputError.
MoodPose moodOf(const std::string& wish);

struct ExpressionOptions {
  UpperFaceSource upper_face = UpperFaceSource::kMouth;
  bool gaze = false;
  bool head = false;
  MoodPose mood = {};      ///< all zero: none
  std::uint32_t seed = 1;  ///< of all that is drawn at random: the same seed, the same face

  [[nodiscard]] bool hasMood() const;
};

struct LineExpression {
  std::string upper_face;       ///< "captured" "rules", or "" where the mouth's fragments move it
  PositionMatrix upper_mm;      ///< frames x (3 * markers), where `upper_face` is not "": of upperFaceColumns() alone
  std::vector<Seconds> blinks;  ///< when lids begin to close, by rules
  std::size_t stretches = 0;    ///< captured ones
  std::vector<GazeTurn> gaze;   ///< one a frame, or none
  std::vector<HeadTurn> head;   ///< the same
  std::vector<std::string> warnings;
};

/// Whether `text` (UTF-8) ends as a question: a question mark of any script stands behind its last word.
bool isQuestion(std::string_view text);

/// What the upper face, the eyes and the head do in a line, at `times` (rising, evenly spaced). `asks`: its text is a
/// question. Throws InputError when the upper face shall be captured and the corpus has none.
LineExpression expressionOf(const SpeechLabels& labels, bool asks, std::span<const Seconds> times,
                            const UnitDatabase& database, const ExpressionOptions& options);

/// What shapes do to the markers of `layout`: a row a row of `weights` (52 columns), 3 * markers columns, mm. A blink
/// closes the lids of `neutral_mm`. Markers of other names than the default layout's stay.
PositionMatrix shapeDisplacements(const Eigen::Ref<const PositionMatrix>& weights, const MarkerLayout& layout,
                                  const MarkerPositions& neutral_mm);

}  // namespace mouthpiece
