#include "synthesis/tongue.h"

#include <algorithm>
#include <array>
#include <numbers>

#include <cmath>

namespace mouthpiece {
namespace {

constexpr Seconds kTransition = 0.100;
constexpr Seconds kInside = 0.020;  ///< of the transition, the part that lies inside the phone

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

/// 0 before the phone's transition, 1 inside the phone, cosine ramps between.
float presence(const TimeSpan& span, Seconds time) {
  const Seconds inside = std::min(kInside, 0.5 * span.duration());
  const Seconds outside = std::max(span.start + inside - time, time - (span.end - inside));
  const double u = std::clamp(outside / kTransition, 0.0, 1.0);
  return static_cast<float>(0.5 * (1 + std::cos(std::numbers::pi * u)));
}

}  // namespace

std::vector<TonguePose> tongueFromPhones(const SpeechLabels& labels, std::span<const Seconds> times) {
  std::vector<TonguePose> poses;
  poses.reserve(times.size());
  std::size_t first_near = 0;
  for (const Seconds time : times) {
    while (first_near < labels.phones.size() && labels.phones[first_near].span.end + kTransition < time) ++first_near;
    TonguePose pose;
    for (std::size_t i = first_near; i < labels.phones.size() && labels.phones[i].span.start - kTransition < time;
         ++i) {
      const TonguePose target = targetOf(labels.phones[i].phone);
      const float present = presence(labels.phones[i].span, time);
      pose.tip_up = std::max(pose.tip_up, present * target.tip_up);
      pose.tip_forward = std::max(pose.tip_forward, present * target.tip_forward);
      pose.back_up = std::max(pose.back_up, present * target.back_up);
    }
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace mouthpiece
