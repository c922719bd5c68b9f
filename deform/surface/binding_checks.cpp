// What is wrong with a binding that was read, and how good one is.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/binding.h"
#include "deform/surface/left_out.h"
#include "deform/surface/surface_projection.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// A share of the way between the lips this near to the middle is on neither side.
constexpr double kClearSide = 0.03;

/// BindingReport::way_between_lips.
double wayBetweenLips(const FaceMesh& mesh, const HeadTopology& topology, const ControlMesh& control) {
  // On coarse lips the vertex nearest to one lip's marker may be the other's.
  const auto vertexAt = [&](const char* name, SideBit lip) -> std::optional<std::uint32_t> {
    const int point = findPoint(control, name);
    if (point < 0) return std::nullopt;
    const Eigen::RowVector3f place = control.rest.row(point).cast<float>();
    std::optional<std::uint32_t> nearest;
    float least = std::numeric_limits<float>::infinity();
    for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
      if (!isSkin(topology.kinds()[v]) || (topology.forbidden()[v] & lip) != 0) continue;
      const float off = (mesh.vertices.row(v) - place).squaredNorm();
      if (off >= least) continue;
      least = off;
      nearest = v;
    }
    return nearest;
  };
  const auto upper = vertexAt("LIP_UP_MID", kUpperLip), lower = vertexAt("LIP_LO_MID", kLowerLip);
  std::vector<Eigen::Vector3d> corners;
  for (const char* name : {"LIP_CORNER_R", "LIP_CORNER_L"}) {
    if (const int corner = findPoint(control, name); corner >= 0) corners.push_back(control.rest.row(corner));
  }
  // A coarse mesh's own lie further in.
  if (const auto& line = topology.lipLine(); line && line->is_parted)
    corners.insert(corners.end(), {line->corner_right, line->corner_left});
  double around = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& corner : corners) {
    if (!upper || !lower) break;
    around = std::min(
        around, (pointAt(mesh.vertices, *upper) - corner).norm() + (pointAt(mesh.vertices, *lower) - corner).norm());
  }
  if (!std::isfinite(around) || around == 0) return std::numeric_limits<double>::infinity();
  // The way through a shallow bag says nothing of lips that are two.
  const auto is_outside = [&](std::uint32_t v) {
    return isSkin(topology.kinds()[v]) && (v == *lower || !topology.isInMouth(v));
  };
  const auto reach = topology.reachFrom({*upper}, is_outside);
  return reach.distance[*lower] / around;
}

void checkRelaxed(const FaceBinding::Relaxed& relaxed, std::size_t count,
                  const std::function<void(const std::string& what)>& fail) {
  const auto& [vertices, ends, from, weights] = relaxed;
  if (ends.size() != vertices.size() || from.size() != weights.size() ||
      (ends.empty() ? 0 : ends.back()) != from.size())
    return fail("found relaxed columns of different lengths; expected a row a vertex and a weight an entry");
  std::size_t entry = 0;
  for (std::size_t row = 0; row < vertices.size(); ++row) {
    if (vertices[row] >= count || (row > 0 && vertices[row] <= vertices[row - 1]))
      return fail(fmt::format("found relaxed vertex {}; expected rising numbers under {}", vertices[row], count));
    if (ends[row] < entry || ends[row] > from.size())
      return fail(
          fmt::format("found a relaxed row that ends at {}; expected rising ends up to {}", ends[row], from.size()));
    float sum = 0;
    for (; entry < ends[row]; ++entry) {
      if (from[entry] >= count || std::binary_search(vertices.begin(), vertices.end(), from[entry]))
        return fail(fmt::format("found vertex {} of a relaxed one; expected one under {} that is not relaxed",
                                from[entry], count));
      if (!(weights[entry] >= 0)) return fail("found a relaxed weight that is no share");
      sum += weights[entry];
    }
    if (!(sum <= 1.001F)) return fail(fmt::format("found weights of {} in a relaxed row; expected 1 at most", sum));
  }
}

