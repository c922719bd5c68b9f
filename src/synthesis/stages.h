#pragma once

#include <optional>
#include <span>
#include <vector>

#include "synthesis/fragment.h"
#include "synthesis/synthesis.h"
#include "vocal/vocal_style.h"

namespace mouthpiece {

/// Segments that are rendered together: fragments in a row, or curves.
struct Stretch {
  PhoneRange phones;
  std::vector<SelectedUnit> units;             ///< empty: curves
  std::optional<TimeSpan> enters, leaves;      ///< the blends with its neighbours; none at the line's ends
  std::size_t first_frame = 0, end_frame = 0;  ///< of the line: from the one blend to the other, and one beyond
};

/// What the stages of renderPlan() share.
struct LineToRender {
  const SpeechLabels& labels;
  const SynthesisOptions& options;
  const UnitDatabase& database;
  const CurveModel& model;
  std::vector<Seconds> times;  ///< of the frames
  VocalStyle style;
  CurveSet curves;                         ///< of the whole line, before edits
  std::optional<HeardLine> heard;          ///< where a prediction leads and hears the line's sound
  TakePredictions* predictions = nullptr;  ///< those of an earlier piece of the line

  [[nodiscard]] Seconds overlap() const { return options.overlap_ms / 1000; }
  [[nodiscard]] std::span<const Seconds> timesOf(const Stretch& stretch) const {
    return std::span(times).subspan(stretch.first_frame, stretch.end_frame - stretch.first_frame);
  }
  [[nodiscard]] Eigen::Map<const Eigen::RowVectorXd> rest() const {
    const MarkerPositions& neutral = database.corpus().neutral_pose_mm;
    return {neutral.data(), neutral.size()};
  }
};

/// Fragments and curves by turns.
std::vector<Stretch> stretchesOf(const SynthesisPlan& plan, const LineToRender& line);

/// What moves the lips and the chin, of all their movement: frames x columns of UnitDatabase::lipColumns(), mm from the
/// neutral pose. What these leave is drawn by curves.
struct MovementParts {
  PositionMatrix predicted_mm, captured_mm, contact_mm;

  static MovementParts none(Eigen::Index frames, Eigen::Index columns);
  /// Rows from `first` on become those of `other`.
  void lay(std::size_t first, const MovementParts& other);
  void scaleFrame(std::size_t frame, double share);
};

/// A stretch's own frames, or the line's: frames x (3 * markers), mm.
struct StretchMotion {
  PositionMatrix positions_mm;  ///< no NaN
  std::vector<Seconds> joins;   ///< middles of the blends
  MovementParts parts = {};
};
/// EDGE 5.1.2 and 5.1.3: the units' fragments warped, resampled at `times` and blended; NaN where none was seen. With
/// `residual` less their takes' prediction (Fragment).
StretchMotion blendUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                         const LineToRender& line, bool residual);
/// Of each stretch with units: fragments warped, resampled, blended, moved into context. Empty for curves.
std::vector<StretchMotion> renderCaptured(const std::vector<Stretch>& stretches, const LineToRender& line);

/// The whole line: between the captured stretches the curves, led to meet the captured poses at both joins (the offset
/// fades out over at most 0.4 s; contacts are kept) and blended with them inside the shared phones.
StretchMotion fillWithCurves(const std::vector<Stretch>& stretches, std::vector<StretchMotion> captured,
                             const LineToRender& line);

/// The captured motion of consonants over the curves' vowels, where Ma is low (VOCAL 3.3).
StretchMotion layerConsonants(StretchMotion captured, const LineToRender& line);

/// Of each second of the line, the shares of the parts (MovementShares).
std::vector<MovementShares> sharesOf(const StretchMotion& whole, const LineToRender& line);

/// Moves the mouth as the dials have it, within what it can reach. Where the lips met they meet. Returns the number of
/// frames that were held.
std::size_t turnDials(const SpeechDials& dials, const LineToRender& line, PositionMatrix& positions);
/// Where `positions` differ from `before` they are held within twice the widest pose that the curves know; or, if that
/// is farther, the chin within a quarter more than its farthest in the line, and the lips within twice as far as
/// before. Returns the number of frames that were held.
std::size_t keepWithinReach(const PositionMatrix& before, const LineToRender& line, PositionMatrix& positions);
/// Adds the mood's pose. Where the lips met they meet, and lids that close close.
void addMood(const MoodPose& mood, const LineToRender& line, PositionMatrix& positions);
MouthFacts mouthFacts(const MotionClip& motion, const LineToRender& line);

/// What an animator changed in the curves is added to whatever moves the face.
PositionMatrix withCurveEdits(PositionMatrix positions, const CurveSet& edited, const LineToRender& line);

}  // namespace mouthpiece
