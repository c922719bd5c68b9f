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

double presenceAt(const TimeSpan& span, Seconds time, const PresenceShape& shape) {
  const Seconds inside = std::min(shape.inside, std::max(0.0, 0.5 * span.duration()));
  const Seconds outside = std::max(span.start + inside - time, time - (span.end - inside));
  const double u = std::clamp(outside / shape.transition, 0.0, 1.0);
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
      if (const double presence = presenceAt(phones[i].span, time, shape); presence > 0)
        visit(frame, phones[i], presence);
    }
  }
}

constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
constexpr PresenceShape kParting{.transition = 0.050};
constexpr PresenceShape kRound{.transition = 0.120, .inside = 0.020};
/// The same in an F or V: lips go from the teeth to each other at the last moment.
constexpr PresenceShape kLateSeal{.transition = 0.040, .inside = -0.010};
constexpr PresenceShape kBesideSeal{.transition = 0.040};
constexpr PresenceShape kTuck{.transition = 0.090, .inside = 0.015};

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

/// Those of `labels` that seal the lips. Lips stand open before the first sound and come together after the last one:
/// silence seals only so far from what is said through parted lips that no seal is left there. Beside F and V it seals
/// as B does (kLateSeal).
SpeechLabels sealing(const SpeechLabels& labels) {
  constexpr Seconds kSealReach = kSeal.transition - kSeal.inside;
  const auto waits = [](const LabelledPhone& said) { return isSealed(said) || isLabiodental(said.phone); };
  SpeechLabels sealing;
  for (std::size_t i = 0; i < labels.phones.size(); ++i) {
    if (!isSealed(labels.phones[i])) continue;
    LabelledPhone& said = sealing.phones.emplace_back(labels.phones[i]);
    if (said.phone != Phone::kSil) continue;
    if (i > 0 && !waits(labels.phones[i - 1])) said.span.start += kSealReach;
    if (i + 1 < labels.phones.size() && !waits(labels.phones[i + 1])) said.span.end -= kSealReach;
  }
  // A pause that is shorter than that begins after the phone that follows it.
  std::stable_sort(
      sealing.phones.begin(), sealing.phones.end(),
      [](const LabelledPhone& one, const LabelledPhone& other) { return one.span.start < other.span.start; });
  return sealing;
}

constexpr PresenceShape kMove{.transition = 0.100, .inside = 0.020};

}  // namespace

std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<LipPose> lips(times.size(), LipPose{0, 0});
  std::vector<float> silent(times.size(), 0), late(times.size(), 0);
  const SpeechLabels sealed = sealing(labels);
  forEachPresence(sealed, times, kSeal, [&](std::size_t frame, const LabelledPhone& said, double presence) {
    float& seal = said.phone == Phone::kSil ? silent[frame] : lips[frame].seal;
    seal = std::max(seal, asFloat(presence));
  });
  forEachPresence(sealed, times, kLateSeal, [&](std::size_t frame, const LabelledPhone& said, double presence) {
    if (said.phone != Phone::kSil) late[frame] = std::max(late[frame], asFloat(presence));
  });
  forEachPresence(labels, times, kBesideSeal, [&](std::size_t frame, const LabelledPhone& said, double presence) {
    if (isLabiodental(said.phone)) lips[frame].seal += asFloat(presence) * (late[frame] - lips[frame].seal);
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
    pose.tuck *= 1 - pose.seal;
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
