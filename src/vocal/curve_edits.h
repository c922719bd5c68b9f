#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "vocal/viseme_curves.h"

namespace mouthpiece {

/// An animator's change of one curve over a span. It is kept apart from the curves, so it survives a new run.
struct CurveEdit {
  enum class Kind {
    kOffset,   ///< adds `value`, coming in and going out over `fade` inside the span
    kReplace,  ///< the curve is `keys` there
    kMute,     ///< the curve is 0 there, faded as an offset is
  };
  std::string curve;
  Kind kind = Kind::kOffset;
  TimeSpan span;
  double value = 0;
  Seconds fade = 0.05;
  std::vector<CurveKey> keys;  ///< of kReplace
};
using CurveEdits = std::vector<CurveEdit>;

/// edits.json (docs/formats/edits.md). Throws InputError, with `file` in front, for an unknown kind, a span that is
/// none, or keys outside it.
CurveEdits parseCurveEdits(std::string_view json_text, std::string_view file);
CurveEdits readCurveEdits(const std::filesystem::path& path);

/// The curves with all edits made, in their order. A curve that is not there is made where an edit asks for it (but not
/// to mute it). Outside the spans curves stay exactly as they are.
CurveSet withEdits(CurveSet curves, const CurveEdits& edits);

}  // namespace mouthpiece
