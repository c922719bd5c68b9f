#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "motion/motion_pieces.h"

namespace mouthpiece {

/// Something that happened during a capture: a foot strike, a clap, a slate.
struct MotionEvent {
  std::string label;
  std::string context;  ///< "Left", "Right", "General"; empty in the header's old-style events
  Seconds time = 0;     ///< from the clip's first frame; outside the clip for events of a part that was cut off
};

/// Reads the points of a C3D file (docs/formats/c3d.md): Intel, DEC and MIPS byte orders, integer and float points,
/// units mm, cm, m; a point with a negative residual, or with a coordinate that is NaN, becomes NaN. Analog data is
/// skipped, events are readC3dEvents' matter. A point without a label, or with one used before, is called
/// "unlabelled_N" (N from 1). Throws InputError for what is no C3D file, is cut off, contradicts itself, or has no
/// points or frames.
MotionClip readC3d(const std::filesystem::path& path);
/// The same from memory; `name` is for messages.
MotionClip readC3dBytes(std::string_view bytes, std::string_view name);

/// The events of the EVENT group, as the file lists them; those of the header where there is no such group. Throws
/// InputError as readC3d does, and for a time that is no usable number.
std::vector<MotionEvent> readC3dEvents(const std::filesystem::path& path);
std::vector<MotionEvent> readC3dEventsBytes(std::string_view bytes, std::string_view name);

/// Writes Intel floats in millimetres, as far as 32-bit floats hold them; NaN becomes residual -1. Throws InputError
/// when the clip does not fit the format (65,535 markers, 127 bytes a name, 130,000 bytes of names), there are over
/// 65,535 events, or the file cannot be written.
void writeC3d(const std::filesystem::path& path, const MotionClip& clip, const std::vector<MotionEvent>& events = {});
void writeC3d(const std::filesystem::path& path, const MotionInPieces& motion,
              const std::vector<MotionEvent>& events = {});
std::string writeC3dBytes(const MotionClip& clip, const std::vector<MotionEvent>& events = {});

}  // namespace mouthpiece
