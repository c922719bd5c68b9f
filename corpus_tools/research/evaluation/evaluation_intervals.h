#pragma once

#include <functional>

#include "corpus_tools/research/evaluation/evaluation.h"

namespace mouthpiece {

struct Interval {
  double low = 0, high = 0;  ///< NaN where the measure is
};

/// The 95 % bootstrap interval of a measure of a row: 1,000 draws of as many takes as the row has, with replacement and
/// a fixed seed.
Interval bootstrapInterval(const EvaluationRow& row, const std::function<double(const LipMeasures&)>& measure);

}  // namespace mouthpiece
