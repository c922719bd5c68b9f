#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/index.h"
#include "phonetics/language/ipa.h"
#include "synthesis/curve_model.h"
#include "synthesis/lips.h"
#include "synthesis/tongue.h"

namespace mouthpiece {
namespace {

/// How a phone's articulator comes and goes: a cosine ramp of `transition` seconds at both ends, `inside` of which lie
/// in the phone (less where it is short).
struct PresenceShape {
  Seconds transition = 0;
  Seconds inside = 0;  ///< below zero: so long before and after the phone it is whole
};

/// `before` and `after`: how it comes and how it goes.
double presenceAt(const TimeSpan& span, Seconds time, const PresenceShape& before, const PresenceShape& after) {
  const auto outside = [&](Seconds beyond, const PresenceShape& shape) {
    return (beyond + std::min(shape.inside, std::max(0.0, 0.5 * span.duration()))) / shape.transition;
  };
  const double u = std::clamp(std::max(outside(span.start - time, before), outside(time - span.end, after)), 0.0, 1.0);
  return 0.5 * (1 + std::cos(std::numbers::pi * u));
}

/// Every phone that is present at any of `times` (rising), with how much it is, in (0, 1]: 1 between its ramps. Phones
/// stand in the order of their starts.
void forEachPresence(const SpeechLabels& labels, std::span<const Seconds> times, const PresenceShape& shape,
                     const std::function<void(std::size_t time, const LabelledPhone& said, double presence)>& visit) {
  const auto& phones = labels.phones;
  const Seconds reach = shape.transition - shape.inside;
  std::size_t first_near = 0;
  for (std::size_t frame = 0; frame < times.size(); ++frame) {
    const Seconds time = times[frame];
    while (first_near < phones.size() && phones[first_near].span.end + reach < time) ++first_near;
    for (std::size_t i = first_near; i < phones.size() && phones[i].span.start - reach < time; ++i) {
      if (const double presence = presenceAt(phones[i].span, time, shape, shape); presence > 0)
        visit(frame, phones[i], presence);
    }
  }
}

constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
constexpr PresenceShape kParting{.transition = 0.050};
constexpr PresenceShape kRound{.transition = 0.120, .inside = 0.020};
constexpr PresenceShape kTuck{.transition = 0.110, .inside = 0.015};

/// How round the lips are in a viseme.
float roundness(Viseme viseme) {
  switch (viseme) {
    case Viseme::kOo:
    case Viseme::kW:
      return 1;
    case Viseme::kOh:
    case Viseme::kShChJ:
      return 0.6F;
    case Viseme::kR:
    case Viseme::kUh:
      return 0.3F;
    default:
      return 0;
  }
}

/// Of a sound in IPA by its articulation: [y] and [ø] are as round as [u] and [o].
float roundnessOfIpa(const std::string& ipa) {
  float roundest = 0;
  for (const IpaSound& sound : readIpa(ipa).sounds) roundest = std::max(roundest, asFloat(sound.rounding));
  return roundest;
}

/// Whether the lips of a sound in IPA come near each other without touching: β, ɸ.
bool isNearClosure(const std::string& ipa) {
  if (ipa.empty()) return false;
  const IpaReading reading = readIpa(ipa);
  return reading.sounds.size() == 1 && reading.sounds[0].place == Place::kBilabial && !reading.sounds[0].closesLips();
}

/// Diphthongs go from their first viseme's to their last one's.
float roundness(const LabelledPhone& said, Seconds time) {
  if (!said.ipa.empty() && !isDiphthong(said.phone)) return roundnessOfIpa(said.ipa);
  const Seconds length = said.span.duration();
  const double way = length > 0 ? std::clamp((time - said.span.start) / length, 0.0, 1.0) : 0.5;
  return asFloat((1 - way) * double{roundness(firstViseme(said.phone))} +
                 way * double{roundness(lastViseme(said.phone))});
}

/// How far the lips are kept from touching, 0 to 1.
float partingOf(const LabelledPhone& said) {
  constexpr float kNarrow = 0.15F;
  return isNearClosure(said.ipa) ? kNarrow : rowOf(said.phone).lips_parting;
}

bool isSealed(const LabelledPhone& said) { return partingOf(said) == 0; }

/// How lips that touch in phone `i` come together (`step` -1) or part (1): in half of the time for which they are
/// parted there, for an actor's have gone far apart where that is long. From the teeth and to them they go in the time
/// between both sounds, but let an F or V be one.
PresenceShape sealBeside(const std::vector<LabelledPhone>& phones, std::size_t i, std::ptrdiff_t step) {
  constexpr Seconds kShortest = 0.045, kLongest = 0.100, kHeld = 0.010;
  Seconds away = 0;
  for (std::ptrdiff_t k = signedIndex(i) + step; k >= 0 && k < std::ssize(phones); k += step) {
    const LabelledPhone& other = phones[unsignedIndex(k)];
    if (isSealed(other)) break;
    if (isLabiodental(other.phone)) {
      if (away > kLongest + kSeal.transition) break;
      const Seconds held = std::min(-kSeal.inside, kHeld + away / 4);
      return {std::clamp(away + kTuck.inside - held, kShortest, kLongest), -held};
    }
    away += other.span.duration();
  }
  return {std::clamp(away / 2 + kSeal.inside, kSeal.transition, kLongest), kSeal.inside};
}

/// What silence seals. Lips stand open before the first sound and come together after the last one: silence seals only
/// so far from what is said through parted lips that no seal is left there. Beside F and V it seals as B does.
SpeechLabels silences(const SpeechLabels& labels) {
  constexpr Seconds kSealReach = kSeal.transition - kSeal.inside;
  const auto waits = [](const LabelledPhone& said) { return isSealed(said) || isLabiodental(said.phone); };
  SpeechLabels silences;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    if (labels.phones[i].phone != Phone::kSil) continue;
    LabelledPhone& said = silences.phones.emplace_back(labels.phones[i]);
    if (i > 0 && !waits(labels.phones[i - 1])) said.span.start += kSealReach;
    if (i + 1 < labels.phones.size() && !waits(labels.phones[i + 1])) said.span.end -= kSealReach;
  }
  // A pause that is shorter than that begins after the phone that follows it.
  std::stable_sort(
      silences.phones.begin(), silences.phones.end(),
      [](const LabelledPhone& one, const LabelledPhone& other) { return one.span.start < other.span.start; });
  return silences;
}

/// How far the lips of B P M and their kin touch at each of `times`.
std::vector<float> sealOf(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<float> seal(times.size(), 0);
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    const LabelledPhone& said = labels.phones[i];
    if (said.phone == Phone::kSil || !isSealed(said)) continue;
    const PresenceShape before = sealBeside(labels.phones, i, -1), after = sealBeside(labels.phones, i, 1);
    const auto first =
        std::lower_bound(times.begin(), times.end(), said.span.start + before.inside - before.transition);
    const auto last = std::upper_bound(times.begin(), times.end(), said.span.end - after.inside + after.transition);
    for (auto time = first; time < last; ++time) {
      float& at = seal[unsignedIndex(time - times.begin())];
      at = std::max(at, asFloat(presenceAt(said.span, *time, before, after)));
    }
  }
  return seal;
}

