#include "synthesis/lip_seal.h"

#include <algorithm>

#include "synthesis/phone_presence.h"

namespace mouthpiece {

std::vector<double> lipSealFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  constexpr PresenceShape kSeal{.transition = 0.050, .inside = -0.020};
  std::vector<double> seal(times.size(), 0.0);
  forEachPresence(labels, times, kSeal, [&seal](std::size_t frame, Phone phone, double presence) {
    if (isBilabial(phone) || phone == Phone::kSil) seal[frame] = std::max(seal[frame], presence);
  });
  return seal;
}

}  // namespace mouthpiece
