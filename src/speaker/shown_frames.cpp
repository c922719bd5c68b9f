#include "speaker/live_parts.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {

void lerpFrame(const ShownFrame& from, const ShownFrame& rest, double way, ShownFrame& to) {
  const auto mixed = [way](double a, double b) { return std::lerp(a, b, way); };
  const auto mixedFloat = [way](float a, float b) { return asFloat(std::lerp(double{a}, double{b}, way)); };
  std::transform(from.markers_mm.begin(), from.markers_mm.end(), rest.markers_mm.begin(), to.markers_mm.begin(), mixed);
  std::transform(from.arkit.begin(), from.arkit.end(), rest.arkit.begin(), to.arkit.begin(), mixedFloat);
  std::transform(from.face_markers.begin(), from.face_markers.end(), rest.face_markers.begin(), to.face_markers.begin(),
                 mixed);
  std::transform(from.lip_gaps.begin(), from.lip_gaps.end(), rest.lip_gaps.begin(), to.lip_gaps.begin(),
                 [&](const LipGap& a, const LipGap& b) {
                   return LipGap{mixed(a.opened, b.opened), mixed(a.least, b.least), mixed(a.tuck, b.tuck)};
                 });
  to.lips = {mixedFloat(from.lips.seal, rest.lips.seal), mixedFloat(from.lips.parting, rest.lips.parting),
             mixedFloat(from.lips.tuck, rest.lips.tuck), mixedFloat(from.lips.rounding, rest.lips.rounding)};
  to.gaze = {mixedFloat(from.gaze.yaw, rest.gaze.yaw), mixedFloat(from.gaze.pitch, rest.gaze.pitch)};
  to.tongue = {mixedFloat(from.tongue.tip_up, rest.tongue.tip_up),
               mixedFloat(from.tongue.tip_forward, rest.tongue.tip_forward),
               mixedFloat(from.tongue.back_up, rest.tongue.back_up)};
}

ShownFrame& FrameRing::add() {
  if (count_ == frames_.size()) {
    std::rotate(frames_.begin(), frames_.begin() + signedIndex(first_), frames_.end());
    first_ = 0;
    frames_.resize(std::max<std::size_t>(16, 2 * frames_.size()));
  }
  return frames_[(first_ + count_++) % frames_.size()];
}

void FrameRing::take(ShownFrame& frame) {
  MOUTHPIECE_EXPECT(count_ > 0);
  std::swap(frame, frames_[first_]);
  first_ = (first_ + 1) % frames_.size();
  --count_;
}

}  // namespace mouthpiece
