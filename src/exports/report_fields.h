#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// To four digits behind the point, as pages and reports show it.
inline double rounded(double value) { return std::round(value * 1e4) / 1e4; }

/// The fields of report.json, for the files that hold them: the report itself and view.html.
nlohmann::ordered_json reportFields(const UtteranceAnimation& animation, const StageTimings& timing);

}  // namespace mouthpiece
