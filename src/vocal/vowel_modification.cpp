#include <algorithm>

#include "vocal/viseme_curves.h"
#include "vocal/viseme_events.h"

namespace mouthpiece {
namespace {

/// A stretch of a vowel in which one group is heard.
struct HeardStretch {
  TimeSpan span;
  VowelGroup group;
  double probability = 0;  ///< mean over the stretch
};

struct Heard {
  VowelGroup group;
  double probability;
};

Heard likeliest(const VowelLikelihood& vowel) {
  const double ei = vowel.e + vowel.i, ou = vowel.o + vowel.u;
  if (vowel.a >= ei && vowel.a >= ou) return {VowelGroup::kA, vowel.a};
  return ei >= ou ? Heard{VowelGroup::kEI, ei} : Heard{VowelGroup::kOU, ou};
}

/// The stretches of `span` over the threshold; those too short to be seen are left out.
std::vector<HeardStretch> stretchesIn(const AudioTags& tags, const TimeSpan& span) {
  constexpr Seconds kShortest = 0.080;
  constexpr Seconds kStep = 0.010;
  std::vector<HeardStretch> stretches;
  double count = 0;
  const auto first = std::lower_bound(tags.vowels.begin(), tags.vowels.end(), span.start,
                                      [](const VowelLikelihood& vowel, Seconds time) { return vowel.time < time; });
  for (auto vowel = first; vowel != tags.vowels.end() && vowel->time < span.end; ++vowel) {
    const Heard heard = likeliest(*vowel);
    if (heard.probability <= kModificationThreshold) continue;
    const bool goes_on =
        !stretches.empty() && stretches.back().group == heard.group && vowel->time - stretches.back().span.end < kStep;
    if (!goes_on) {
      stretches.push_back({{vowel->time, vowel->time}, heard.group, 0});
      count = 0;
    }
    HeardStretch& stretch = stretches.back();
    stretch.span.end = std::min(vowel->time + kStep, span.end);
    stretch.probability = (stretch.probability * count + heard.probability) / (count + 1);
    ++count;
  }
  std::erase_if(stretches, [](const HeardStretch& stretch) { return stretch.span.duration() < kShortest; });
  return stretches;
}

/// Four keys: up by the stretch's beginning, held for 75 % of it, down. At the vowel's own ends it starts or ends just
/// before it.
std::vector<CurveKey> withStretch(std::vector<CurveKey> keys, const TimeSpan& span, double value) {
  constexpr Seconds kRamp = vocal_numbers::kOnset;
  constexpr Seconds kSameTime = 1e-6;
  const Seconds hold_end = span.start + vocal_numbers::kSustain * span.duration();
  if (!keys.empty() && keys.back().time > span.start - kRamp - kSameTime) {
    // Two stretches meet: one key midway instead of the fall and the rise.
    keys.pop_back();
    const Seconds last = keys.back().time;
    if (last < span.start) keys.push_back({0.5 * (last + span.start), 0.5 * (keys.back().value + value), 0, 0});
  } else {
    keys.push_back({span.start - kRamp, 0, 0, 0});
  }
  keys.push_back({span.start, value, 0, 0});
  keys.push_back({hold_end, value, 0, 0});
  keys.push_back({std::max(span.end, hold_end + 1e-3), 0, 0, 0});
  return keys;
}

}  // namespace

VowelModification modificationFor(VowelGroup transcribed, VowelGroup sung) {
  if (transcribed == sung) return {};
  switch (transcribed) {
    case VowelGroup::kA:
      return sung == VowelGroup::kEI ? VowelModification{1, 0} : VowelModification{0, 1};
    case VowelGroup::kEI:
      return sung == VowelGroup::kA ? VowelModification{-1, 0} : VowelModification{-1, 1};
    case VowelGroup::kOU:
      return sung == VowelGroup::kA ? VowelModification{0, -1} : VowelModification{1, -1};
  }
  return {};
}

CurveSet vowelModificationCurves(const SpeechLabels& labels, const AudioTags& tags) {
  if (tags.vowels.empty()) return {};
  std::vector<CurveKey> spread, round;
  const auto modify = [&](const TimeSpan& span, Viseme transcribed) {
    const VowelGroup group = rowOf(transcribed).vowels.value_or(VowelGroup::kA);
    for (const HeardStretch& stretch : stretchesIn(tags, span)) {
      const VowelModification change = modificationFor(group, stretch.group);
      const double apex = kLargestModification * stretch.probability;
      if (change.lip_spread != 0) spread = withStretch(std::move(spread), stretch.span, change.lip_spread * apex);
      if (change.lip_round != 0) round = withStretch(std::move(round), stretch.span, change.lip_round * apex);
    }
  };
  for (const LabelledPhone& phone : labels.phones) {
    if (!isVowel(phone.phone)) continue;
    // The two vowels of a diphthong are meant to sound differently.
    const Seconds turn = isDiphthong(phone.phone) ? diphthongTurn(phone.span) : phone.span.end;
    modify({phone.span.start, turn}, firstViseme(phone.phone));
    if (isDiphthong(phone.phone)) modify({turn, phone.span.end}, lastViseme(phone.phone));
  }
  CurveSet curves;
  if (!spread.empty()) curves.push_back({"lipSpread", withMonotoneSlopes(std::move(spread))});
  if (!round.empty()) curves.push_back({"lipRound", withMonotoneSlopes(std::move(round))});
  return curves;
}

}  // namespace mouthpiece
