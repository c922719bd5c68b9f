#include "vocal/animation_curve.h"

#include <algorithm>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// The cubic with the values and slopes of both keys.
double hermite(const CurveKey& a, const CurveKey& b, Seconds time) {
  const Seconds length = b.time - a.time;
  const double u = (time - a.time) / length;
  const double rest = 1 - u;
  return a.value * rest * rest * (1 + 2 * u) + b.value * u * u * (3 - 2 * u) +
         length * u * rest * (a.out * rest - b.in * u);
}

double hermiteSlope(const CurveKey& a, const CurveKey& b, Seconds time) {
  const Seconds length = b.time - a.time;
  const double u = (time - a.time) / length;
  const double rest = 1 - u;
  return 6 * u * rest * (b.value - a.value) / length + a.out * rest * (1 - 3 * u) + b.in * u * (3 * u - 2);
}

std::vector<CurveKey>::const_iterator firstAfter(const std::vector<CurveKey>& keys, Seconds time) {
  return std::upper_bound(keys.begin(), keys.end(), time,
                          [](Seconds wanted, const CurveKey& key) { return wanted < key.time; });
}

/// The value at `time`, given the first key that lies after it.
double valueBefore(const std::vector<CurveKey>& keys, std::size_t next, Seconds time) {
  if (next == 0) return keys.front().value;
  if (next == keys.size()) return keys.back().value;
  return hermite(keys[next - 1], keys[next], time);
}

/// Slope at an inner key from the chords before and after it and their lengths.
double monotoneSlope(double before, double after, Seconds length_before, Seconds length_after) {
  if (before * after <= 0) return 0;
  const double weight_before = length_before + 2 * length_after;
  const double weight_after = 2 * length_before + length_after;
  return (weight_before + weight_after) / (weight_after / after + weight_before / before);
}

}  // namespace

double AnimationCurve::valueAt(Seconds time) const {
  if (keys.empty()) return 0;
  return valueBefore(keys, unsignedIndex(firstAfter(keys, time) - keys.begin()), time);
}

std::pair<double, double> AnimationCurve::slopesAt(Seconds time) const {
  const auto next = firstAfter(keys, time);
  const bool is_after_first = next != keys.begin();
  const double after = is_after_first && next != keys.end() ? hermiteSlope(*(next - 1), *next, time) : 0;
  const bool is_key = is_after_first && (next - 1)->time == time;
  if (!is_key) return {after, after};
  return {next - 1 == keys.begin() ? 0 : (next - 1)->in, next == keys.end() ? 0 : after};
}

CurveSet sortedByName(CurveSet curves) {
  std::sort(curves.begin(), curves.end(),
            [](const AnimationCurve& a, const AnimationCurve& b) { return a.name < b.name; });
  return curves;
}

const AnimationCurve* findCurve(const CurveSet& curves, std::string_view name) {
  const auto found =
      std::find_if(curves.begin(), curves.end(), [&](const AnimationCurve& curve) { return curve.name == name; });
  return found == curves.end() ? nullptr : &*found;
}

std::vector<CurveKey> withMonotoneSlopes(std::vector<CurveKey> keys) {
  for (std::size_t i = 0; i < keys.size(); ++i) {
    double slope = 0;
    if (i > 0 && i + 1 < keys.size()) {
      const Seconds before = keys[i].time - keys[i - 1].time;
      const Seconds after = keys[i + 1].time - keys[i].time;
      if (before > 0 && after > 0) {
        slope = monotoneSlope((keys[i].value - keys[i - 1].value) / before, (keys[i + 1].value - keys[i].value) / after,
                              before, after);
      }
    }
    keys[i].in = keys[i].out = slope;
  }
  return keys;
}

std::vector<double> sampleCurve(const AnimationCurve& curve, const std::vector<Seconds>& times) {
  std::vector<double> values(times.size(), 0.0);
  if (curve.keys.empty()) return values;
  std::size_t next = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    while (next < curve.keys.size() && curve.keys[next].time <= times[i]) ++next;
    values[i] = valueBefore(curve.keys, next, times[i]);
  }
  return values;
}

}  // namespace mouthpiece
