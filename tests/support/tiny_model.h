#pragma once

#include <memory>

#include "units/file/corpus.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece::samples {

/// A trajectory model by hand for tinyCorpus(): the lips part and the chin falls, one component each; vowels open,
/// B P M close.
std::shared_ptr<const TrajectoryModel> tinyModel(const Corpus& corpus);

}  // namespace mouthpiece::samples
