#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "synthesis/synthesis.h"

namespace mouthpiece {

/// Some frames of a line's motion, in order: the head still, no NaN.
struct MotionPiece {
  std::size_t first_frame = 0;
  PositionMatrix positions_mm;  ///< frames x (3 * markers)
};

/// What a report tells of a line's motion: fields of UtteranceAnimation.
struct MotionTold {
  std::vector<Join> joins;
  std::vector<MovementShares> shares;
  MouthFacts mouth;
  std::vector<SettingUsed> settings;  ///< besides those that are known before: what was heard
};

/// The motion of a line that is planned, made as often as it is asked for, some frames at a time, so that an hour takes
/// no more memory than a minute: what renderPlan() makes of the same plan, but for the rounding of sums (1e-9 mm).
class LineMotion {
 public:
  static constexpr Seconds kPiece = 60;

  /// Whether a plan is of the kind that can be made so: captured fragments all along that are moved into the line's
  /// context, without dials, edits of curves, fragments' own sound or an upper face of its own. All else needs the
  /// whole line at once.
  static bool canMake(const SynthesisPlan& plan, const SynthesisRequest& request, const UnitDatabase& database);

  /// `sound`: the line's, heard when motion is asked for first; it and `database` must outlive this. canMake() holds.
  LineMotion(SynthesisPlan plan, SynthesisRequest request, const UnitDatabase& database, const AudioClip& sound,
             Seconds piece = kPiece);
  ~LineMotion();

  /// Calls `take` with all frames in order. One at a time: not thread-safe.
  MotionTold forEachPiece(const std::function<void(const MotionPiece&)>& take);
  /// Frees what all pieces are made of (of an hour 75 MB); it is made again when pieces are asked for.
  void release();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A line whose motion may be left for later.
struct SynthesisedLine {
  UtteranceAnimation animation;        ///< where `motion` is left, with as many frames as the line has, of no markers
  std::unique_ptr<LineMotion> motion;  ///< null: the animation has it
};

/// synthesise(), but the motion of lines over LineMotion::kPiece is left to be made piece by piece, where it can be.
/// `sound` stands for request.audio, and must outlive the result as `database` must.
SynthesisedLine synthesiseForPieces(SynthesisRequest request, const UnitDatabase& database, const AudioClip& sound);

}  // namespace mouthpiece
