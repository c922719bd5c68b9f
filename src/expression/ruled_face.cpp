// Blinks, brows, head and gaze by rules: rates and lengths are from the literature (docs/theory/expression.md).
#include "expression/ruled_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/index.h"
#include "base/smooth_step.h"

namespace mouthpiece {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr Seconds kRampAtEnds = 0.3;

// How often blinks come (Bentivoglio et al. 1997, in conversation 26 a minute, at rest 17), and above all where nothing
// is said.
constexpr double kBlinksASecond = 20.0 / 60;
constexpr double kInPause = 2.5, kInSpeech = 0.7;
constexpr Seconds kLeastBetweenBlinks = 0.9, kNearPause = 0.1;

bool isByPause(const std::vector<Beat>& beats, Seconds time) {
  auto beat = std::lower_bound(beats.begin(), beats.end(), time - kNearPause,
                               [](const Beat& one, Seconds from) { return one.span.end < from; });
  for (; beat != beats.end() && beat->span.start < time + kNearPause; ++beat) {
    if (beat->is_silence) return true;
  }
  return false;
}

std::vector<Seconds> drawnBlinks(const std::vector<Beat>& beats, Seconds end, Dice& dice) {
  std::vector<Seconds> blinks;
  Seconds last = -dice.between(0, kUsualBetweenBlinks);
  for (Seconds time = 0; time < end - kOpenAgain; time += kBlinkStep) {
    if (!blinksNow(time - last, isByPause(beats, time) ? kInPause : kInSpeech, dice)) continue;
    blinks.push_back(time);
    last = time;
  }
  return blinks;
}

/// Rises before `peak`, stays, falls.
double raised(Seconds time, Seconds peak, Seconds rise, Seconds stays, Seconds fall) {
  return smoothStep((time - peak + rise) / rise) * (1 - smoothStep((time - peak - stays) / fall));
}

std::size_t shapeNumber(std::string_view name) {
  return unsignedIndex(std::find(kArkitNames.begin(), kArkitNames.end(), name) - kArkitNames.begin());
}

void addTo(PositionMatrix& weights, std::initializer_list<std::string_view> shapes, std::size_t frame, double share) {
  for (const std::string_view shape : shapes) {
    double& weight = weights(signedIndex(frame), signedIndex(shapeNumber(shape)));
    weight = std::min(1.0, weight + share);
  }
}

/// 0 at both ends of a line, 1 inside.
double insideLine(std::span<const Seconds> times, Seconds time) {
  return smoothStep((time - times.front()) / kRampAtEnds) * smoothStep((times.back() - time) / kRampAtEnds);
}

/// A few slow waves that never repeat within a line.
struct Sway {
  std::array<double, 3> hertz{}, phase{};
  explicit Sway(Dice& dice) {
    for (std::size_t i = 0; i < hertz.size(); ++i) {
      hertz[i] = dice.between(0.08, 0.25) * static_cast<double>(i + 1);
      phase[i] = dice.between(0, 2 * std::numbers::pi);
    }
  }
  [[nodiscard]] double at(Seconds time) const {
    double sum = 0;
    for (std::size_t i = 0; i < hertz.size(); ++i)
      sum += std::sin(2 * std::numbers::pi * hertz[i] * time + phase[i]) / static_cast<double>(i + 1);
    return sum / 1.5;
  }
};

}  // namespace

double lidsClosed(Seconds since) {
  if (since < 0) return 0;
  if (since < kCloses) return smoothStep(since / kCloses);
  return 1 - smoothStep((since - kCloses - kClosed) / kOpens);
}

bool blinksNow(Seconds since, double more, Dice& dice) {
  const double rate = kBlinksASecond * more * since / kUsualBetweenBlinks;
  return dice.falls(since < kLeastBetweenBlinks ? 0 : rate * kBlinkStep);
}

Seconds saccadeLasts(double from_yaw, double from_pitch, double to_yaw, double to_pitch) {
  return 0.021 + 0.0022 * std::hypot(to_yaw - from_yaw, to_pitch - from_pitch);
}

