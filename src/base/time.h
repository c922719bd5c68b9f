#pragma once

#include <algorithm>
#include <compare>

namespace mouthpiece {

/// Time from the start of the clip or utterance at hand.
using Seconds = double;

/// The half-open interval [start, end).
struct TimeSpan {
  Seconds start = 0;
  Seconds end = 0;

  [[nodiscard]] constexpr Seconds duration() const { return end - start; }
  [[nodiscard]] constexpr Seconds middle() const { return 0.5 * (start + end); }
  [[nodiscard]] constexpr bool contains(Seconds time) const { return start <= time && time < end; }
  [[nodiscard]] constexpr bool overlaps(const TimeSpan& other) const { return start < other.end && other.start < end; }
  constexpr auto operator<=>(const TimeSpan&) const = default;
};

}  // namespace mouthpiece
