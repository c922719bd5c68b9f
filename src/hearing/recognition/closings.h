#pragma once

#include <Eigen/Core>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Puts P, B and M that are heard without words among the `phones` of words where these have none, and how well they
/// fit among `fits`, which has one of each. `posteriors`: PhoneEar's of the sound; `likeness`: lipLikeness().
void keepClosings(const Eigen::MatrixXf& posteriors, const Eigen::MatrixXf& likeness,
                  std::vector<LabelledPhone>& phones, std::vector<double>& fits);

}  // namespace mouthpiece
