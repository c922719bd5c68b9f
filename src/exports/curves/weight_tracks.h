#pragma once

#include <string>
#include <vector>

#include "exports/shapes/principal_shapes.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Values of named shapes over time. Frame k is at k / frame_rate_hz.
struct WeightTracks {
  double frame_rate_hz = 0;
  std::vector<std::string> names;
  RowMajorMatrixF weights;  ///< frames x names, 0 to 1
};

/// The 15 visemes of Oculus (Meta) and others: "sil" "PP" ... "ou", from the phones and their times; each frame's
/// weights add up to 1. Neighbours fade into each other; B P M are PP alone at their middle.
WeightTracks oculusVisemes(const SpeechLabels& labels, Eigen::Index frames, double frame_rate_hz);

/// VRM 1.0's expressions of the mouth, "aa" "ih" "ou" "ee" "oh", made of the visemes.
WeightTracks vrmMouth(const WeightTracks& visemes);

/// A drawn mouth of Rhubarb Lip Sync: 'A' to 'H', or 'X' at rest (docs/formats/mouth_cues.md).
struct MouthCue {
  TimeSpan span;
  char shape = 'X';
};

/// What is to be drawn when: without gaps, neighbours differ, times in hundredths of a second.
std::vector<MouthCue> mouthCues(const SpeechLabels& labels);

}  // namespace mouthpiece
