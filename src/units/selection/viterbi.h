#pragma once

#include <vector>

#include "units/selection/selection.h"
#include "units/selection/unit_candidates.h"
#include "units/selection/unit_costs.h"

namespace mouthpiece {

/// The cover of the target with the least sum of target, join and per-unit costs, over the cheapest
/// `options.candidates_kept` fragments of every run of phones: exact dynamic programming, O(units x neighbouring
/// units).
std::vector<SelectedUnit> selectByViterbi(const SpeechLabels& target, const UnitCandidates& candidates,
                                          const UnitCosts& costs, const SelectionOptions& options);

}  // namespace mouthpiece
