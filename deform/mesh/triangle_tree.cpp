#include "retarget/placing/skin_tree.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

namespace mouthpiece {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangle3 = Kernel::Triangle_3;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Triangle3>::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

}  // namespace

struct SkinTree::Data {
  std::vector<Triangle3> triangles;  ///< without those that have no area
  std::vector<std::size_t> numbers;  ///< of `triangles` among those given
  Tree tree;
};

SkinTree::SkinTree(const VertexPositions& vertices, const std::vector<Triangle>& triangles)
    : data_(std::make_unique<Data>()) {
  const auto corner = [&](std::uint32_t v) {
    const Eigen::RowVector3d p = vertices.row(v).cast<double>();
    return Kernel::Point_3(p.x(), p.y(), p.z());
  };
  data_->triangles.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle3 triangle(corner(triangles[i][0]), corner(triangles[i][1]), corner(triangles[i][2]));
    if (triangle.is_degenerate()) continue;
    data_->triangles.push_back(triangle);
    data_->numbers.push_back(i);
  }
  data_->tree.rebuild(data_->triangles.cbegin(), data_->triangles.cend());
  if (!data_->triangles.empty()) data_->tree.accelerate_distance_queries();
}

SkinTree::SkinTree(SkinTree&&) noexcept = default;
SkinTree::~SkinTree() = default;

bool SkinTree::empty() const { return data_->triangles.empty(); }

std::optional<Eigen::Vector3d> SkinTree::closest(const Eigen::Vector3d& point) const {
  const auto foot = closestFoot(point);
  return foot ? std::optional(foot->point) : std::nullopt;
}

std::optional<SkinTree::Foot> SkinTree::closestFoot(const Eigen::Vector3d& point) const {
  if (empty()) return std::nullopt;
  const auto [found, triangle] =
      data_->tree.closest_point_and_primitive(Kernel::Point_3(point.x(), point.y(), point.z()));
  return Foot{{found.x(), found.y(), found.z()},
              data_->numbers[static_cast<std::size_t>(triangle - data_->triangles.cbegin())]};
}

}  // namespace mouthpiece
