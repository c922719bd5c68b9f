#pragma once

#include <memory>
#include <span>
#include <vector>

#include "motion/motion_clip.h"
#include "motion/time_warp.h"
#include "units/prediction/trajectory_model.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// The predictions of the takes that were asked for last, for lines that are rendered piece by piece. Not thread-safe.
class TakePredictions {
 public:
  std::shared_ptr<const LinePrediction> of(const UnitDatabase& database, TakeIndex take);

 private:
  struct Kept {
    TakeIndex take;
    std::shared_ptr<const LinePrediction> prediction;
  };
  std::vector<Kept> kept_;  ///< the latest last
};

/// A stretch of a take without a pause inside it, carried to its place in the utterance. A piecewise linear map moves
/// its phone boundaries onto the line's (EDGE 5.1.2). A silence at its end is not stretched but runs at the speed that
/// it was captured at, counted from the speech beside it; where the line's silence outlasts it, the face comes to rest
/// and relaxes to the neutral pose.
class Fragment {
 public:
  /// Phones `target` of the line from the take phones that begin at `source`. With the `prediction` for the take poses
  /// are what is left of the captured ones when it is taken off (zero where the face rests), and lips close at the
  /// captured speed. With `stretch_silences` a silence is a phone as any other (EDGE as published).
  Fragment(const SpeechLabels& line, const PhoneRange& target, const UnitDatabase& database, const PhonePlace& source,
           std::shared_ptr<const LinePrediction> prediction = nullptr, bool stretch_silences = false);

  /// Poses at `times` of the line (not falling): times x (3 * markers), mm. NaN where the capture saw nothing.
  [[nodiscard]] PositionMatrix posesAt(std::span<const Seconds> times) const;
  /// Lip and chin columns at one time, straight between captured frames: for comparing, not for showing.
  [[nodiscard]] Eigen::RowVectorXd lipsAt(Seconds time) const;
  /// The same at many times, a row each.
  [[nodiscard]] PositionMatrix lipsAt(std::span<const Seconds> times) const;
  /// The same as captured, whatever the poses are.
  [[nodiscard]] PositionMatrix capturedLipsAt(std::span<const Seconds> times) const;
  /// lipsAt() of the same times, from what capturedLipsAt() gave.
  [[nodiscard]] PositionMatrix lipsOfCaptured(PositionMatrix lips, std::span<const Seconds> times) const;

  [[nodiscard]] const PhoneRange& phones() const { return target_; }
  /// Of the line: where the capture may be read.
  [[nodiscard]] const TimeSpan& usable() const { return usable_; }
  /// The take phone that plays the first of them.
  [[nodiscard]] PhonePlace source() const { return {take_index_, source_first_}; }
  [[nodiscard]] double captureRateHz() const { return rate_hz_; }
  /// The take's phone that plays `target`, a phone of the line.
  [[nodiscard]] const LabelledPhone& sourcePhone(PhoneIndex target) const;

 private:
  [[nodiscard]] std::vector<Seconds> withinUsable(std::span<const Seconds> times) const;
  void relaxBeyond(std::span<const Seconds> times, PositionMatrix& poses) const;
  [[nodiscard]] Eigen::RowVectorXd edgeVelocity(Seconds edge, double inward) const;
  [[nodiscard]] PositionMatrix capturedPoses(std::span<const Seconds> times) const;
  [[nodiscard]] Eigen::MatrixXd predictedComponents(std::span<const Seconds> times) const;
  [[nodiscard]] PositionMatrix predictedPoses(std::span<const Seconds> times) const;

  /// The take's motion is asked for at each use: a long line has more fragments than motions that memory holds.
  [[nodiscard]] std::shared_ptr<const MotionClip> motion() const { return database_->motionOf(take_index_); }

  const UnitDatabase* database_;
  TakeIndex take_index_;
  const CorpusTake* take_;
  double rate_hz_ = 0;  ///< of the capture
  PhoneRange target_;
  PhoneIndex source_first_;
  TimeWarp warp_;
  TimeSpan usable_;
  std::shared_ptr<const LinePrediction> prediction_;  ///< for the take; null: poses are as captured
};

/// The units' fragments in order, each unit cut at the pauses inside it unless silences are stretched; `unit` says
/// whose they are. With `residual` (needs a trajectory model) each has its take's prediction, one of `predictions`
/// where there are such.
struct UnitFragment {
  Fragment fragment;
  std::size_t unit = 0;
};
std::vector<UnitFragment> cutIntoFragments(const SpeechLabels& line, const UnitDatabase& database,
                                           const std::vector<SelectedUnit>& units, bool residual = false,
                                           bool stretch_silences = false, TakePredictions* predictions = nullptr);

}  // namespace mouthpiece
