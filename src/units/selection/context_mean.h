#pragma once

#include <Eigen/Core>

#include "phonetics/labels/speech_labels.h"
#include "units/selection/unit_database.h"

namespace mouthpiece {

/// What the prediction misses on average where the corpus says the same in a like context: for each phone the mean of
/// captured less predicted over its places in the captured pairs of the line, each weighing exp(-d / 0.3 mm2), where d
/// is the mean squared distance of its own prediction to the line's; one more place of weight 1 and no difference holds
/// it back. phones * PhoneShapes::kPoints rows, at shapeTimes(), a column a component.
Eigen::MatrixXd contextMean(const SpeechLabels& target, const UnitDatabase& database);

}  // namespace mouthpiece
