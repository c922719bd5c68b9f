#include "deform/surface/lip_sides.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "deform/mesh/vertex_kinds.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// Nearer to the mouth's rim than this share of its width, doubled vertices may be two lips that touch.
constexpr double kLipsMayTouch = 0.06;

struct Side {
  std::uint32_t bit;
  const char* prefix;
  const char* suffix;
};
constexpr Side kSides[] = {{kUpperLip, "LIP_UP_", ""},       {kLowerLip, "LIP_LO_", ""},
                           {kUpperLip, "RIM_UP_", ""},       {kLowerLip, "RIM_LO_", ""},
                           {kUpperLidRight, "LID_UP", "_R"}, {kLowerLidRight, "LID_LO", "_R"},
                           {kUpperLidLeft, "LID_UP", "_L"},  {kLowerLidLeft, "LID_LO", "_L"}};

std::uint32_t sideOfPoint(const std::string& name) {
  for (const Side& side : kSides) {
    if (name.starts_with(side.prefix) && name.ends_with(side.suffix)) return side.bit;
  }
  return 0;
}

double distanceToSegment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double way = std::clamp((p - a).dot(ab) / std::max(ab.squaredNorm(), 1e-300), 0.0, 1.0);
  return (p - a - way * ab).norm();
}

/// The vertex of skin or lips nearest to a point; none without such parts.
std::optional<std::uint32_t> nearestSkin(const FaceMesh& mesh, const std::vector<PartKind>& kinds,
                                         const Eigen::RowVector3f& place) {
  float nearest = std::numeric_limits<float>::infinity();
  std::optional<std::uint32_t> found;
  for (std::uint32_t v = 0; v < kinds.size(); ++v) {
    if (kinds[v] != PartKind::kSkin && kinds[v] != PartKind::kLips) continue;
    const float squared = (mesh.vertices.row(v) - place).squaredNorm();
    if (squared < nearest) {
      nearest = squared;
      found = v;
    }
  }
  return found;
}

/// The vertices nearest to the points on one side. Rims may coincide with the other lip's and are no use here.
std::vector<std::uint32_t> seedsOf(const FaceMesh& mesh, const ControlMesh& control, const std::vector<PartKind>& kinds,
                                   std::uint32_t bit) {
  std::vector<std::uint32_t> seeds;
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    const std::string& name = control.points[i].name;
    if (sideOfPoint(name) != bit || name.starts_with("RIM_")) continue;
    const auto seed = nearestSkin(mesh, kinds, control.rest.row(static_cast<Eigen::Index>(i)).cast<float>());
    if (seed) seeds.push_back(*seed);
  }
  return seeds;
}

}  // namespace

std::vector<PartKind> vertexKinds(const FaceMesh& mesh) {
  const auto rank = [](PartKind kind) {
    switch (kind) {
      case PartKind::kLips:
        return 3;
      case PartKind::kSkin:
        return 2;
      case PartKind::kMouthInside:
        return 1;
      default:
        return 0;
    }
  };
  std::vector<PartKind> kinds(static_cast<std::size_t>(mesh.vertices.rows()), PartKind::kOther);
  std::vector<bool> seen(kinds.size(), false);
  for (const MeshPart& part : mesh.parts) {
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) {
        if (!seen[v] || rank(part.kind) > rank(kinds[v])) kinds[v] = part.kind;
        seen[v] = true;
      }
    }
  }
  return kinds;
}

std::vector<std::uint32_t> triangleSides(const ControlMesh& control) {
  std::vector<std::uint32_t> sides;
  for (const auto& triangle : control.triangles) {
    std::uint32_t bits = 0;
    for (const int point : triangle) bits |= sideOfPoint(control.points[static_cast<std::size_t>(point)].name);
    sides.push_back(bits);
  }
  return sides;
}

MeshGraph graphOf(const FaceMesh& mesh, const ControlMesh& control) {
  std::vector<Eigen::Vector3d> rim;
  for (const std::string& name : mouthRim()) {
    if (const int point = findPoint(control, name); point >= 0) rim.push_back(control.rest.row(point).transpose());
  }
  const double near = kLipsMayTouch * control.mouth_width;
  std::vector<bool> stands_off(static_cast<std::size_t>(mesh.vertices.rows()), false);
  for (const MeshPart& part : mesh.parts) {
    if (!part.stands_off) continue;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) stands_off[v] = true;
    }
  }
  return MeshGraph(mesh, [&](std::uint32_t v) {
    if (stands_off[v]) return false;
    const Eigen::Vector3d p = mesh.vertices.row(v).transpose().cast<double>();
    for (std::size_t i = 0; i < rim.size(); ++i) {
      if (distanceToSegment(p, rim[i], rim[(i + 1) % rim.size()]) < near) return false;
    }
    return true;
  });
}

double wayBetweenLips(const FaceMesh& mesh, const ControlMesh& control, const std::vector<PartKind>& kinds,
                      const MeshGraph& graph) {
  const auto vertexAt = [&](const char* name) -> std::optional<std::uint32_t> {
    const int point = findPoint(control, name);
    if (point < 0) return std::nullopt;
    return nearestSkin(mesh, kinds, control.rest.row(point).cast<float>());
  };
  const auto upper = vertexAt("LIP_UP_MID"), lower = vertexAt("LIP_LO_MID");
  double around = std::numeric_limits<double>::infinity();
  for (const char* name : {"LIP_CORNER_R", "LIP_CORNER_L"}) {
    const int corner = findPoint(control, name);
    if (corner < 0 || !upper || !lower) continue;
    const Eigen::RowVector3f place = control.rest.row(corner).cast<float>();
    around = std::min<double>(around,
                              (mesh.vertices.row(*upper) - place).norm() + (mesh.vertices.row(*lower) - place).norm());
  }
  if (!std::isfinite(around) || around == 0) return std::numeric_limits<double>::infinity();
  const MeshGraph::Reach reach = graph.reachFrom(
      {*upper}, [&](std::uint32_t v) { return kinds[v] == PartKind::kSkin || kinds[v] == PartKind::kLips; });
  return reach.distance[*lower] / around;
}

VertexSides vertexSides(const FaceMesh& mesh, const ControlMesh& control, const std::vector<PartKind>& kinds,
                        const MeshGraph& graph) {
  VertexSides sides{std::vector<std::uint32_t>(kinds.size(), 0), std::vector<double>(kinds.size(), 0.5)};
  const auto anywhere = [](std::uint32_t) { return true; };
  for (std::uint32_t upper : {kUpperLip, kUpperLidRight, kUpperLidLeft}) {
    const std::uint32_t lower = 2 * upper;
    const MeshGraph::Reach up = graph.reachFrom(seedsOf(mesh, control, kinds, upper), anywhere);
    const MeshGraph::Reach down = graph.reachFrom(seedsOf(mesh, control, kinds, lower), anywhere);
    for (std::size_t v = 0; v < kinds.size(); ++v) {
      if (!std::isfinite(up.distance[v]) || !std::isfinite(down.distance[v])) continue;
      sides.forbidden[v] |= up.distance[v] <= down.distance[v] ? lower : upper;
      const double both = up.distance[v] + down.distance[v];
      if (upper == kUpperLip && both > 0) sides.lower_share[v] = up.distance[v] / both;
    }
  }
  return sides;
}

}  // namespace mouthpiece
