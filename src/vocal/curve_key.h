#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/time.h"

namespace mouthpiece {

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

/// Sets the slopes of keys so that the curve never leaves the range of neighbouring values: flat where a key is the
/// highest or lowest of its neighbours and at the ends, in between the weighted harmonic mean of the two chords
/// (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5, 1984). So velocity is continuous.
void setMonotoneSlopes(std::vector<CurveKey>& keys);

/// Values of `curve` at rising `times`; O(times + keys).
std::vector<double> sampleCurve(const AnimationCurve& curve, const std::vector<Seconds>& times);

}  // namespace mouthpiece
