#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Convex_hull_traits_adapter_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/convex_hull_2.h>
#include <CGAL/property_map.h>
#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "base/errors.h"
#include "base/index.h"
#include "deform/surface/control_steps.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Vertices = CGAL::Triangulation_vertex_base_with_info_2<int, Kernel>;
using Faces = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Triangulation =
    CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<Vertices, Faces>,
                                               CGAL::No_constraint_intersection_tag>;

std::vector<int> pointsOf(const ControlMesh& mesh, const std::vector<std::string>& names) {
  std::vector<int> points;
  for (const std::string& name : names) {
    if (const int point = findPoint(mesh, name); point >= 0) points.push_back(point);
  }
  return points;
}

/// Whether `p` is inside the closed line through `rim` (even-odd rule).
bool isInside(const ControlMesh& mesh, const std::vector<int>& rim, const Eigen::Vector2d& p) {
  bool inside = false;
  for (std::size_t i = 0, j = rim.size() - 1; i < rim.size(); j = i++) {
    const Eigen::Vector2d a = mesh.domain.row(rim[i]);
    const Eigen::Vector2d b = mesh.domain.row(rim[j]);
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
      inside = !inside;
  }
  return inside;
}

/// Of `lines` the first that `line` crosses in the plane of the triangulation; `line` itself where rounding hides it.
std::pair<int, int> crossedBy(const ControlMesh& mesh, std::pair<int, int> line,
                              const std::set<std::pair<int, int>>& lines) {
  const auto place = [&](int point) { return Kernel::Point_2(mesh.domain(point, 0), mesh.domain(point, 1)); };
  const Kernel::Segment_2 segment(place(line.first), place(line.second));
  const auto crossed = std::find_if(lines.begin(), lines.end(), [&](const std::pair<int, int>& other) {
    const bool meet = other.first == line.first || other.first == line.second || other.second == line.first ||
                      other.second == line.second;
    return !meet && CGAL::do_intersect(segment, Kernel::Segment_2(place(other.first), place(other.second)));
  });
  return crossed != lines.end() ? *crossed : line;
}

std::string lineName(const ControlMesh& mesh, std::pair<int, int> line) {
  const auto name = [&](int point) { return mesh.points[unsignedIndex(point)].name; };
  return name(line.first) + " to " + name(line.second);
}

}  // namespace

std::vector<std::array<int, 3>> triangulate(const ControlMesh& mesh) {
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> handles;
  for (Eigen::Index i = 0; i < mesh.domain.rows(); ++i) {
    handles.push_back(triangulation.insert(Kernel::Point_2(mesh.domain(i, 0), mesh.domain(i, 1))));
    if (triangulation.number_of_vertices() != handles.size())
      throw InputError(fmt::format("control surface: found {} and {} in one place",
                                   mesh.points[unsignedIndex(handles.back()->info())].name,
                                   mesh.points[unsignedIndex(i)].name));
    handles.back()->info() = static_cast<int>(i);
  }

  std::vector<std::vector<int>> holes;
  for (const auto& names : {mouthRim(), eyeRim('R'), eyeRim('L')}) {
    if (std::vector<int> rim = pointsOf(mesh, names); rim.size() >= 3 && rim.size() == names.size())
      holes.push_back(rim);
  }
  std::vector<std::vector<int>> lines = holes;
  // Skin points laid along the lips later on stand on this line and break it.
  const bool is_filled = std::any_of(mesh.points.begin(), mesh.points.end(),
                                     [](const ControlPoint& p) { return p.name.find("FILL_") != std::string::npos; });
  if (!is_filled) lines.push_back(pointsOf(mesh, outerLipLine()));
  // Between the slit's end and the lips' own no triangle reaches from one lip to the other, wherever skin points lie.
  for (const char* end : {"_R", "_L"})
    lines.push_back(pointsOf(mesh, {std::string("LIP_CORNER") + end, std::string("RIM_CORNER") + end}));
  for (const std::array<int, 3>& triangle : mesh.wanted_triangles) lines.emplace_back(triangle.begin(), triangle.end());
  std::set<std::pair<int, int>> kept;  // a line given twice would count as one that crosses another
  for (const std::vector<int>& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const int from = line[i], to = line[(i + 1) % line.size()];
      if (!kept.emplace(std::min(from, to), std::max(from, to)).second) continue;
      try {
        triangulation.insert_constraint(handles[unsignedIndex(from)], handles[unsignedIndex(to)]);
      } catch (const Triangulation::Intersection_of_constraints_exception&) {
        throw InputError(
            fmt::format("control surface: found the line {} that crosses {}; expected markers that lie as on a face",
                        lineName(mesh, {from, to}), lineName(mesh, crossedBy(mesh, {from, to}, kept))));
      }
    }
  }

  std::vector<std::array<int, 3>> triangles;
  for (const auto face : triangulation.finite_face_handles()) {
    const std::array<int, 3> triangle{face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()};
    const Eigen::Vector2d middle =
        (mesh.domain.row(triangle[0]) + mesh.domain.row(triangle[1]) + mesh.domain.row(triangle[2])).transpose() / 3;
    bool open = false;
    for (const auto& hole : holes) open |= isInside(mesh, hole, middle);
    if (!open) triangles.push_back(triangle);
  }
  return triangles;
}

std::vector<int> convexHull(const Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor>& points) {
  std::vector<Kernel::Point_2> places;
  for (Eigen::Index i = 0; i < points.rows(); ++i) places.emplace_back(points(i, 0), points(i, 1));
  std::vector<std::size_t> order(places.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<std::size_t> hull;
  CGAL::convex_hull_2(order.begin(), order.end(), std::back_inserter(hull),
                      CGAL::Convex_hull_traits_adapter_2<Kernel, CGAL::Pointer_property_map<Kernel::Point_2>::type>(
                          CGAL::make_property_map(places)));
  return {hull.begin(), hull.end()};
}

}  // namespace mouthpiece
