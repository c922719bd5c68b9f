#include "retarget/skin_tree.h"

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
  std::vector<Triangle3> triangles;
  Tree tree;
};

SkinTree::SkinTree(const FaceMesh& mesh, const std::vector<Triangle>& triangles) : data_(std::make_unique<Data>()) {
  const auto corner = [&](std::uint32_t v) {
    const Eigen::RowVector3d p = mesh.vertices.row(v).cast<double>();
    return Kernel::Point_3(p.x(), p.y(), p.z());
  };
  data_->triangles.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    const Triangle3 triangle(corner(a), corner(b), corner(c));
    if (!triangle.is_degenerate()) data_->triangles.push_back(triangle);
  }
  data_->tree.rebuild(data_->triangles.cbegin(), data_->triangles.cend());
  if (!data_->triangles.empty()) data_->tree.accelerate_distance_queries();
}

SkinTree::SkinTree(SkinTree&&) noexcept = default;
SkinTree::~SkinTree() = default;

bool SkinTree::empty() const { return data_->triangles.empty(); }

std::optional<Eigen::Vector3d> SkinTree::closest(const Eigen::Vector3d& point) const {
  if (empty()) return std::nullopt;
  const auto found = data_->tree.closest_point(Kernel::Point_3(point.x(), point.y(), point.z()));
  return Eigen::Vector3d(found.x(), found.y(), found.z());
}

}  // namespace mouthpiece
