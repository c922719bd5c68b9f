#include "deform/topology/skin_layers.h"

#include <algorithm>
#include <functional>

namespace mouthpiece {
namespace {

/// The tree looks along y: the head lies on its back for it.
VertexPositions lying(const VertexPositions& vertices) {
  VertexPositions turned(vertices.rows(), 3);
  turned << vertices.col(0), vertices.col(2), vertices.col(1);
  return turned;
}

}  // namespace

SkinLayers::SkinLayers(const VertexPositions& vertices, std::span<const Triangle> skin)
    : tree_(lying(vertices), skin, TriangleTree::Use::kWithoutStarts) {}

std::vector<double> SkinLayers::at(double x, double y) const {
  std::vector<double> layers;
  for (const auto& crossing : tree_.crossings(x, y)) layers.push_back(crossing.height);
  std::sort(layers.begin(), layers.end(), std::greater<>());
  return layers;
}

bool SkinLayers::isBehind(const Eigen::Vector3d& place, double deep) const {
  const std::vector<double> layers = at(place.x(), place.y());
  return !layers.empty() && place.z() + deep <= layers.front();
}

}  // namespace mouthpiece
