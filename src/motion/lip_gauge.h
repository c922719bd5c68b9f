#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "motion/marker_layout.h"
#include "motion/motion_clip.h"

namespace mouthpiece {

/// Measures a mouth by the markers that have a role in the layout (MarkerRole), in mm. A pose is one row of positions
/// or displacements, 3 * markers wide; a measure is NaN where one of its markers was not seen, and must not be asked
/// for without them.
class LipGauge {
 public:
  using Pose = Eigen::Ref<const Eigen::RowVectorXd>;
  using Measure = double (LipGauge::*)(const Pose&) const;

  LipGauge() = default;  ///< without any marker
  explicit LipGauge(const MarkerLayout& layout);
  /// The roles are told by the names alone.
  explicit LipGauge(const std::vector<std::string>& marker_names);
  /// One that has both lips and both corners. Throws InputError that names the layout and the role it lacks.
  static LipGauge whole(const MarkerLayout& layout);

  [[nodiscard]] bool has(MarkerRole role) const { return column(role) >= 0; }
  [[nodiscard]] bool hasLips() const { return has(MarkerRole::kUpperLip) && has(MarkerRole::kLowerLip); }
  /// The marker's x column, y and z behind it; -1 without such a marker.
  [[nodiscard]] Eigen::Index column(MarkerRole role) const { return columns_[static_cast<std::size_t>(role)]; }

  /// Distance of the lips' middles: of their outer edges, so closed lips leave some.
  [[nodiscard]] double opening(const Pose& pose) const;
  /// The part of it along Y, negative when crossed: displacements add up in it.
  [[nodiscard]] double verticalOpening(const Pose& pose) const;
  /// Distance of the corners.
  [[nodiscard]] double width(const Pose& pose) const;
  /// How far forward the lips' middles are.
  [[nodiscard]] double protrusion(const Pose& pose) const;
  /// How far the lower lip hangs below a fixed place. The upper teeth stand still in a head that does, so it is least
  /// where the lip touches them, in F and V.
  [[nodiscard]] double lowerLipDrop(const Pose& pose) const;
  [[nodiscard]] double chinDrop(const Pose& pose) const;

  /// A measure of each row: lips.overFrames(&LipGauge::opening, clip.positions_mm).
  [[nodiscard]] std::vector<double> overFrames(Measure measure, const PositionMatrix& positions_mm) const;
  /// verticalOpening() of each row of any matrix.
  template <typename Rows>
  [[nodiscard]] Eigen::VectorXd verticalOpenings(const Eigen::MatrixBase<Rows>& rows) const {
    return rows.col(column(MarkerRole::kUpperLip) + 1) - rows.col(column(MarkerRole::kLowerLip) + 1);
  }

  /// The least opening in `span` and 20 ms around it, which labels are exact to; NaN where none was seen.
  [[nodiscard]] double tightest(const MotionClip& motion, const TimeSpan& span) const;
  /// The first and the last frame that tightest() looks at.
  [[nodiscard]] static std::pair<Eigen::Index, Eigen::Index> framesAround(const TimeSpan& span, double frame_rate_hz,
                                                                          Eigen::Index frame_count);

 private:
  std::array<Eigen::Index, kMarkerRoles.size()> columns_{-1, -1, -1, -1, -1};  ///< one a role
};

}  // namespace mouthpiece
