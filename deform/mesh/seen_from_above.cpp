#include "deform/mesh/seen_from_above.h"

namespace mouthpiece {
namespace {

/// Twice the area of the triangle a b c, below zero where it turns right.
float turn(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const Eigen::Vector2f& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

}  // namespace

std::optional<float> heightAt(const FaceMesh& mesh, const Triangle& triangle, const Eigen::Vector2f& place) {
  const auto corner = [&](std::size_t k) -> Eigen::Vector2f {
    return {mesh.vertices(triangle[k % 3], 0), mesh.vertices(triangle[k % 3], 2)};
  };
  const float whole = turn(corner(0), corner(1), corner(2));
  if (whole == 0) return std::nullopt;
  float height = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector2f from = corner(k + 1), to = corner(k + 2);
    const float weight = turn(place, from, to) / whole;
    if (weight < 0) return std::nullopt;
    if (weight == 0) {
      // On the edge: it belongs to the triangle that goes along it upwards, or else to the right.
      const Eigen::Vector2f along = whole > 0 ? Eigen::Vector2f(to - from) : Eigen::Vector2f(from - to);
      if (along.y() < 0 || (along.y() == 0 && along.x() < 0)) return std::nullopt;
    }
    height += weight * mesh.vertices(triangle[k], 1);
  }
  return height;
}

}  // namespace mouthpiece
