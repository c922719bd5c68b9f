#include "deform/mesh/triangle_tree.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/index.h"

namespace mouthpiece {
namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Triangle3 = Kernel::Triangle_3;
using Triangles = std::vector<Triangle3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Traits = CGAL::AABB_traits<Kernel, Primitive>;
using Tree = CGAL::AABB_tree<Traits>;

/// Takes every triangle whose box touches another.
struct Collector {
  std::vector<Triangles::const_iterator> found;

  static bool go_further() { return true; }
  void intersection(const CGAL::Bbox_3& box, const Primitive& primitive) {
    if (CGAL::do_overlap(box, primitive.id()->bbox())) found.push_back(primitive.id());
  }
  static bool do_intersect(const CGAL::Bbox_3& box, const CGAL::AABB_node<Traits>& node) {
    return CGAL::do_overlap(box, node.bbox());
  }
};

Eigen::Vector3d cornerOf(const Triangle3& triangle, int k) {
  return {triangle[k].x(), triangle[k].y(), triangle[k].z()};
}

/// Weights of the corners in a point of the triangle: shares of the area (C. Ericson, Real-Time Collision Detection,
/// 3.4).
Eigen::Vector3d weightsAt(const Triangle3& triangle, const Eigen::Vector3d& p) {
  const Eigen::Vector3d a = cornerOf(triangle, 0), ab = cornerOf(triangle, 1) - a, ac = cornerOf(triangle, 2) - a;
  const Eigen::Vector3d normal = ab.cross(ac);
  const double of_b = (p - a).cross(ac).dot(normal) / normal.squaredNorm();
  const double of_c = ab.cross(p - a).dot(normal) / normal.squaredNorm();
  return {1 - of_b - of_c, of_b, of_c};
}

/// Twice the area of the triangle a b c, below zero where it turns right.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// How high a triangle lies straight over or under the place (x, z).
std::optional<double> heightAt(const Triangle3& triangle, const Eigen::Vector2d& place) {
  const auto corner = [&](int k) -> Eigen::Vector2d { return {triangle[k].x(), triangle[k].z()}; };
  const double whole = turn(corner(0), corner(1), corner(2));
  if (whole == 0) return std::nullopt;
  double height = 0;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d from = corner((k + 1) % 3), to = corner((k + 2) % 3);
    const double weight = turn(place, from, to) / whole;
    if (weight < 0) return std::nullopt;
    if (weight == 0) {
      // On the edge: it belongs to the triangle that goes along it upwards, or else to the right.
      const Eigen::Vector2d along = whole > 0 ? Eigen::Vector2d(to - from) : Eigen::Vector2d(from - to);
      if (along.y() < 0 || (along.y() == 0 && along.x() < 0)) return std::nullopt;
    }
    height += weight * triangle[k].y();
  }
  return height;
}

}  // namespace

struct TriangleTree::Data {
  Triangles triangles;
  std::vector<std::size_t> numbers;  ///< of `triangles` among those given, rising
  Tree tree;

  Data(const VertexPositions& vertices, std::span<const Triangle> given, Use use) {
    const auto corner = [&](std::uint32_t v) {
      const Eigen::Vector3d p = pointAt(vertices, v);
      return Kernel::Point_3(p.x(), p.y(), p.z());
    };
    for (std::size_t i = 0; i < given.size(); ++i) {
      const Triangle3 triangle(corner(given[i][0]), corner(given[i][1]), corner(given[i][2]));
      if (triangle.is_degenerate()) continue;
      triangles.push_back(triangle);
      numbers.push_back(i);
    }
    tree.rebuild(triangles.cbegin(), triangles.cend());
    if (!triangles.empty()) {
      tree.build();  // else the first look would build it, and two threads may look at once
      if (use == Use::kAll) tree.accelerate_distance_queries();
    }
  }
  [[nodiscard]] std::size_t numberOf(Triangles::const_iterator triangle) const {
    return numbers[unsignedIndex(triangle - triangles.cbegin())];
  }
  [[nodiscard]] std::vector<Triangles::const_iterator> touching(const CGAL::Bbox_3& box) const {
    Collector collector;
    if (!triangles.empty()) tree.traversal(box, collector);
    std::sort(collector.found.begin(), collector.found.end());
    return std::move(collector.found);
  }
};

TriangleTree::TriangleTree(const VertexPositions& vertices, std::span<const Triangle> triangles, Use use)
    : data_(std::make_unique<const Data>(vertices, triangles, use)) {}
TriangleTree::TriangleTree(TriangleTree&&) noexcept = default;
TriangleTree::~TriangleTree() = default;

bool TriangleTree::empty() const { return data_->triangles.empty(); }

std::optional<TriangleTree::Foot> TriangleTree::closest(const Eigen::Vector3d& point, const Foot* begin_at,
                                                        double within) const {
  if (empty()) return std::nullopt;
  const Kernel::Point_3 from(point.x(), point.y(), point.z());
  const auto [found, triangle] = [&] {
    if (begin_at != nullptr && (begin_at->point - point).norm() < within) {
      const auto number = std::lower_bound(data_->numbers.begin(), data_->numbers.end(), begin_at->triangle);
      const Eigen::Vector3d& at = begin_at->point;
      return data_->tree.closest_point_and_primitive(
          from,
          {Kernel::Point_3(at.x(), at.y(), at.z()), data_->triangles.cbegin() + (number - data_->numbers.begin())});
    }
    if (std::isinf(within)) return data_->tree.closest_point_and_primitive(from);
    // A place on no triangle, as far off as is looked.
    return data_->tree.closest_point_and_primitive(
        from, {Kernel::Point_3(point.x() + within, point.y(), point.z()), data_->triangles.cend()});
  }();
  if (triangle == data_->triangles.cend()) return std::nullopt;
  const Eigen::Vector3d foot(found.x(), found.y(), found.z());
  return Foot{foot, data_->numberOf(triangle), weightsAt(*triangle, foot)};
}

std::vector<std::size_t> TriangleTree::touching(const Eigen::AlignedBox3d& box) const {
  const Eigen::Vector3d &low = box.min(), &high = box.max();
  std::vector<std::size_t> found;
  for (const auto triangle : data_->touching({low.x(), low.y(), low.z(), high.x(), high.y(), high.z()}))
    found.push_back(data_->numberOf(triangle));
  return found;
}

bool TriangleTree::isBetween(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  const Kernel::Segment_3 way({from.x(), from.y(), from.z()}, {to.x(), to.y(), to.z()});
  return !empty() && !way.is_degenerate() && data_->tree.do_intersect(way);
}

std::vector<TriangleTree::Crossing> TriangleTree::crossings(double x, double z) const {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<Crossing> found;
  for (const auto triangle : data_->touching({x, -kInfinite, z, x, kInfinite, z})) {
    if (const auto height = heightAt(*triangle, {x, z})) found.push_back({data_->numberOf(triangle), *height});
  }
  return found;
}

}  // namespace mouthpiece
