#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "vocal/viseme_curves.h"

namespace mouthpiece {
namespace {

constexpr std::array<StyleExtreme, 4> kExtremes = {StyleExtreme{false, false}, StyleExtreme{true, false},
                                                   StyleExtreme{false, true}, StyleExtreme{true, true}};

double weightOf(const StyleExtreme& extreme, double ma, double ps) {
  return (extreme.melodic ? ma : 1 - ma) * (extreme.pitch_sensitive ? ps : 1 - ps);
}

/// Whether the extreme has any weight at any time: both signals are straight between their points.
bool isUsed(const StyleExtreme& extreme, const StyleSignal& ma, const StyleSignal& ps) {
  const auto any = [](const StyleSignal& signal, bool wants_one) {
    return std::any_of(signal.points.begin(), signal.points.end(),
                       [&](const StyleSignal::Point& point) { return point.value != (wants_one ? 0.0 : 1.0); });
  };
  return any(ma, extreme.melodic) && any(ps, extreme.pitch_sensitive);
}

struct UsedExtreme {
  StyleExtreme extreme;
  CurveSet curves;
};

/// `before_by`, `after_by`: how far the keys before and after it are.
CurveKey blendedKey(const std::vector<UsedExtreme>& used, const std::vector<const AnimationCurve*>& curves,
                    Seconds time, Seconds before_by, Seconds after_by, const StyleSignal& ma, const StyleSignal& ps) {
  // Not beyond the next key: what the style does there is no slope of this stretch.
  constexpr Seconds kLongestStep = 1e-6;
  const Seconds step_before = std::min(kLongestStep, 0.25 * before_by);
  const Seconds step_after = std::min(kLongestStep, 0.25 * after_by);
  CurveKey key{time, 0, 0, 0};
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (curves[i] == nullptr) continue;
    const auto weight_at = [&](Seconds t) { return weightOf(used[i].extreme, ma.at(t), ps.at(t)); };
    const double weight = weight_at(time);
    const double value = curves[i]->valueAt(time);
    const auto [before, after] = curves[i]->slopesAt(time);
    key.value += weight * value;
    key.in += weight * before + value * (weight - weight_at(time - step_before)) / step_before;
    key.out += weight * after + value * (weight_at(time + step_after) - weight) / step_after;
  }
  return key;
}

/// Every time at which one of the curves has a key or the style turns, each once.
std::vector<Seconds> keyTimes(const std::vector<const AnimationCurve*>& curves, const StyleSignal& ma,
                              const StyleSignal& ps) {
  std::vector<Seconds> times;
  for (const AnimationCurve* curve : curves) {
    if (curve == nullptr) continue;
    for (const CurveKey& key : curve->keys) times.push_back(key.time);
  }
  if (times.empty()) return times;
  const auto [first, last] = std::minmax_element(times.begin(), times.end());
  const Seconds begin = *first, end = *last;
  for (const StyleSignal* signal : {&ma, &ps}) {
    if (signal->isConstant()) continue;
    for (const StyleSignal::Point& point : signal->points) {
      if (begin < point.time && point.time < end) times.push_back(point.time);
    }
  }
  std::sort(times.begin(), times.end());
  constexpr Seconds kSameTime = 1e-8;
  times.erase(std::unique(times.begin(), times.end(), [](Seconds a, Seconds b) { return b - a < kSameTime; }),
              times.end());
  return times;
}

/// The times with one midway between two where the style changes between them: a cubic times a slope is no cubic.
std::vector<Seconds> halvedWhereStyleChanges(const std::vector<Seconds>& times, const StyleSignal& ma,
                                             const StyleSignal& ps) {
  std::vector<Seconds> halved;
  for (const Seconds time : times) {
    const bool changes =
        !halved.empty() && (ma.at(halved.back()) != ma.at(time) || ps.at(halved.back()) != ps.at(time));
    if (changes) halved.push_back(0.5 * (halved.back() + time));
    halved.push_back(time);
  }
  return halved;
}

}  // namespace

CurveSet blendExtremes(const SpeechLabels& labels, const AudioTags& tags, const StyleSignal& ma,
                       const StyleSignal& ps) {
  std::vector<UsedExtreme> used;
  for (const StyleExtreme& extreme : kExtremes) {
    if (isUsed(extreme, ma, ps)) used.push_back({extreme, visemeCurves(labels, tags, extreme)});
  }
  // All weight on one corner: its keys as they are.
  if (used.size() == 1) return std::move(used[0].curves);
  std::set<std::string> names;
  for (const UsedExtreme& one : used) {
    for (const AnimationCurve& curve : one.curves) names.insert(curve.name);
  }
  CurveSet blended;
  for (const std::string& name : names) {
    std::vector<const AnimationCurve*> curves;
    for (const UsedExtreme& one : used) curves.push_back(findCurve(one.curves, name));
    AnimationCurve curve{name, {}};
    const std::vector<Seconds> times = halvedWhereStyleChanges(keyTimes(curves, ma, ps), ma, ps);
    for (std::size_t i = 0; i < times.size(); ++i) {
      constexpr Seconds kFar = 1;
      curve.keys.push_back(blendedKey(used, curves, times[i], i > 0 ? times[i] - times[i - 1] : kFar,
                                      i + 1 < times.size() ? times[i + 1] - times[i] : kFar, ma, ps));
    }
    blended.push_back(std::move(curve));
  }
  return blended;
}

CurveSet vocalCurves(const SpeechLabels& labels, const AudioTags& tags, const VocalStyle& style) {
  CurveSet curves = blendExtremes(labels, tags, style.ma, style.ps);
  for (CurveSet more : {vowelModificationCurves(labels, tags), larynxCurves(labels, tags)}) {
    curves.insert(curves.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  }
  return sortedByName(std::move(curves));
}

}  // namespace mouthpiece