std::vector<std::size_t> partsOfVertices(const FaceMesh& mesh) {
  std::vector<std::size_t> part_of(mesh.vertexCount(), 0);
  for (std::size_t p = 0; p < mesh.parts.size(); ++p) {
    for (const Triangle& t : trianglesOf(mesh, mesh.parts[p])) {
      for (const std::uint32_t v : t) part_of[v] = p;
    }
  }
  return part_of;
}

double medianOf(std::vector<double> values) {
  const auto middle = values.begin() + signedIndex(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Vertices of the skin in front, which shall be bound, and those of them that are not.
struct SkinInFront {
  std::vector<std::uint32_t> all, left;
};

SkinInFront skinInFront(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control,
                        const HeadTopology& topology) {
  const std::vector<PartKind>& kinds = topology.kinds();
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  const auto markers = control.markerRest();
  const double back = markers.col(2).minCoeff(), front = markers.col(2).maxCoeff();
  const std::vector<bool> is_outlined = withinOutline(markers, mesh.vertices.leftCols<2>().cast<double>());
  const TriangleTree skin(mesh.vertices, trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips}),
                          TriangleTree::Use::kWithoutStarts);
  SkinInFront found;
  for (std::uint32_t v = 0; v < kinds.size(); ++v) {
    if (!isSkin(kinds[v]) || topology.isInMouth(v)) continue;
    const Eigen::RowVector3d p = mesh.vertices.row(v).cast<double>();
    if (p.z() < back || p.z() > front || normals(v, 2) < 0.2F || !is_outlined[v]) continue;
    // What other skin hides, as a lid does its eye's socket, is not in front.
    const Eigen::Vector3d before = p.transpose() + kSkinLayer * control.mouth_width * Eigen::Vector3d::UnitZ();
    const bool is_bound = binding.patch[v] >= 0 && binding.skin_weight[v] > 0;
    if (!is_bound && skin.isBetween(before, before + control.mouth_width * Eigen::Vector3d::UnitZ())) continue;
    found.all.push_back(v);
    if (!is_bound) found.left.push_back(v);
  }
  return found;
}

}  // namespace

SkinLeftOut skinLeftOut(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control) {
  const auto [in_front, left] = skinInFront(binding, mesh, control, HeadTopology(mesh, openingsOf(control)));
  if (left.empty()) return {};
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  const std::vector<std::size_t> part_of = partsOfVertices(mesh);
  const auto fullest = [&](const std::vector<std::uint32_t>& vertices) {
    std::vector<std::size_t> counts(mesh.parts.size(), 0);
    for (const std::uint32_t v : vertices) ++counts[part_of[v]];
    return unsignedIndex(std::max_element(counts.begin(), counts.end()) - counts.begin());
  };
  const std::size_t part = fullest(left);
  const BezierSurface surface(control);
  const SurfaceProjector projector(surface, control, triangleSides(control));
  std::vector<double> distances, angles;
  for (const std::uint32_t v : left) {
    if (part_of[v] != part) continue;
    const auto foot = projector.closest(pointAt(mesh.vertices, v), Eigen::Vector3d::Zero(), -1, 0);
    if (!foot) continue;
    const double cosine = pointAt(normals, v).dot(evaluate(surface.restPose(), foot->place).normal());
    distances.push_back(foot->distance / control.mouth_width);
    angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi);
  }
  if (distances.empty()) return {};
  return {mesh.parts[part].name, part == fullest(in_front), distances.size(),
          left.size(),           medianOf(distances),       medianOf(angles)};
}

