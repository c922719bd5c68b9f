#pragma once

#include <vector>

#include "units/selection/selection.h"
#include "units/selection/unit_candidates.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// Whether selectByLattice() can be used: the corpus knows how its speaker moves.
bool hasLattice(const UnitDatabase& database);

/// The cheapest row of captured phone pairs, one a pair of the line, where a change of place costs a join and going on
/// in the same take costs nothing: so units of every length compete. Exact over the `pairs_kept` cheapest places of
/// each pair and those that go on from a place kept for the pair before. Needs hasLattice().
std::vector<SelectedUnit> selectByLattice(const SpeechLabels& target, const UnitDatabase& database,
                                          const UnitCandidates& candidates, const SelectionOptions& options);

}  // namespace mouthpiece
