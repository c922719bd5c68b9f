#pragma once

#include <span>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// Where the lower lip goes in F and V: its rim, just in front of where the lips meet, comes to lie under the edge of
/// the upper teeth, and the upper lip is lifted off that edge. In a head without upper teeth the edge is thought to lie
/// kEdgeBehind and kEdgeBelow the upper lip's rim (shares of the mouth's width). Immutable.
class LipTuck {
 public:
  static constexpr double kEdgeBehind = 0.06, kEdgeBelow = 0.02;

  /// `mesh` stands upright.
  LipTuck(const FaceMesh& mesh, const ControlMesh& control);

  /// Moves rims and outer markers by as much as LipGap::tuck says, and continuously with it. `gaps`: of lipPairs(), or
  /// none; `points`: leadingPoints().
  void apply(std::span<const LipGap> gaps, MarkerPositions& points) const;

  /// Under the teeth's edge, one for each of lipPairs().
  [[nodiscard]] const std::vector<Eigen::Vector3d>& places() const { return places_; }

 private:
  std::vector<LipPair> pairs_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> shares_;  ///< how far each pair goes: not at the corners
  double mouth_width_ = 0;
};

}  // namespace mouthpiece
