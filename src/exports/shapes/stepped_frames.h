#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "deform/kernel/face_animation.h"
#include "exports/shapes/principal_shapes.h"
#include "exports/shapes/trajectories.h"

namespace mouthpiece {

/// Displacements of the moving vertices over a line as whole multiples of a step: half the room of floats, which is
/// most of what a line of some seconds takes in memory. Panel by panel, as principalShapes() reads them.
class SteppedFrames {
 public:
  /// Those of the given frames from `rest` (1 x frames.width), each coordinate off by half of `step` (mesh unit) at
  /// most; nullopt where one is no number or over 32,767 steps.
  static std::optional<SteppedFrames> of(const FrameMaker& frames, std::span<const Eigen::Index> which,
                                         const Eigen::RowVectorXf& rest, float step);

  [[nodiscard]] Eigen::Index frameCount() const { return frame_count_; }
  [[nodiscard]] float at(Eigen::Index frame, Eigen::Index column) const;
  /// Of the eight vertices from `first` (a multiple of eight) on: frames x kPanelWidth as a panel has them, zeros for
  /// those that there are not; and the square of each one's largest displacement.
  void panel(Eigen::Index first, float* displacements, float* largest_squared) const;

 private:
  SteppedFrames(Eigen::Index frame_count, Eigen::Index width, float step);
  /// Frames from `first` on, a row each; false where a number has no steps.
  bool set(Eigen::Index first, const RowMajorMatrixF& places, const Eigen::RowVectorXf& rest);

  Eigen::Index frame_count_;
  float step_;
  std::unique_ptr<std::int16_t[]> steps_;  ///< panels x frames x kPanelWidth
};

/// principalShapes() of the given frames, which are held as SteppedFrames where they can be: the tolerance makes up for
/// the steps.
PrincipalShapes principalShapesOf(const FrameMaker& frames, std::span<const Eigen::Index> which,
                                  const VertexPositions& rest, double metres_per_unit,
                                  const PrincipalShapesOptions& options);

}  // namespace mouthpiece
