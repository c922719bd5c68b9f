#pragma once

#include <span>
#include <utility>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

/// Where the lower lip goes in F and V: its rim, just in front of where the lips meet, comes to lie under the edge of
/// the upper teeth, and the upper lip is lifted off that edge. In a head without upper teeth the upper lip is raised by
/// kRaised, and the lower one's rim goes kTuckedUp over and kTuckedBehind the place where the upper one's rests (shares
/// of the mouth's width): it is hidden behind the upper lip, and what one sees of the lower one is thinner. Immutable.
class LipTuck {
 public:
  static constexpr double kRaised = 0.04, kTuckedUp = 0.03, kTuckedBehind = 0.12;

  /// `mesh` stands upright. `share`: of all these ways, FaceBinding::tuck.
  LipTuck(const FaceMesh& mesh, const ControlMesh& control, double share);

  /// Moves rims, outer markers and those of the chin near them by as much as LipGap::tuck says, and continuously with
  /// it. `gaps`: of lipPairs(), or none; `points`: leadingPoints().
  void apply(std::span<const LipGap> gaps, MarkerPositions& points) const;

  /// Under the teeth's edge, one for each of lipPairs().
  [[nodiscard]] const std::vector<Eigen::Vector3d>& places() const { return places_; }

 private:
  void takeSkin(const ControlMesh& control);

  struct Target {
    double raised_to = 0;  ///< the upper rim's height
    bool has_teeth = false;
    double share = 0;                            ///< how far the pair goes: not at the corners
    std::vector<std::pair<int, double>> skin{};  ///< markers under the lip, and their shares of the lower edge's way
  };
  std::vector<LipPair> pairs_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<Target> targets_;  ///< one for each of lipPairs()
  double mouth_width_ = 0;
};

}  // namespace mouthpiece
