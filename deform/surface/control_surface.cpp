#include "deform/surface/control_surface.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <optional>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/control_steps.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

/// Turns of a triangle below this share of its size squared count as collapsed.
constexpr double kLeastTurn = 1e-9;

double turn(const ControlMesh& mesh, const std::array<int, 3>& triangle) {
  const Eigen::Vector2d a = mesh.domain.row(triangle[0]);
  const Eigen::Vector2d ab = mesh.domain.row(triangle[1]).transpose() - a;
  const Eigen::Vector2d ac = mesh.domain.row(triangle[2]).transpose() - a;
  return ab.x() * ac.y() - ab.y() * ac.x();
}

/// Lengths at the lips are shares of the mouth's width: it must be that of the points.
std::string mouthFault(const ControlMesh& mesh) {
  constexpr double kRounding = 1e-6;
  const int right = findPoint(mesh, "LIP_CORNER_R"), left = findPoint(mesh, "LIP_CORNER_L");
  if (right < 0 || left < 0) return "found no corners of the mouth; expected LIP_CORNER_R and LIP_CORNER_L";
  const double width = (mesh.rest.row(left) - mesh.rest.row(right)).norm();
  if (std::abs(mesh.mouth_width - width) <= kRounding * width) return {};
  return fmt::format("found a mouth width of {:.6g}; expected {:.6g}, the distance between its corners",
                     mesh.mouth_width, width);
}

std::string namesOf(const ControlMesh& mesh, const std::array<int, 3>& triangle) {
  const auto name = [&](std::size_t corner) { return mesh.points[unsignedIndex(triangle[corner])].name; };
  return name(0) + ", " + name(1) + ", " + name(2);
}

/// The first broken promise of a control mesh in words, or nothing.
std::string faultOf(const ControlMesh& mesh) {
  const auto count = signedIndex(mesh.points.size());
  if (mesh.rest.rows() != count || mesh.domain.rows() != count)
    return "found tables of different lengths; expected one row a control point";
  if (mesh.marker_count == 0 || mesh.marker_count > mesh.points.size())
    return "found a marker count outside the points";
  if (mesh.rest_slopes.rows() != 0 && mesh.rest_slopes.rows() != 2 * count)
    return "found " + std::to_string(mesh.rest_slopes.rows()) + " rest slopes; expected none or two a point";
  if (!mesh.rest_slopes.allFinite() || !mesh.rest.allFinite() || !mesh.domain.allFinite())
    return "found a coordinate that is not finite";
  if (!(mesh.mouth_width > 0) || !std::isfinite(mesh.mouth_width))
    return "found no mouth width; expected one above zero";
  if (const std::string fault = mouthFault(mesh); !fault.empty()) return fault;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const ControlPoint& point = mesh.points[i];
    if ((point.rule == PointRule::kMarker) != (i < mesh.marker_count))
      return "found point " + point.name + " out of order; expected markers first";
    if (point.rule == PointRule::kInnerLip && point.drivers.size() != 3)
      return "found point " + point.name + " without its three lip markers";
    for (const PointDriver& driver : point.drivers) {
      if (driver.point < 0 || unsignedIndex(driver.point) >= i)
        return "found point " + point.name + " driven by a later point";
      if (!std::isfinite(driver.weight)) return "found point " + point.name + " with a weight that is not finite";
      if (point.rule == PointRule::kInnerLip && unsignedIndex(driver.point) >= mesh.marker_count) {
        return "found point " + point.name + " driven by a virtual point; expected lip markers";
      }
    }
    if (point.opposite < -1 || point.opposite >= count) return "found point " + point.name + " facing no point";
    if (point.opposite >= 0 && mesh.points[unsignedIndex(point.opposite)].rule != PointRule::kInnerLip) {
      return "found point " + point.name + " facing a point that is not on a lip's rim";
    }
  }
  if (mesh.triangles.empty()) return "found no triangles";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    bool upper = false, lower = false;
    for (const int corner : triangle) {
      if (corner < 0 || corner >= count)
        return "found a triangle with point " + std::to_string(corner) + " of " + std::to_string(count);
      upper |= mesh.points[unsignedIndex(corner)].side == LipSide::kUpper;
      lower |= mesh.points[unsignedIndex(corner)].side == LipSide::kLower;
    }
    if (upper && lower) return "found a triangle that joins the lips: " + namesOf(mesh, triangle);
    if (!(turn(mesh, triangle) > kLeastTurn * mesh.mouth_width * mesh.mouth_width))
      return "found a triangle that is turned over or flat";
  }
  std::set<std::pair<int, int>> edges;
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!edges.emplace(triangle[k], triangle[(k + 1) % 3]).second)
        return "found an edge with two triangles on one side";
    }
  }
  return {};
}