PositionMatrix ruledUpperFace(const std::vector<Beat>& beats, bool asks, std::span<const Seconds> times, Dice& dice,
                              std::vector<Seconds>& blinks) {
  PositionMatrix weights = PositionMatrix::Zero(std::ssize(times), std::ssize(kArkitNames));
  blinks = drawnBlinks(beats, times.back(), dice);
  struct Rise {
    Seconds peak, stays;
    double share;
  };
  std::vector<Rise> rises;
  for (const Beat& beat : beats) {
    if (!beat.is_accented) continue;
    const double share = dice.between(0.2, 0.45);
    if (dice.falls(beat.ends_phrase ? 0.6 : 0.35)) rises.push_back({beat.accent, 0.05, share});
  }
  const auto last = std::find_if(beats.rbegin(), beats.rend(), [](const Beat& beat) { return !beat.is_silence; });
  if (asks && last != beats.rend()) rises.push_back({last->accent, last->span.end - last->accent + 0.2, 0.5});
  for (std::size_t k = 0; k < times.size(); ++k) {
    double closed = 0, up = 0;
    for (const Seconds blink : blinks) closed = std::max(closed, lidsClosed(times[k] - blink));
    for (const Rise& rise : rises) up = std::max(up, rise.share * raised(times[k], rise.peak, 0.2, rise.stays, 0.35));
    addTo(weights, {"EyeBlinkLeft", "EyeBlinkRight"}, k, closed);
    addTo(weights, {"BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight"}, k, up);
  }
  return weights;
}

std::vector<HeadTurn> ruledHead(const std::vector<Beat>& beats, std::span<const Seconds> times, Dice& dice) {
  const Sway yaw(dice), pitch(dice), roll(dice);
  struct Nod {
    Seconds time;
    double degrees;
  };
  std::vector<Nod> nods;
  for (const Beat& beat : beats) {
    const double degrees = dice.between(1.2, 3);
    if (beat.is_accented && dice.falls(beat.ends_phrase ? 0.8 : 0.5)) nods.push_back({beat.accent, degrees});
  }
  std::vector<HeadTurn> turns(times.size());
  for (std::size_t k = 0; k < times.size(); ++k) {
    double down = 0;
    for (const Nod& nod : nods) down = std::max(down, nod.degrees * raised(times[k], nod.time, 0.2, 0.03, 0.4));
    const double inside = kRadians * insideLine(times, times[k]);
    turns[k] = {static_cast<float>(inside * 2.0 * yaw.at(times[k])),
                static_cast<float>(inside * (1.0 * pitch.at(times[k]) - down)),
                static_cast<float>(inside * 1.2 * roll.at(times[k]))};
  }
  return turns;
}

std::vector<GazeTurn> ruledGaze(const std::vector<Beat>& beats, std::span<const Seconds> times,
                                std::span<const HeadTurn> head, Dice& dice) {
  struct Fixation {
    Seconds start;
    double yaw, pitch;  // degrees
  };
  // Away where a phrase begins (Kendon 1967), back to the listener soon; small shifts in between.
  std::vector<Fixation> looks{{times.front(), 0, 0}};
  Seconds busy_until = 0;
  for (const Beat& beat : beats) {
    const bool goes = beat.starts_phrase && dice.falls(0.45);
    const double side = dice.falls(0.5) ? 1 : -1;
    const double yaw = side * dice.between(5, 11), pitch = dice.between(-5, 3);
    const Seconds away = dice.between(0.45, 1.1), start = std::max(0.05, beat.span.start - 0.1);
    if (!goes || start < busy_until) continue;
    looks.push_back({start, yaw, pitch});
    looks.push_back({start + away, 0, 0});
    busy_until = start + away + 1;
  }
  std::vector<Fixation> all;
  for (std::size_t i = 0; i < looks.size(); ++i) {
    all.push_back(looks[i]);
    const Seconds end = i + 1 < looks.size() ? looks[i + 1].start : times.back();
    for (Seconds time = looks[i].start + dice.between(0.7, 1.8); time < end - 0.3; time += dice.between(0.7, 1.8))
      all.push_back({time, looks[i].yaw + dice.between(-1.2, 1.2), looks[i].pitch + dice.between(-0.8, 0.8)});
  }
  std::vector<GazeTurn> gaze(times.size());
  std::size_t now = 0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    while (now + 1 < all.size() && all[now + 1].start <= times[k]) ++now;
    const Fixation& to = all[now];
    const Fixation& from = now > 0 ? all[now - 1] : to;
    const double share = smoothStep((times[k] - to.start) / saccadeLasts(from.yaw, from.pitch, to.yaw, to.pitch));
    const double inside = insideLine(times, times[k]);
    const HeadTurn turned = head.empty() ? HeadTurn{} : head[k];
    constexpr double kMost = 30 * kRadians;
    gaze[k] = {static_cast<float>(std::clamp(
                   inside * kRadians * std::lerp(from.yaw, to.yaw, share) - double{turned.yaw}, -kMost, kMost)),
               static_cast<float>(std::clamp(
                   inside * kRadians * std::lerp(from.pitch, to.pitch, share) - double{turned.pitch}, -kMost, kMost))};
  }
  return gaze;
}

}  // namespace mouthpiece
