#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// Reads Motion Analysis' TRC (tab-separated text; OpenSim writes it too): units mm, cm or m, empty cells NaN. The rows
/// count, not the NumFrames of the header. Throws InputError with the line.
MotionClip readTrc(const std::filesystem::path& path);
MotionClip readTrcText(std::string_view text, std::string_view name);

/// Millimetres, four decimals. Throws InputError for a marker name with a tab or line end.
void writeTrc(const std::filesystem::path& path, const MotionClip& clip);
std::string writeTrcText(const MotionClip& clip, std::string_view file_name);

}  // namespace mouthpiece
