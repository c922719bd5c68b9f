#pragma once

#include <vector>

#include "hearing/recognition/stretch_hearing.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Puts P, B and M that are heard without words among the `phones` of words where these have none, and how well they
/// fit among `fits`, which has one of each.
void keepClosings(const StretchHearing& hearing, std::vector<LabelledPhone>& phones, std::vector<double>& fits);

}  // namespace mouthpiece
