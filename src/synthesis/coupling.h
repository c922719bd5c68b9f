#pragma once

#include <span>

#include "synthesis/fragment.h"

namespace mouthpiece {

/// Among what the join of two fragments is looked for.
struct CouplingSearch {
  TimeSpan middles;                  ///< where the middle of the blend may lie
  std::span<const Seconds> lengths;  ///< how long the blend may be; none is zero
};

/// Optimal coupling: the blend of lips and chin for which is least, added up over its length, by how far the lips of
/// both lie apart, what velocity the blend itself adds to theirs, and how fast they move (docs/theory/selection.md).
TimeSpan cheapestCoupling(const Fragment& before, const Fragment& after, const CouplingSearch& search);

}  // namespace mouthpiece
