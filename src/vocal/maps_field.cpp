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

CurveKey blendedKey(const std::vector<UsedExtreme>& used, const std::vector<const AnimationCurve*>& curves,
                    Seconds time, const StyleSignal& ma, const StyleSignal& ps) {
  constexpr Seconds kStep = 1e-6;
  CurveKey key{time, 0, 0, 0};
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (curves[i] == nullptr) continue;
    const auto weight_at = [&](Seconds t) { return weightOf(used[i].extreme, ma.at(t), ps.at(t)); };
    const double weight = weight_at(time);
    const double value = curves[i]->valueAt(time);
    const auto [before, after] = curves[i]->slopesAt(time);
    key.value += weight * value;
    key.in += weight * before + value * (weight - weight_at(time - kStep)) / kStep;
    key.out += weight * after + value * (weight_at(time + kStep) - weight) / kStep;
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
  constexpr Seconds kSameTime = 1e-6;
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
    for (const Seconds time : halvedWhereStyleChanges(keyTimes(curves, ma, ps), ma, ps))
      curve.keys.push_back(blendedKey(used, curves, time, ma, ps));
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
