#include "expression/live_face.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/smooth_step.h"
#include "expression/ruled_face.h"

namespace mouthpiece {

LiveFace::LiveFace(const ExpressionOptions& options, double frame_rate_hz)
    : blinks_(options.upper_face != UpperFaceSource::kMouth),
      looks_(options.gaze),
      rate_hz_(frame_rate_hz),
      blink_dice_(options.seed),
      gaze_dice_(options.seed + 2),
      blink_(-kOpenAgain - blink_dice_.between(0, kUsualBetweenBlinks)),
      next_look_(gaze_dice_.between(0.7, 1.8)) {
  if (options.upper_face == UpperFaceSource::kCaptured || options.head || options.hasMood())
    throw InputError(
        "found a captured upper face, head motion or a mood for a stream; expected blinks by rules and gaze alone, "
        "since the line is not known as a whole");
}

LiveFace::Pose LiveFace::next() {
  const Seconds time = asReal(frame_++) / rate_hz_;
  Pose pose;
  if (blinks_) pose.closed = closedAt(time);
  if (looks_) pose.gaze = gazeAt(time);
  return pose;
}

double LiveFace::closedAt(Seconds time) {
  for (; asReal(steps_) * kBlinkStep <= time; ++steps_) {
    const Seconds now = asReal(steps_) * kBlinkStep;
    if (blinksNow(now - blink_, 1, blink_dice_)) blink_ = now;
  }
  return lidsClosed(time - blink_);
}

GazeTurn LiveFace::gazeAt(Seconds time) {
  constexpr double kGoesAside = 0.2;  // of the shifts
  while (next_look_ <= time) {
    from_ = to_;
    to_ = {next_look_, 0, 0};
    const bool comes_back = std::exchange(is_aside_, !is_aside_ && gaze_dice_.falls(kGoesAside));
    if (is_aside_) {
      const double side = gaze_dice_.falls(0.5) ? 1 : -1;
      to_.yaw = side * gaze_dice_.between(5, 11);
      to_.pitch = gaze_dice_.between(-5, 3);
    } else if (!comes_back) {
      to_.yaw = gaze_dice_.between(-1.2, 1.2);
      to_.pitch = gaze_dice_.between(-0.8, 0.8);
    }
    next_look_ += is_aside_ ? gaze_dice_.between(0.45, 1.1) : gaze_dice_.between(0.7, 1.8);
  }
  constexpr double kRadians = std::numbers::pi / 180;
  const double share = smoothStep((time - to_.start) / saccadeLasts(from_.yaw, from_.pitch, to_.yaw, to_.pitch));
  return {static_cast<float>(kRadians * std::lerp(from_.yaw, to_.yaw, share)),
          static_cast<float>(kRadians * std::lerp(from_.pitch, to_.pitch, share))};
}

}  // namespace mouthpiece
