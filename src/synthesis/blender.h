#pragma once

#include <span>
#include <vector>

#include "motion/blend.h"
#include "motion/marker_layout.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "synthesis/join_offset.h"

namespace mouthpiece {

/// The fragments resampled at `times` (rising) and blended over `joins`, one between each fragment and the next (EDGE
/// 5.1.3): times x (3 * markers), mm. `offsets` (one a join, or none at all) are spread first. Where the capture of one
/// side was not seen, the other side stands for both; NaN only where neither was.
PositionMatrix blendFragments(const std::vector<UnitFragment>& fragments, const std::vector<JoinSpans>& joins,
                              const std::vector<JoinOffset>& offsets, std::span<const Seconds> times, BlendKind blend,
                              const MarkerLayout& layout);

}  // namespace mouthpiece
