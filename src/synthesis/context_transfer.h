#pragma once

#include <span>
#include <vector>

#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// How captured fragments are moved from the context that they were captured in to the line's
/// (docs/theory/units/prediction.md). The defaults were set on development takes; `corpus evaluate --ablation` turns each
/// off.
struct ContextOptions {
  bool enabled = true;            ///< viterbi in a corpus with a trajectory model
  Seconds detail_within = 0.050;  ///< slower than this Gaussian (standard deviation) is predicted, faster is captured
  double slow_captured = 0;       ///< share of the fragments' own slow difference to the prediction
  double first_detail = 1.33;     ///< share of captured detail along the first component, which opens the mouth
  double other_detail = 0.7;      ///< along all others: there the tracker's noise is as large
  bool average = true;            ///< adds contextMean(): what like places of the corpus have in common
  bool restore_variance = true;   ///< TrajectoryModel::gain
  bool keep_contacts = true;      ///< keepContacts()
};

/// Prediction for the line plus what the fragments bring: `residuals` are their blended poses less their own takes'
/// prediction, times x (3 * markers); what was not seen (NaN) counts as nothing. Columns that no component moves keep
/// their residual. `times` are evenly spaced. With keep_contacts those of `units` are kept.
PositionMatrix transferContext(const PositionMatrix& residuals, const SpeechLabels& line, const UnitDatabase& database,
                               const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                               const ContextOptions& options);

/// Lips that closed in the capture close: in each B P M of the line the frame with the least opening is brought to that
/// of the fragments there, or to the speaker's usual closure where they stay open, and the frames around it with it. In
/// each F V the frame with the highest lower lip is brought as near to the teeth as the fragments were.
PositionMatrix keepContacts(PositionMatrix positions, const SpeechLabels& line, const UnitDatabase& database,
                            const std::vector<SelectedUnit>& units, std::span<const Seconds> times);

}  // namespace mouthpiece
