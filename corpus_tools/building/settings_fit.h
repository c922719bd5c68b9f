#pragma once

#include <string>

#include "corpus_tools/building/trajectory_fit.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// Fits the trajectory model to all takes, and learns how much the fragments shall bring beside it: on takes left out,
/// the settings with the least lip error among those whose movement varies, and is as sharp, as the capture's to within
/// 12 %; drawn to the usual ones where takes are few (docs/theory/units/prediction.md). What they reached is logged as
/// "motion_settings".
void fitMotion(Corpus& corpus, const TrajectoryFitOptions& options = {});

}  // namespace mouthpiece
