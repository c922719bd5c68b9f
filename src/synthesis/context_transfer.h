#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "units/prediction/phone_shapes.h"
#include "units/prediction/trajectory_model.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// How captured fragments are moved from the context that they were captured in to the line's
/// (docs/theory/units/context_transfer.md). The defaults were set on development takes; `corpus evaluate --ablation`
/// turns each off.
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
  std::shared_ptr<const PredictedLine> predicted = {};  ///< of this line; null: it is made
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

/// transferContext() of a line whose rows are made some at a time: what is found out once about all of it.
class LineTransfer {
 public:
  /// All that is given must outlive this; `heard` may be null.
  LineTransfer(const SpeechLabels& line, const UnitDatabase& database, std::span<const Seconds> times,
               const ContextOptions& options, const HeardLine* heard);

  /// Residuals so many rows before and after a row have a share in it.
  [[nodiscard]] std::size_t reach() const { return reach_; }
  /// Rows [first, end) without contacts; `residuals` are those of rows [first - reach(), end + reach()) of the line, as
  /// far as it has such.
  [[nodiscard]] TransferredMotion rows(PositionMatrix residuals, std::size_t first, std::size_t end) const;

 private:
  [[nodiscard]] Eigen::MatrixXd componentsAt(std::span<const Seconds> times) const;
  void moveUnsaid(std::span<const Seconds> times, Eigen::MatrixXd& components) const;

  const UnitDatabase& database_;
  std::span<const Seconds> times_;
  const ContextOptions& options_;
  const HeardLine* heard_;
  MotionSettings settings_;
  Seconds spacing_;
  std::size_t reach_;
  std::shared_ptr<const PredictedLine> predicted_;
  Eigen::MatrixXd mean_;  ///< contextMean(), at mean_times_; empty: is not added
  std::vector<Seconds> mean_times_, middles_;
  Eigen::MatrixXd unsaid_, closes_;  ///< at middles_, the phones': 1 where a pair is unsaid, and where lips close
};

/// Lips that closed in the capture close: in each B P M of the line the frame with the least opening is brought to that
/// of the fragments there, or to the speaker's usual closure where they stay open, and the frames around it with it. In
/// each F V the frame with the highest lower lip is brought nearer to the teeth, by that share of what it lacks to
/// where the fragments were.
PositionMatrix keepContacts(PositionMatrix positions, const SpeechLabels& line, const UnitDatabase& database,
                            const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                            const MotionSettings& settings = {});

/// keepContacts() of rows that are made one after the other. All that is given must outlive this.
class ContactKeeper {
 public:
  ContactKeeper(const SpeechLabels& line, const UnitDatabase& database, const std::vector<SelectedUnit>& units,
                std::span<const Seconds> times, const MotionSettings& settings);

  /// Keeps the contacts from the last kept one on that `positions`, rows of the line from `first` on, hold wholly.
  /// Returns the row up to which nothing changes any more: the next call's rows begin there or before.
  std::size_t keep(std::size_t first, PositionMatrix& positions);

 private:
  const SpeechLabels& line_;
  const UnitDatabase& database_;
  const std::vector<SelectedUnit>& units_;
  std::span<const Seconds> times_;
  MotionSettings settings_;
  Eigen::RowVectorXd way_of_lower_lip_;
  std::size_t next_ = 0;  ///< phone
};

}  // namespace mouthpiece
