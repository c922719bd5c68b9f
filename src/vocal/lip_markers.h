#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace mouthpiece {

/// Columns of the markers that the mouth's contacts are measured with.
struct LipMarkers {
  bool has_lips = false, has_chin = false;
  Eigen::Index upper_y = 0, lower_y = 0;  ///< LIP_UP_MID, LIP_LO_MID
  Eigen::Index chin_y = 0;                ///< CHIN_MID, or another whose name begins with CHIN

  /// How much further than neutral the lips are open, mm; `displacement`: one row of 3 * markers.
  template <typename Row>
  [[nodiscard]] double opening(const Row& displacement) const {
    return displacement(upper_y) - displacement(lower_y);
  }
};

LipMarkers findLipMarkers(const std::vector<std::string>& marker_names);

/// `value`, but never under `floor`, with a soft approach over 1 mm above it.
double softFloor(double value, double floor);

}  // namespace mouthpiece
