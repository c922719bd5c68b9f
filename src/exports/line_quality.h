#pragma once

#include <cstddef>
#include <span>

#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// What speaks for and against a line, to find among thousands those worth a look.
struct LineQuality {
  double backoff_share = 0;       ///< of the pairs of phones: no capture made them
  std::size_t closures = 0;       ///< B P M of the line
  std::size_t closures_made = 0;  ///< of these, in which the lips come within kClosureMm of the actor's closed lips
  double jitter_mm = 0;  ///< RMS distance of the lip and chin markers in a frame from the middle of where they are in
                         ///< the frames beside it: fast speech has some, a torn curve much
  double doubt = 0;      ///< 0 to 1: 1 less the product of captured share, share of closures made, mean confidence of
                         ///< what was recognised, and 0.8 for each warning
};

inline constexpr double kClosureMm = 1.0;

/// The share of the line's pairs of phones that no capture made.
double backoffShare(const UtteranceAnimation& animation);

/// `motion`: of the whole line (that of a long one's `animation` may be made when a file asks for it).
/// `closed_lips_mm`: between the outer edges of the actor's lips when closed; 0: not known, then no closure is counted.
/// `confidence`: of each phone of a line that was recognised; else empty.
LineQuality judgeLine(const UtteranceAnimation& animation, const MotionClip& motion, double closed_lips_mm,
                      std::span<const double> confidence);

}  // namespace mouthpiece
