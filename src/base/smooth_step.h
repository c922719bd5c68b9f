#pragma once

#include <algorithm>

namespace mouthpiece {

/// 0 up to 0, 1 from 1 on, between them 3 x^2 - 2 x^3: continuous in value and slope.
inline double smoothStep(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// The same on the way from `from` to `to`.
inline double smoothStep(double from, double to, double x) { return smoothStep((x - from) / (to - from)); }

}  // namespace mouthpiece
