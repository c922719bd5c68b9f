#pragma once

#include <array>
#include <cstddef>
#include <mutex>
#include <vector>

#include "deform/surface/face_motion.h"
#include "mouthpiece/motion.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {

/// All that a frame shows; the mesh is posed when it is pulled.
struct ShownFrame {
  std::vector<double> markers_mm;
  std::array<float, kArkitShapes> arkit{};
  LipPose lips;
  TonguePose tongue;
  std::vector<double> face_markers;  ///< empty: no face
  std::vector<LipGap> lip_gaps;
  GazeTurn gaze;
};

/// `to` becomes what lies between `from` and `rest`, as far as `way` (0 to 1) says. All have the same sizes.
void lerpFrame(const ShownFrame& from, const ShownFrame& rest, double way, ShownFrame& to);

/// A ring of frames that grows while they are added and gives no memory back: what is taken leaves room for others.
class FrameRing {
 public:
  [[nodiscard]] std::size_t size() const { return count_; }
  /// A frame at the end, to be filled; it holds what some earlier one held.
  ShownFrame& add();
  /// The first frame changes places with `frame`. There is one.
  void take(ShownFrame& frame);

 private:
  std::vector<ShownFrame> frames_;
  std::size_t first_ = 0, count_ = 0;
};

}  // namespace mouthpiece
