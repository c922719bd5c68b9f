#pragma once

#include <span>
#include <vector>

#include "deform/mesh/triangle_tree.h"

namespace mouthpiece {

/// The skin of a head that looks along z, in the layers in which it lies one behind the other.
class SkinLayers {
 public:
  SkinLayers(const VertexPositions& vertices, std::span<const Triangle> skin);

  /// How far in front each layer lies at (x, y), the foremost first; empty beside the head.
  [[nodiscard]] std::vector<double> at(double x, double y) const;
  /// Whether `place` lies `deep` or more behind the foremost layer.
  [[nodiscard]] bool isBehind(const Eigen::Vector3d& place, double deep) const;

 private:
  TriangleTree tree_;
};

}  // namespace mouthpiece
