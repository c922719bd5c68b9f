#pragma once

#include <span>
#include <vector>

#include "base/errors.h"
#include "base/index.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// How the lips of a pair lie in one frame.
struct LipGap {
  double opened = 1;  ///< the share of the gap between their outer markers: 0 where they touch though stretched
  double least = 0;   ///< they are this far apart at least; the mesh's unit
  double tuck = 0;    ///< how far the lower lip has gone under the upper teeth's edge, 0 to 1
};

/// What moves a face in one frame. A view: what it looks at must outlive it.
struct FacePose {
  std::span<const double> markers;  ///< x y z of each marker side by side, the mesh's unit
  std::span<const LipGap> lips;     ///< one for each of lipPairs(); empty: only the markers are known

  explicit FacePose(std::span<const double> markers_at, std::span<const LipGap> lips_at = {})
      : markers(markers_at), lips(lips_at) {}
  FacePose(const MarkerPositions& markers_at, std::span<const LipGap> lips_at = {})
      : FacePose(std::span(markers_at.data(), unsignedIndex(markers_at.size())), lips_at) {}
};

/// What moves a face, frame by frame (FaceRig::retarget).
class FaceMotion {
 public:
  FaceMotion() = default;
  /// `markers`: frames x (3 * markers), x y z of each side by side, the mesh's unit. `lip_pairs`: of lipPairs(), 0
  /// where only the markers are known; their gaps are LipGap{} until they are told.
  explicit FaceMotion(PositionMatrix markers, std::size_t lip_pairs = 0)
      : markers_(std::move(markers)), lip_pairs_(lip_pairs), lips_(frameCount() * lip_pairs) {}

  [[nodiscard]] std::size_t frameCount() const { return unsignedIndex(markers_.rows()); }
  [[nodiscard]] const PositionMatrix& markers() const { return markers_; }
  [[nodiscard]] FacePose pose(FrameIndex frame) const {
    MOUTHPIECE_EXPECT(frame.value < frameCount());
    return FacePose(std::span(markers_.row(signedIndex(frame.value)).data(), unsignedIndex(markers_.cols())),
                    std::span(lips_).subspan(frame.value * lip_pairs_, lip_pairs_));
  }
  void setLipGap(FrameIndex frame, std::size_t pair, const LipGap& gap) {
    MOUTHPIECE_EXPECT(frame.value < frameCount() && pair < lip_pairs_);
    lips_[frame.value * lip_pairs_ + pair] = gap;
  }

 private:
  PositionMatrix markers_;
  std::size_t lip_pairs_ = 0;
  std::vector<LipGap> lips_;  ///< frame after frame
};

}  // namespace mouthpiece