void expectFace(const ControlMesh& built) {
  const std::string fault = faultOf(built);
  if (!fault.empty()) throw InputError("control surface: " + fault + "; expected markers that lie as on a face");
}

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

}  // namespace

std::vector<std::uint32_t> triangleSides(const ControlMesh& control) {
  std::vector<std::uint32_t> sides;
  for (const auto& triangle : control.triangles) {
    std::uint32_t bits = 0;
    for (const int point : triangle) bits |= sideOfPoint(control.points[unsignedIndex(point)].name);
    sides.push_back(bits);
  }
  return sides;
}

FaceOpenings openingsOf(const ControlMesh& control) {
  FaceOpenings openings;
  openings.lips_reach = kLipsMayTouch * control.mouth_width;
  for (const std::string& name : mouthRim()) {
    if (const int point = findPoint(control, name); point >= 0)
      openings.lip_line.push_back(control.rest.row(point).transpose());
  }
  const auto place = [&](const char* name) -> std::optional<Eigen::Vector3d> {
    const int point = findPoint(control, name);
    if (point < 0) return std::nullopt;
    return control.rest.row(point).transpose();
  };
  const auto right = place("LIP_CORNER_R"), left = place("LIP_CORNER_L"), upper = place("LIP_UP_MID"),
             lower = place("LIP_LO_MID");
  if (right && left && upper && lower) {
    openings.mouth = MouthHints{*right, *left, *upper, *lower};
    for (const LipPair& pair : lipPairs(control))
      openings.mouth->on_line.push_back(
          0.5 * (control.rest.row(pair.upper_rim) + control.rest.row(pair.lower_rim)).transpose());
  }
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    const std::string& name = control.points[i].name;
    const std::uint32_t bit = sideOfPoint(name);
    // Rims may coincide with the other lip's and are no use here.
    if (bit == 0 || name.starts_with("RIM_")) continue;
    const int number = std::countr_zero(bit);
    FaceOpenings::Sides& sides = openings.sides[unsignedIndex(number / 2)];
    (number % 2 == 0 ? sides.upper : sides.lower).push_back(control.rest.row(signedIndex(i)).transpose());
  }
  return openings;
}

LipSide ControlMesh::sideOf(std::size_t triangle) const {
  for (const int corner : triangles[triangle]) {
    const LipSide side = points[unsignedIndex(corner)].side;
    if (side != LipSide::kNone) return side;
  }
  return LipSide::kNone;
}

SurfacePlan surfacePlanOf(const MarkerLayout& layout) {
  SurfacePlan plan{.lips = {}, .triangles = layout.triangles};
  for (const LayoutMarker& marker : layout.markers) plan.lips.push_back(marker.lip);
  return plan;
}

ControlMesh buildControlMesh(const std::vector<std::string>& marker_names, const MarkerPositions& marker_rest,
                             const std::map<std::string, Eigen::Vector3d>& known, const FaceMesh* mesh,
                             const SurfacePlan& plan) {
  ControlMesh control = placePoints(marker_names, marker_rest, known, plan);
  untangle(control);
  control.triangles = triangulate(control);
  expectFace(control);
  return mesh == nullptr ? control : fittedToMesh(control, *mesh, HeadTopology(*mesh, openingsOf(control)));
}

ControlMesh fittedToMesh(const ControlMesh& control, const FaceMesh& mesh, const HeadTopology& topology) {
  ControlMesh fitted = laidAlongSkin(control, mesh, topology);
  expectFace(fitted);
  return fitted;
}

void checkControlMesh(const ControlMesh& mesh, const std::string& file) {
  const std::string fault = faultOf(mesh);
  if (!fault.empty()) throw InputError(file, "control surface", fault);
}

}  // namespace mouthpiece
