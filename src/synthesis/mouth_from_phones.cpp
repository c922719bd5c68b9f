#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/index.h"
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
  const Seconds inside = std::min(shape.inside, 0.5 * span.duration());
  const Seconds outside = std::max(span.start + inside - time, time - (span.end - inside));
  const double u = std::clamp(outside / shape.transition, 0.0, 1.0);
  return 0.5 * (1 + std::cos(std::numbers::pi * u));
}

/// Every phone that is present at any of `times` (rising), with how much it is, in (0, 1]: 1 between its ramps.
void forEachPresence(const SpeechLabels& labels, std::span<const Seconds> times, const PresenceShape& shape,
                     const std::function<void(std::size_t time, Phone phone, double presence)>& visit) {
  const auto& phones = labels.phones;
  const Seconds reach = shape.transition - shape.inside;
  std::size_t first_near = 0;
  for (std::size_t frame = 0; frame < times.size(); ++frame) {
    const Seconds time = times[frame];
    while (first_near < phones.size() && phones[first_near].span.end + reach < time) ++first_near;
    for (std::size_t i = first_near; i < phones.size() && phones[i].span.start - reach < time; ++i) {
      if (const double presence = presenceAt(phones[i].span, time, shape); presence > 0)
        visit(frame, phones[i].phone, presence);
    }
  }
}

constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
constexpr PresenceShape kParting{.transition = 0.050};

bool isSealed(Phone phone) { return rowOf(phone).lips_parting == 0; }

constexpr PresenceShape kMove{.transition = 0.100, .inside = 0.020};

}  // namespace

std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<LipPose> lips(times.size(), LipPose{0, 0});
  forEachPresence(labels, times, kSeal, [&lips](std::size_t frame, Phone phone, double presence) {
    if (isSealed(phone)) lips[frame].seal = std::max(lips[frame].seal, asFloat(presence));
  });
  forEachPresence(labels, times, kParting, [&lips](std::size_t frame, Phone phone, double presence) {
    if (isSealed(phone)) return;
    lips[frame].parting = std::max(lips[frame].parting, asFloat(presence) * rowOf(phone).lips_parting);
  });
  for (LipPose& pose : lips) pose.parting *= 1 - pose.seal;
  return lips;
}

std::vector<TonguePose> tongueFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<TonguePose> poses(times.size());
  forEachPresence(labels, times, kMove, [&poses](std::size_t frame, Phone phone, double presence) {
    const TongueTarget& target = rowOf(phone).tongue;
    const auto present = asFloat(presence);
    TonguePose& pose = poses[frame];
    pose.tip_up = std::max(pose.tip_up, present * target.tip_up);
    pose.tip_forward = std::max(pose.tip_forward, present * target.tip_forward);
    pose.back_up = std::max(pose.back_up, present * target.back_up);
  });
  return poses;
}

}  // namespace mouthpiece
