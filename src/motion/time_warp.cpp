#include "motion/time_warp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// The map from column `From` to column `To`.
template <Seconds TimeKnot::*From, Seconds TimeKnot::*To>
Seconds mapTime(const std::vector<TimeKnot>& knots, Seconds time) {
  if (time <= knots.front().*From) return knots.front().*To + (time - knots.front().*From);
  if (time >= knots.back().*From) return knots.back().*To + (time - knots.back().*From);
  const auto right = std::upper_bound(knots.begin(), knots.end(), time,
                                      [](Seconds t, const TimeKnot& knot) { return t < knot.*From; });
  const TimeKnot& a = *(right - 1);
  const TimeKnot& b = *right;
  const double u = (time - a.*From) / (b.*From - a.*From);
  // Both products, so that each knot is met exactly from either side and equal columns give the identity's rounding.
  return std::lerp(a.*To, b.*To, u);
}

}  // namespace

TimeWarp::TimeWarp(std::vector<TimeKnot> knots) : knots_(std::move(knots)) {
  if (knots_.empty()) throw InputError("found no knot in a time warp; expected at least one");
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    const TimeKnot& knot = knots_[i];
    if (!std::isfinite(knot.source) || !std::isfinite(knot.target)) {
      throw InputError(fmt::format("found a time warp knot {} that is not finite", i));
    }
    if (i > 0 && !(knots_[i - 1].source < knot.source && knots_[i - 1].target < knot.target)) {
      throw InputError(
          fmt::format("found time warp knot {} at {:.6g} s -> {:.6g} s behind {:.6g} s -> {:.6g} s; "
                      "expected both columns to rise strictly",
                      i, knot.source, knot.target, knots_[i - 1].source, knots_[i - 1].target));
    }
  }
}

Seconds TimeWarp::targetFromSource(Seconds source) const {
  return mapTime<&TimeKnot::source, &TimeKnot::target>(knots_, source);
}

Seconds TimeWarp::sourceFromTarget(Seconds target) const {
  return mapTime<&TimeKnot::target, &TimeKnot::source>(knots_, target);
}

}  // namespace mouthpiece
