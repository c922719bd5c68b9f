#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "vocal/viseme_curves.h"

namespace mouthpiece {

/// curves.json (docs/formats/curves.md): `[{"name", "keys": [{"time_s", "value", "in", "out"}]}]`. Numbers are written
/// so that reading gives the same ones, to the bit.
std::string curvesToJson(const CurveSet& curves);
/// Throws InputError, with `file` in front, for what is no such list, a name that comes twice, or keys out of order.
CurveSet parseCurves(std::string_view json_text, std::string_view file);
CurveSet readCurves(const std::filesystem::path& path);

/// The same keys as rows of `curve,time_s,value,in,out`.
std::string curveKeysToCsv(const CurveSet& curves);

/// `time_s,NAME,NAME,...`, one row a frame.
std::string curveFramesToCsv(const CurveSet& curves, double frame_rate_hz, std::size_t frames);

}  // namespace mouthpiece
