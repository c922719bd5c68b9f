#pragma once

#include <nlohmann/json_fwd.hpp>

#include "base/json_fields.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {

/// What of the options moves a face; no edits, and what whyNotPacked() refuses is left out.
nlohmann::json optionsToJson(const SynthesisOptions& options);
SynthesisOptions optionsFrom(const JsonField& field);

}  // namespace mouthpiece