constexpr PresenceShape kMove{.transition = 0.100, .inside = 0.020};

}  // namespace

std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<LipPose> lips(times.size(), LipPose{0, 0});
  std::vector<float> silent(times.size(), 0);
  const std::vector<float> sealed = sealOf(labels, times);
  for (std::size_t frame = 0; frame < lips.size(); ++frame) lips[frame].seal = sealed[frame];
  forEachPresence(silences(labels), times, kSeal, [&](std::size_t frame, const LabelledPhone&, double presence) {
    silent[frame] = std::max(silent[frame], asFloat(presence));
  });
  forEachPresence(labels, times, kParting, [&lips](std::size_t frame, const LabelledPhone& said, double presence) {
    if (isSealed(said)) return;
    lips[frame].parting = std::max(lips[frame].parting, asFloat(presence) * partingOf(said));
  });
  forEachPresence(labels, times, kTuck, [&lips](std::size_t frame, const LabelledPhone& said, double presence) {
    if (isLabiodental(said.phone)) lips[frame].tuck = std::max(lips[frame].tuck, asFloat(presence));
  });
  forEachPresence(labels, times, kRound, [&](std::size_t frame, const LabelledPhone& said, double presence) {
    lips[frame].rounding = std::max(lips[frame].rounding, asFloat(presence) * roundness(said, times[frame]));
  });
  for (std::size_t frame = 0; frame < lips.size(); ++frame) {
    LipPose& pose = lips[frame];
    // A B P M holds an F's lip back; silence lets it go as soon as it is on its way.
    pose.tuck = std::min(pose.tuck, 1 - pose.seal);
    pose.seal = std::max(pose.seal, silent[frame] * (1 - pose.tuck));
    pose.parting *= 1 - pose.seal;
  }
  return lips;
}

LipRounding unseenRounding(const Corpus& corpus) {
  const std::optional<VisemePoses> poses = storedPoses(corpus);
  if (!poses || !poses->mouth.hasLips() || !poses->mouth.has(MarkerRole::kRightLipCorner) ||
      !poses->mouth.has(MarkerRole::kLeftLipCorner))
    return {};
  const Eigen::RowVectorXd neutral =
      Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  const double width = poses->mouth.width(neutral);
  if (!(width > 0)) return {};
  LipRounding seen;
  for (const Viseme viseme : {Viseme::kOo, Viseme::kW}) {
    const Eigen::RowVectorXd moved = poses->lips.row(static_cast<Eigen::Index>(viseme));
    seen.narrowing = std::max(seen.narrowing, 1 - poses->mouth.width(neutral + moved) / width);
    seen.protrusion = std::max(seen.protrusion, poses->mouth.protrusion(moved) / width);
  }
  return {std::max(0.0, kRounded.narrowing - seen.narrowing), std::max(0.0, kRounded.protrusion - seen.protrusion)};
}

std::vector<TonguePose> tongueFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<TonguePose> poses(times.size());
  forEachPresence(labels, times, kMove, [&poses](std::size_t frame, const LabelledPhone& said, double presence) {
    const TongueTarget& target = rowOf(said.phone).tongue;
    const auto present = asFloat(presence);
    TonguePose& pose = poses[frame];
    pose.tip_up = std::max(pose.tip_up, present * target.tip_up);
    pose.tip_forward = std::max(pose.tip_forward, present * target.tip_forward);
    pose.back_up = std::max(pose.back_up, present * target.back_up);
  });
  return poses;
}

}  // namespace mouthpiece
