#include "synthesis/phone_presence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mouthpiece {
namespace {

double presenceAt(const TimeSpan& span, Seconds time, const PresenceShape& shape) {
  const Seconds inside = std::min(shape.inside, 0.5 * span.duration());
  const Seconds outside = std::max(span.start + inside - time, time - (span.end - inside));
  const double u = std::clamp(outside / shape.transition, 0.0, 1.0);
  return 0.5 * (1 + std::cos(std::numbers::pi * u));
}

}  // namespace

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

}  // namespace mouthpiece
