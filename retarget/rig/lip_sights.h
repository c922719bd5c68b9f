#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_fit.h"
#include "retarget/rig/lip_surfaces.h"

namespace mouthpiece {

/// Skin in upright sections across the mouth, but for its corners.
class LipSights {
 public:
  /// Upright sections in which one looks between the lips, a sixth of a millimetre apart on a man.
  static constexpr std::size_t kSections = 20 * LipContact::kColumns;
  static constexpr double kFrom = 0.2;  ///< of the mouth from either corner: further to the sides the lips become one

  /// `from` and `along`: the mouth's right corner and the way to the left one.
  LipSights(const VertexPositions& vertices, const Eigen::Vector3d& from, const Eigen::Vector3d& along)
      : vertices_(vertices), from_(from), along_(along) {}

  /// The foremost place of a lip in each section; nullopt: it has none.
  using Fronts = std::array<std::optional<Eigen::Vector3d>, kSections>;
  [[nodiscard]] Fronts fronts(const MeasuredLip& lip) const;

  /// The tallest place of each section between `skin` that lies no more than `deep` behind the lips' fronts, from the
  /// one's to the other's height.
  [[nodiscard]] std::array<double, kSections> slits(const Fronts& upper, const Fronts& lower, double deep,
                                                    const std::vector<Triangle>& skin) const;

 private:
  /// take(section, one end, other end) is told where a section cuts a triangle: across in sections, height, depth.
  template <typename Take>
  void cut(const Triangle& triangle, const Take& take) const;

  const VertexPositions& vertices_;
  const Eigen::Vector3d from_, along_;
};

}  // namespace mouthpiece
