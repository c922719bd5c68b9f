#pragma once

#include <cstddef>

#include "expression/beats.h"
#include "expression/expression.h"

namespace mouthpiece {

/// Blinks and gaze of a face whose words are not known yet: drawn as time passes, by the seed alone, so that the same
/// seed gives the same frames whatever is said. What goes with words (brows, nods, a look aside where a phrase begins,
/// blinks in pauses) is not here. For one thread.
class LiveFace {
 public:
  struct Pose {
    double closed = 0;  ///< of the lids, 0 to 1
    GazeTurn gaze;
  };
  /// Throws InputError for what cannot be known ahead of the words: a captured upper face, head motion, a mood.
  LiveFace(const ExpressionOptions& options, double frame_rate_hz);

  [[nodiscard]] bool blinks() const { return blinks_; }
  [[nodiscard]] bool looks() const { return looks_; }
  /// The next frame's; frames follow each other from 0 s on.
  Pose next();

 private:
  struct Look {
    Seconds start = 0;
    double yaw = 0, pitch = 0;  ///< degrees
  };
  [[nodiscard]] double closedAt(Seconds time);
  [[nodiscard]] GazeTurn gazeAt(Seconds time);

  bool blinks_, looks_;
  double rate_hz_;
  Dice blink_dice_, gaze_dice_;
  std::size_t frame_ = 0;
  std::size_t steps_ = 0;  ///< of the drawing of blinks
  Seconds blink_;          ///< when the last one began
  Look from_, to_;
  Seconds next_look_;
  bool is_aside_ = false;
};

}  // namespace mouthpiece
