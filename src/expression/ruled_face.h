#pragma once

#include <span>
#include <vector>

#include "expression/beats.h"
#include "expression/expression.h"

namespace mouthpiece {

/// Blinks and brows drawn at random: times x 52 weights of ARKit's shapes; `blinks` gets when lids begin to close.
PositionMatrix ruledUpperFace(const std::vector<Beat>& beats, bool asks, std::span<const Seconds> times, Dice& dice,
                              std::vector<Seconds>& blinks);

/// Slow sway and nods on accents, one a time; at rest at both ends, so that lines follow each other.
std::vector<HeadTurn> ruledHead(const std::vector<Beat>& beats, std::span<const Seconds> times, Dice& dice);

/// The listener is looked at, and now and then something beside, above all where a phrase begins. `head` (one a time,
/// or none) is what the eyes make up for. At rest at both ends.
std::vector<GazeTurn> ruledGaze(const std::vector<Beat>& beats, std::span<const Seconds> times,
                                std::span<const HeadTurn> head, Dice& dice);

}  // namespace mouthpiece
