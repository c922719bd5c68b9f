#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "phonetics/labels/speech_labels.h"
#include "synthesis/curve_ablation.h"

namespace mouthpiece {

/// A page, one file, with the variants' curves over each other, above the phones. `frame_rate_hz`: of the variants'
/// mouth. The first variant is the one that the others are compared with.
std::string ablationPage(std::string_view title, const SpeechLabels& labels, const std::vector<CurveVariant>& variants,
                         double frame_rate_hz);

}  // namespace mouthpiece
