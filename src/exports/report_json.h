#pragma once

#include <filesystem>
#include <string>

#include "synthesis/utterance_animation.h"

namespace mouthpiece {

/// report.json (docs/formats/report.md): where each phone came from, how it was joined and how long it took.
std::string reportJson(const UtteranceAnimation& animation);

/// reportJson() into a file, atomically.
void writeReport(const std::filesystem::path& path, const UtteranceAnimation& animation);

}  // namespace mouthpiece
