#pragma once

#include <filesystem>

#include "motion/motion_clip.h"

namespace mouthpiece {

/// Reads or writes motion in the format that the name's ending tells: .c3d, .csv, .trc, in any case. Throws InputError
/// for another ending, and what the format's own reader or writer throws.
MotionClip readMotion(const std::filesystem::path& path);
void writeMotion(const std::filesystem::path& path, const MotionClip& clip);

/// True for an ending that readMotion knows.
bool isMotionFileName(const std::filesystem::path& path);

}  // namespace mouthpiece
