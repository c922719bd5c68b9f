#pragma once

#include <optional>
#include <span>
#include <vector>

#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// How captured fragments are moved from the context that they were captured in to the line's
/// (docs/theory/units/prediction.md). The defaults were set on development takes; `corpus evaluate --ablation` turns
/// each off.
struct ContextOptions {
  bool enabled = true;                          ///< viterbi in a corpus with a trajectory model
  bool fragments = true;                        ///< off: the prediction alone moves the face
  std::optional<MotionSettings> settings = {};  ///< none: those of the corpus
  bool average = true;                          ///< adds contextMean(): what like places of the corpus have in common
  bool restore_variance = true;                 ///< TrajectoryModel::gain
  bool restore_unsaid = true;                   ///< what nobody said moves as far as it would
  bool keep_contacts = true;                    ///< keepContacts()
  bool keep_heard = true;                       ///< where a fragment's own sound is heard its lips are as captured
  bool hear = false;                            ///< what the line's sound says beyond its phones joins the prediction
};

/// A line's motion, and of what it is made up besides the neutral pose: times x (3 * markers), mm.
struct TransferredMotion {
  PositionMatrix positions_mm;
  PositionMatrix predicted_mm;  ///< of it, what the model predicts
  PositionMatrix captured_mm;   ///< what the fragments bring; what is left are the contacts

  /// What is left, of these columns.
  [[nodiscard]] PositionMatrix contactMm(const MarkerPositions& neutral_mm,
                                         const std::vector<Eigen::Index>& columns) const;
};

/// Prediction for the line plus what the fragments bring: `residuals` are their blended poses less their own takes'
/// prediction, times x (3 * markers); what was not seen (NaN) counts as nothing. Columns that no component moves keep
/// their residual. `times` are evenly spaced. `heard`: the line's sound, where it shall be heard. With keep_contacts
/// those of `units` are kept.
TransferredMotion transferContext(PositionMatrix residuals, const SpeechLabels& line, const UnitDatabase& database,
                                  const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                                  const ContextOptions& options, const HeardLine* heard = nullptr);

/// Lips that closed in the capture close: in each B P M of the line the frame with the least opening is brought to that
/// of the fragments there, or to the speaker's usual closure where they stay open, and the frames around it with it. In
/// each F V the frame with the highest lower lip is brought nearer to the teeth, by that share of what it lacks to
/// where the fragments were.
PositionMatrix keepContacts(PositionMatrix positions, const SpeechLabels& line, const UnitDatabase& database,
                            const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                            const MotionSettings& settings = {});

}  // namespace mouthpiece
