#include "synthesis/lips.h"

#include <algorithm>

#include "synthesis/phone_presence.h"

namespace mouthpiece {
namespace {

constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
constexpr PresenceShape kParting{.transition = 0.050};
constexpr float kLeastParting = 0.4F;

bool isSealed(Phone phone) { return isBilabial(phone) || phone == Phone::kSil; }

}  // namespace

std::vector<LipPose> lipsFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<LipPose> lips(times.size(), LipPose{0, 0});
  forEachPresence(labels, times, kSeal, [&lips](std::size_t frame, Phone phone, double presence) {
    if (isSealed(phone)) lips[frame].seal = std::max(lips[frame].seal, static_cast<float>(presence));
  });
  forEachPresence(labels, times, kParting, [&lips](std::size_t frame, Phone phone, double presence) {
    if (isSealed(phone)) return;
    const float wanted = phone == Phone::kTH || phone == Phone::kDH ? 1.0F : kLeastParting;
    lips[frame].parting = std::max(lips[frame].parting, static_cast<float>(presence) * wanted);
  });
  for (LipPose& pose : lips) pose.parting *= 1 - pose.seal;
  return lips;
}

}  // namespace mouthpiece
