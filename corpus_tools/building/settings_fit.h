#pragma once

#include <string>

#include "corpus_tools/building/trajectory_fit.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// Gives the corpus the fit's model, and learns on its judges how much the fragments shall bring beside it, drawn to
/// the settings that the corpus has: `takes` are believed by takes / (takes + 20). What they reached is logged as
/// "motion_settings".
void learnSettings(Corpus& corpus, const TrajectoryFit& fit, std::size_t takes, std::size_t jobs);

/// Fits the trajectory model to all takes, and learns how much the fragments shall bring beside it: on takes left out,
/// the settings with the least lip error among those whose movement varies, and is as sharp, as the capture's to within
/// 12 %; drawn to the usual ones where takes are few (docs/theory/units/context_transfer.md). What they reached is
/// logged as "motion_settings".
void fitMotion(Corpus& corpus, const TrajectoryFitOptions& options = {});

}  // namespace mouthpiece
