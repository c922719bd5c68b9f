#include "synthesis/lips.h"

#include <algorithm>

#include "base/index.h"
#include "synthesis/phone_presence.h"

namespace mouthpiece {
namespace {

constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
constexpr PresenceShape kParting{.transition = 0.050};

bool isSealed(Phone phone) { return rowOf(phone).lips_parting == 0; }

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

}  // namespace mouthpiece
