#pragma once

#include <optional>
#include <span>
#include <vector>

#include "synthesis/fragment.h"
#include "synthesis/join.h"
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
  RecentJoins* recent_joins = nullptr;     ///< the same
  Seconds origin = 0;                      ///< of the labels' clock on that of all pieces

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
/// Units' fragments and how they are joined, found out once, for a line whose rows are made some at a time. Refers to
/// the line's labels and database.
class JoinedUnits {
 public:
  JoinedUnits(const std::vector<SelectedUnit>& units, const LineToRender& line, bool residual);
  /// Rows [first, end) of blendUnits().
  [[nodiscard]] PositionMatrix rows(std::span<const Seconds> times, std::size_t first, std::size_t end) const;
  /// Of the blends between two units.
  [[nodiscard]] std::vector<Seconds> middles() const;

 private:
  BlendKind blend_;
  const MarkerLayout& layout_;
  const SpeechLabels& labels_;
  std::vector<UnitFragment> fragments_;
  std::vector<JoinSpans> joins_;
  bool leads_offsets_away_ = false;
};

/// EDGE 5.1.2 and 5.1.3: the units' fragments warped, resampled at `times` and blended; NaN where none was seen. With
/// `residual` less their takes' prediction (Fragment).
StretchMotion blendUnits(const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                         const LineToRender& line, bool residual);
/// Whether the fragments are moved from their takes' context into the line's. A take's own sentence in its own time is
/// not: nothing makes it better than it was captured.
bool movesIntoContext(const std::vector<SelectedUnit>& units, const LineToRender& line);
PositionMatrix columnsOf(const PositionMatrix& positions, const std::vector<Eigen::Index>& columns);
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

/// A line's plan with an animator's units in it, what does not apply of them, and how long it took.
struct PlannedLine {
  SynthesisPlan plan;
  std::vector<std::string> warnings;
  double took_ms = 0;
};
/// Throws as planLine() does, and for a request that cannot be rendered.
PlannedLine planRequest(const SynthesisRequest& request, const UnitDatabase& database);
void tellPlanning(const PlannedLine& planned, UtteranceAnimation& made);

/// The frames of a line as long as the longest of labels, audio and sound_lasts.
std::vector<Seconds> frameTimesOf(const SynthesisRequest& request);
/// All that is told of a line but its motion and what is told of that: with as many frames, of no markers, as the line
/// has. Of the settings those of the method.
UtteranceAnimation describedLine(const SynthesisPlan& plan, const SynthesisRequest& request, const LineToRender& line);
/// The same with curves, eyes and head, of a line whose motion comes later.
UtteranceAnimation describedLongLine(const SynthesisPlan& plan, const SynthesisRequest& request,
                                     const UnitDatabase& database);
std::optional<HeardLine> heardIn(const SynthesisRequest& request, const Corpus& corpus);
/// What of it a report tells; `lips_moved_mm`: by it, root mean square of a marker.
std::vector<SettingUsed> heardSettings(const HeardLine& heard, double lips_moved_mm);
/// Squares of how far the sound moves the lips at `times`, summed over them and the columns of the lips.
double movedBySound(const HeardLine& heard, const UnitDatabase& database, std::span<const Seconds> times);

/// Moves the mouth as the dials have it, within what it can reach. Where the lips met they meet. Returns the number of
/// frames that were held.
std::size_t turnDials(const SpeechDials& dials, const LineToRender& line, PositionMatrix& positions);
/// Where `positions` differ from `before` they are held within twice the widest pose that the curves know; or, if that
/// is farther, the chin within a quarter more than its farthest in the line, and the lips within twice as far as
/// before. Returns the number of frames that were held.
std::size_t keepWithinReach(const PositionMatrix& before, const LineToRender& line, PositionMatrix& positions);
/// Adds the mood's pose. Where the lips met they meet, and lids that close close.
void addMood(const MoodPose& mood, const LineToRender& line, PositionMatrix& positions);
/// Lids at rest: where fragments that were chosen for the mouth are joined they would bring halves of blinks.
void restLids(const LineToRender& line, PositionMatrix& positions);

/// What an animator changed in the curves is added to whatever moves the face.
PositionMatrix withCurveEdits(PositionMatrix positions, const CurveSet& edited, const LineToRender& line);

}  // namespace mouthpiece
