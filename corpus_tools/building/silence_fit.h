#pragma once

#include <vector>

#include "corpus_tools/building/trajectory_design.h"

namespace mouthpiece {

/// How long before speech this speaker's mouth opens, by how long the silence before it lasts: a line through the takes
/// that open it visibly, drawn to the usual timing by 20 takes; never shorter or longer than in the takes' shortest and
/// longest silences. The usual timing where few do.
SilenceTiming fitSilenceTiming(const std::vector<FitTake>& takes, const Corpus& corpus);

}  // namespace mouthpiece
