#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "motion/lip_gauge.h"
#include "motion/marker_layout.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "vocal/animation_curve.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// How an actor's markers move when a viseme is fully reached (curve 1), jaw and lip parts apart:
/// displacement = sum over visemes of Ja * jaw curve * jaw_drop * jaw_direction + Li * lip curve * lips row.
struct VisemePoses {
  std::vector<std::string> marker_names;
  LipGauge mouth;                               ///< of those markers
  Eigen::RowVectorXd jaw_direction;             ///< mm of every marker coordinate as the chin sinks by 1 mm
  std::array<double, kVisemeCount> jaw_drop{};  ///< mm that the chin sinks; negative where it rises
  PositionMatrix lips;                          ///< kVisemeCount x (3 * markers), mm
  std::array<double, kVisemeCount>
      frames_seen{};  ///< sum of the viseme's curve over the frames learnt from; 0: generic
  /// mm of every marker coordinate as the lips open by 1 mm, and how far they are open (vertically, beyond the
  /// neutral pose) in B P M, in F V, and when pressed together.
  Eigen::RowVectorXd opening_direction;
  double bilabial_mm = 0, labiodental_mm = 0, contact_mm = 0;
  double face_width_mm = 0;  ///< between the outer canthi; 0: without them

  /// Of the motion learnt from: all markers' variance about the neutral pose, and of it what the poses explain.
  double variance_mm2 = 0, explained_mm2 = 0;
  double lip_variance_mm2 = 0, lip_explained_mm2 = 0;  ///< the same of lip and chin markers
  [[nodiscard]] double explainedShare() const { return variance_mm2 > 0 ? explained_mm2 / variance_mm2 : 0; }
  [[nodiscard]] double lipExplainedShare() const {
    return lip_variance_mm2 > 0 ? lip_explained_mm2 / lip_variance_mm2 : 0;
  }
};

/// One take to learn from; both must outlive the call.
struct PoseTake {
  const SpeechLabels* labels = nullptr;
  const MotionClip* motion = nullptr;
};

struct PoseFitOptions {
  double ridge_frames = 3;       ///< shrinks the poses of visemes that are rarely seen
  double least_frames_seen = 8;  ///< below it the pose is the generic one
};

/// Ridge regression of the takes' motion on their speech curves: first the chin's height on the jaw curves, then what
/// the jaw leaves on the lip curves. Visemes the takes lack come from `generic` by marker name (null: from visemes
/// that look alike), scaled by the faces' widths. Throws InputError when the layout lacks lips or a chin, or nothing
/// was seen.
VisemePoses fitVisemePoses(const std::vector<PoseTake>& takes, const MarkerPositions& neutral_mm,
                           const MarkerLayout& layout, const VisemePoses* generic, const PoseFitOptions& options = {});

/// Learnt from GRID s1 (sample_data/visemes/generic_poses.json, built in; docs/theory/vocal/vocal.md).
const VisemePoses& genericPoses();

/// The markers' displacements from the neutral pose at rising `times`: times x (3 * markers), mm. Lips do not pass
/// through each other.
PositionMatrix displacementsFromCurves(const CurveSet& curves, const VisemePoses& poses, const StyleSignal& ja,
                                       const StyleSignal& li, const std::vector<Seconds>& times);

/// `displacements` (as above, of any origin) with the lips led to a contact wherever the curves ask for one: to closed
/// lips by MBP, to the teeth by FV, and never further together than pressed. Moves along the poses' opening direction.
PositionMatrix withContacts(const CurveSet& curves, const VisemePoses& poses, const std::vector<Seconds>& times,
                            PositionMatrix displacements);

std::string posesToJson(const VisemePoses& poses, std::string_view credit = {});
/// Throws InputError, with `file` in front, for JSON that holds no poses or contradicts itself.
VisemePoses parsePoses(std::string_view json_text, std::string_view file);

}  // namespace mouthpiece