void checkBinding(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control,
                  const std::string& file) {
  const auto count = unsignedIndex(mesh.vertices.rows());
  const auto fail = [&](const std::string& what) { throw InputError(file, "binding", what); };
  if (binding.patch.size() != count)
    fail("found " + std::to_string(binding.patch.size()) + " vertices; expected " + std::to_string(count));
  for (const auto* column : {&binding.u, &binding.v, &binding.d, &binding.skin_weight, &binding.jaw_weight}) {
    if (column->size() != count)
      fail("found columns of different lengths; expected " + std::to_string(count) + " entries each");
  }
  for (std::size_t i = 0; i < binding.carried.size(); ++i) {
    const std::uint32_t v = binding.carried[i];
    if (v >= count || (i > 0 && v <= binding.carried[i - 1]))
      fail("found carried vertex " + std::to_string(v) + "; expected rising numbers under " + std::to_string(count));
  }
  checkRelaxed(binding.relaxed, count, fail);
  if (!(binding.tuck >= 0 && binding.tuck <= 1))
    fail(fmt::format("found lips that are tucked by {} of their way; expected 0 to 1", binding.tuck));
  if (!binding.pressed.empty() && binding.pressed.size() != kLipColumns)
    fail(fmt::format("found {} columns of lips; expected {}", binding.pressed.size(), kLipColumns));
  for (const float pressed : binding.pressed) {
    if (!(double{std::abs(pressed)} <= control.mouth_width)) fail("found lips that are pressed by no usable length");
  }
  const FaceBinding::Levelled& levelled = binding.levelled;
  if (levelled.ways.size() != levelled.vertices.size()) fail("found levelled lips of different lengths");
  for (std::size_t i = 0; i < levelled.vertices.size(); ++i) {
    if (levelled.vertices[i] >= count || (i > 0 && levelled.vertices[i] <= levelled.vertices[i - 1]))
      fail(fmt::format("found levelled vertex {}; expected rising numbers under {}", levelled.vertices[i], count));
    if (!(double{std::abs(levelled.ways[i])} <= control.mouth_width))
      fail("found lips that are levelled by no usable length");
  }
  const Eigen::RowVector3f size = mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff();
  if (control.mouth_width > double{size.norm()}) fail("found a mouth wider than the mesh");
  constexpr float kSlack = 1e-4F;
  for (std::size_t v = 0; v < count; ++v) {
    if (binding.patch[v] < -1 || binding.patch[v] >= static_cast<std::int64_t>(control.triangles.size())) {
      fail("found patch " + std::to_string(binding.patch[v]) + "; expected -1 to " +
           std::to_string(control.triangles.size() - 1));
    }
    const bool is_place =
        binding.u[v] >= -kSlack && binding.v[v] >= -kSlack && binding.u[v] + binding.v[v] <= 1 + kSlack;
    const bool is_share = binding.skin_weight[v] >= 0 && binding.skin_weight[v] <= 1 && binding.jaw_weight[v] >= 0 &&
                          binding.jaw_weight[v] <= 1;
    if (!is_place || !is_share || !std::isfinite(binding.d[v]))
      fail("found vertex " + std::to_string(v) + " out of range");
  }
}

BindingReport inspectBinding(const FaceBinding& binding, const FaceMesh& mesh, const ControlMesh& control) {
  checkBinding(binding, mesh, control, "face binding");
  const HeadTopology topology(mesh, openingsOf(control));
  const std::vector<PartKind>& kinds = topology.kinds();
  const std::vector<std::uint32_t> triangle_sides = triangleSides(control);
  BindingReport report;
  report.vertices = kinds.size();
  report.way_between_lips = wayBetweenLips(mesh, topology, control);
  report.lips_are_one = topology.lipLine() && !topology.lipLine()->is_parted;
  for (std::size_t v = 0; v < kinds.size(); ++v) {
    const bool is_bound = binding.patch[v] >= 0 && binding.skin_weight[v] > 0;
    report.bound_vertices += is_bound ? 1 : 0;
    if (is_bound) report.largest_offset = std::max(report.largest_offset, std::abs(double{binding.d[v]}));
    const bool is_clear = std::abs(topology.lowerShare(v) - 0.5) >= kClearSide;
    if (is_bound && is_clear &&
        (triangle_sides[unsignedIndex(binding.patch[v])] & topology.forbidden()[v] & (kUpperLip | kLowerLip)) != 0)
      ++report.lip_side_errors;
    if (!isSkin(kinds[v]) || topology.isInMouth(v)) continue;
    ++report.skin_vertices;
  }
  const SkinInFront in_front = skinInFront(binding, mesh, control, topology);
  if (!in_front.all.empty())
    report.coverage = asReal(in_front.all.size() - in_front.left.size()) / asReal(in_front.all.size());
  return report;
}

}  // namespace mouthpiece
