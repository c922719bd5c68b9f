#include "exports/scenes/scene_shape.h"

#include <algorithm>

#include "base/index.h"

namespace mouthpiece {

SceneShape sceneShape(const PrincipalShapes& shapes, const ShapeNormals& normals, Eigen::Index k) {
  const ShapeNormals::Turns& turned = normals.shapes[unsignedIndex(k)];
  const std::vector<std::uint32_t> columns = shapes.columnVertices();
  SceneShape shape;
  std::size_t at = 0;  // in what is turned
  const auto add = [&](std::uint32_t vertex, const float* move) {
    const bool turns = at < turned.vertices.size() && turned.vertices[at] == vertex;
    shape.vertices.push_back(vertex);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      shape.moves.push_back(move == nullptr ? 0.0F : move[axis]);
      shape.turns.push_back(turns ? turned.values[3 * at + axis] : 0.0F);
    }
    at += turns ? 1 : 0;
  };
  for (std::size_t i = 0; i < columns.size(); ++i) {
    while (at < turned.vertices.size() && turned.vertices[at] < columns[i]) add(turned.vertices[at], nullptr);
    const float* move = shapes.shapes.row(k).data() + 3 * i;
    const bool turns = at < turned.vertices.size() && turned.vertices[at] == columns[i];
    if (turns || std::any_of(move, move + 3, [](float value) { return value != 0; })) add(columns[i], move);
  }
  while (at < turned.vertices.size()) add(turned.vertices[at], nullptr);
  return shape;
}

}  // namespace mouthpiece
