#pragma once

#include <optional>
#include <span>
#include <vector>

#include "expression/beats.h"
#include "motion/motion_clip.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

struct CapturedUpperFace {
  PositionMatrix positions_mm;  ///< times x (3 * markers), of the upper face's columns alone; others are 0
  std::size_t stretches = 0;    ///< of takes without a cut
};

/// The upper face in stretches of its own: a word or a pause takes its lids and brows from one of the corpus that is as
/// long, as much accented and as near to a pause, and that goes on where the one before left off. Nothing where the
/// corpus has no upper face or it never moves (no lid closes).
std::optional<CapturedUpperFace> capturedUpperFace(const std::vector<Beat>& beats, std::span<const Seconds> times,
                                                   const UnitDatabase& database, Dice& dice);

}  // namespace mouthpiece
