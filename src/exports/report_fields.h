#pragma once

#include <nlohmann/json.hpp>

#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// The fields of report.json, for the files that hold them: the report itself and view.html.
nlohmann::ordered_json reportFields(const UtteranceAnimation& animation);

}  // namespace mouthpiece
