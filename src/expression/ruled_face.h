#pragma once

#include <span>
#include <vector>

#include "expression/beats.h"
#include "expression/expression.h"

namespace mouthpiece {

// A blink: closing, closed, opening (VanderWerf et al. 2003).
inline constexpr Seconds kCloses = 0.09, kClosed = 0.03, kOpens = 0.19, kOpenAgain = kCloses + kClosed + kOpens;
inline constexpr Seconds kUsualBetweenBlinks = 3;
inline constexpr Seconds kBlinkStep = 0.02;  ///< blinks are drawn so often

/// How far lids are closed, 0 to 1, so long after a blink began.
double lidsClosed(Seconds since);
/// Whether a blink begins now, `since` the last one began; `more` times as likely as usual.
bool blinksNow(Seconds since, double more, Dice& dice);
/// How long the eyes take from one look to another, both in degrees (Carpenter 1988: 21 ms and 2.2 ms a degree).
Seconds saccadeLasts(double from_yaw, double from_pitch, double to_yaw, double to_pitch);

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
