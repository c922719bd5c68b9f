#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

class JsonField;

/// A key of an animation curve. `in` and `out` are the curve's slopes just before and just after it, per second.
struct CurveKey {
  Seconds time = 0;
  double value = 0;
  double in = 0;
  double out = 0;
  bool operator==(const CurveKey&) const = default;
};

/// A viseme or action unit over time: sparse keys, a cubic (Hermite) between each and the next, held before the first
/// and after the last. Keys are in time order; the later of two at one time takes over from there.
struct AnimationCurve {
  std::string name;
  std::vector<CurveKey> keys;

  /// 0 for a curve without keys.
  [[nodiscard]] double valueAt(Seconds time) const;
  /// Slopes just before and just after `time`; equal but at a key with a kink.
  [[nodiscard]] std::pair<double, double> slopesAt(Seconds time) const;
  [[nodiscard]] bool operator==(const AnimationCurve&) const = default;
};

/// The animation of a line: one curve per viseme ("Ah"), for its lip part and its jaw part; "Ah_jaw" beside it where
/// the jaw part differs. Action units ("lipSpread", "lipRound") and "larynx" as they are needed. Sorted by name.
using CurveSet = std::vector<AnimationCurve>;

CurveSet sortedByName(CurveSet curves);
/// Null where there is none of that name.
const AnimationCurve* findCurve(const CurveSet& curves, std::string_view name);

/// The keys with slopes such that the curve never leaves the range of neighbouring values: flat where a key is the
/// highest or lowest of its neighbours and at the ends, in between the weighted harmonic mean of the two chords
/// (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984). So velocity is continuous.
std::vector<CurveKey> withMonotoneSlopes(std::vector<CurveKey> keys);

/// Values of `curve` at rising `times`; O(times + keys).
std::vector<double> sampleCurve(const AnimationCurve& curve, const std::vector<Seconds>& times);

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

/// An animator's change of one curve over a span. It is kept apart from the curves, so it survives a new run.
struct CurveEdit {
  enum class Kind {
    kOffset,   ///< adds `value`, coming in and going out over `fade` inside the span
    kReplace,  ///< the curve is `keys` there
    kMute,     ///< the curve is 0 there, faded as an offset is
    kWhole,    ///< all of the curve is `keys`, with their slopes; as curves.json has it
  };
  std::string curve;
  Kind kind = Kind::kOffset;
  TimeSpan span;
  double value = 0;
  Seconds fade = 0.05;
  std::vector<CurveKey> keys;  ///< of kReplace
};
using CurveEdits = std::vector<CurveEdit>;
/// Keys of an edit lie no closer than this.
inline constexpr Seconds kLeastKeyGap = 1e-4;

/// An entry of edits.json (docs/formats/edits.md) that changes a curve; of curves.json. Throw InputError for an unknown
/// kind, a span that is none, or keys outside it.
CurveEdit curveEditFrom(const JsonField& entry);
CurveEdit wholeCurveFrom(const JsonField& entry);

/// The curves with all edits made, in their order. A curve that is not there is made where an edit asks for it (but not
/// to mute it). Outside the spans curves stay exactly as they are.
CurveSet withEdits(CurveSet curves, const CurveEdits& edits);

/// The edits of curves that there are, within the line: what is left out is told in `warnings`.
CurveEdits usableEdits(const CurveEdits& edits, Seconds duration, std::vector<std::string>& warnings);
/// Keys that edits have led beyond what a curve takes (0 to 1.25, action units -1.25 to 1.25, or as far as `before`
/// went) are held there, which is told in `warnings`.
CurveSet withinLimits(CurveSet edited, const CurveSet& before, std::vector<std::string>& warnings);

}  // namespace mouthpiece
