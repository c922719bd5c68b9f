#include "synthesis/tongue.h"

#include <algorithm>

#include "synthesis/phone_presence.h"

namespace mouthpiece {
namespace {

constexpr PresenceShape kMove{.transition = 0.100, .inside = 0.020};

TonguePose targetOf(Phone phone) {
  switch (phone) {
    case Phone::kL:
    case Phone::kN:
    case Phone::kT:
    case Phone::kD:
      return {1.0F, 0.0F, 0.0F};
    case Phone::kTH:
    case Phone::kDH:
      return {0.2F, 1.0F, 0.0F};
    case Phone::kK:
    case Phone::kG:
    case Phone::kNG:
      return {0.0F, 0.0F, 1.0F};
    case Phone::kS:
    case Phone::kZ:
      return {0.7F, 0.1F, 0.0F};
    case Phone::kSH:
    case Phone::kZH:
    case Phone::kCH:
    case Phone::kJH:
      return {0.6F, 0.0F, 0.2F};
    case Phone::kR:
    case Phone::kER:
      return {0.4F, 0.0F, 0.3F};
    case Phone::kIY:
    case Phone::kY:
      return {0.1F, 0.1F, 0.4F};
    case Phone::kIH:
    case Phone::kEY:
      return {0.1F, 0.1F, 0.2F};
    default:
      return {};
  }
}

}  // namespace

std::vector<TonguePose> tongueFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<TonguePose> poses(times.size());
  forEachPresence(labels, times, kMove, [&poses](std::size_t frame, Phone phone, double presence) {
    const TonguePose target = targetOf(phone);
    const auto present = static_cast<float>(presence);
    TonguePose& pose = poses[frame];
    pose.tip_up = std::max(pose.tip_up, present * target.tip_up);
    pose.tip_forward = std::max(pose.tip_forward, present * target.tip_forward);
    pose.back_up = std::max(pose.back_up, present * target.back_up);
  });
  return poses;
}

}  // namespace mouthpiece
