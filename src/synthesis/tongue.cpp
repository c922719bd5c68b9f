#include "synthesis/tongue.h"

#include <algorithm>

#include "base/index.h"
#include "synthesis/phone_presence.h"

namespace mouthpiece {
namespace {

constexpr PresenceShape kMove{.transition = 0.100, .inside = 0.020};

}  // namespace

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
