#pragma once

#include <optional>

#include "heads/head_generator.h"

namespace mouthpiece::test {

/// What a game's artist makes of a head.
struct CoarseHead {
  std::size_t faces = 500;    ///< of the skin; teeth, eyes and tongue are left out
  std::size_t rim_edges = 8;  ///< of a lip, from corner to corner
  bool has_bag = true;        ///< no: the mouth is a hole whose edge are the rims
};

/// `head` with few faces, most of them around the mouth. As many vertices of the lower lip's rim lie where those of the
/// upper one are, and stay apart from them; where the head's lips rest open by half a millimetre or more, so do these.
/// What is behind the rims stays, coarse, or goes. nullopt where no rims are found. The clicks stay where they are.
std::optional<ClickedHead> coarsened(const ClickedHead& head, const CoarseHead& as);

/// A coarse head by chance: proportions as those of `variedHead`, 500, 1,000 or 2,000 faces (in turn, by `seed`), 7 to
/// 15 edges a rim (fewer where the head has no more itself), every third a hole for a mouth, ten clicks up to 2 mm
/// beside their places.
std::optional<ClickedHead> coarseHead(const ClickedHead& head, unsigned seed);

}  // namespace mouthpiece::test
