#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "motion/motion_pieces.h"

namespace mouthpiece {

/// Motion as a table (docs/formats/motion_csv.md): time_s,NAME.x,NAME.y,NAME.z,..., millimetres, one row a frame, an
/// empty cell (or "nan") where the marker was not seen. The frame rate comes from the times, which are evenly spaced.
/// Throws InputError with the line; at least two rows.
MotionClip readMotionCsv(const std::filesystem::path& path);
MotionClip readMotionCsvText(std::string_view text, std::string_view name);

/// Four decimals for positions, six for time. Throws InputError for a marker name with a comma, quote or line end, and
/// when the file cannot be written.
void writeMotionCsv(const std::filesystem::path& path, const MotionClip& clip);
void writeMotionCsv(const std::filesystem::path& path, const MotionInPieces& motion);
std::string writeMotionCsvText(const MotionClip& clip);

/// Reads Motion Analysis' TRC (tab-separated text; OpenSim writes it too): units mm, cm or m, empty cells NaN. The rows
/// count, not the NumFrames of the header. Throws InputError with the line.
MotionClip readTrc(const std::filesystem::path& path);
MotionClip readTrcText(std::string_view text, std::string_view name);

/// Millimetres, four decimals. Throws InputError for a marker name with a tab or line end.
void writeTrc(const std::filesystem::path& path, const MotionClip& clip);
void writeTrc(const std::filesystem::path& path, const MotionInPieces& motion);
std::string writeTrcText(const MotionClip& clip, std::string_view file_name);

}  // namespace mouthpiece
