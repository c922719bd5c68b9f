#include "deform/mesh_fill.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "deform/bezier_surface.h"
#include "deform/lip_sides.h"
#include "deform/surface_projection.h"
#include "deform/triangulation.h"
#include "deform/vertex_kinds.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kNearEnough = 0.05;  ///< 2.5 mm on a mouth of 50 mm
constexpr double kTooFar = 0.8;       ///< not the same skin any more
constexpr double kApart = 0.25;       ///< between new points of one round
constexpr double kFromOld = 0.12;     ///< between a new point and an old one
constexpr int kMaxRounds = 8;
constexpr std::size_t kMaxFill = 64;
constexpr std::size_t kMaxSamples = 4000;
constexpr double kLeastCosine = 0.5;   ///< of the angle between skin and surface where a point may be added
constexpr double kLeastWeight = 1e-6;  ///< drivers below it are left out

/// A linear form in a triangle's nine numbers: values, then slopes along x and y at each corner.
using Form = Eigen::Matrix<double, 9, 1>;

/// What each point's displacement adds to the displacement at `place`.
Eigen::VectorXd influences(const BezierSurface& surface, const ControlMesh& control, const SurfacePlace& place) {
  std::array<Form, 3> value, gx, gy;
  for (int i = 0; i < 3; ++i) {
    value[static_cast<std::size_t>(i)] = Form::Unit(i);
    gx[static_cast<std::size_t>(i)] = Form::Unit(3 + 2 * i);
    gy[static_cast<std::size_t>(i)] = Form::Unit(4 + 2 * i);
  }
  std::array<CubicPatch<Form>, 3> patches;
  const auto t = static_cast<std::size_t>(place.triangle);
  surface.splits()[t].nets(value, gx, gy, patches);
  const PatchPlace at = patchPlace(place);
  const auto halves = patches[at.patch % 3].halves(at.u, at.v);
  const Form form = at.u * halves.a + at.v * halves.b + (1 - at.u - at.v) * halves.c;
  Eigen::VectorXd all = Eigen::VectorXd::Zero(control.rest.rows());
  for (int i = 0; i < 3; ++i) {
    const int point = control.triangles[t][static_cast<std::size_t>(i)];
    all[point] += form[i];
    all += form[3 + 2 * i] * surface.slopesFromDisplacements().row(2 * point).transpose();
    all += form[4 + 2 * i] * surface.slopesFromDisplacements().row(2 * point + 1).transpose();
  }
  return all;
}

/// The triangle that holds a place of the plane.
std::optional<SurfacePlace> locate(const ControlMesh& control, const Eigen::Vector2d& p) {
  for (std::size_t t = 0; t < control.triangles.size(); ++t) {
    const auto& triangle = control.triangles[t];
    const Eigen::Vector2d c = control.domain.row(triangle[2]);
    Eigen::Matrix2d sides;
    sides << control.domain.row(triangle[0]).transpose() - c, control.domain.row(triangle[1]).transpose() - c;
    const Eigen::Vector2d uv = sides.inverse() * (p - c);
    if (uv.x() >= 0 && uv.y() >= 0 && uv.sum() <= 1) return SurfacePlace{static_cast<int>(t), uv.x(), uv.y()};
  }
  return std::nullopt;
}

Eigen::Vector2d planePlace(const ControlMesh& control, const SurfacePlace& place) {
  const auto& triangle = control.triangles[static_cast<std::size_t>(place.triangle)];
  return (place.u * control.domain.row(triangle[0]) + place.v * control.domain.row(triangle[1]) +
          (1 - place.u - place.v) * control.domain.row(triangle[2]))
      .transpose();
}

/// The lip that a triangle wholly belongs to; skin beside the lips is on neither.
LipSide lipOf(const ControlMesh& control, std::size_t t) {
  for (const int point : control.triangles[t]) {
    const std::string& name = control.points[static_cast<std::size_t>(point)].name;
    if (!name.starts_with("LIP_") && !name.starts_with("RIM_")) return LipSide::kNone;
  }
  return control.sideOf(t);
}

struct Gap {
  double distance;
  Eigen::Vector3d vertex;
  Eigen::Vector2d plane;
};

class Filler {
 public:
  Filler(const ControlMesh& control, const FaceMesh& mesh)
      : coarse_(control), coarse_surface_(control), control_(control), mesh_(mesh), normals_(vertexNormals(mesh.vertices, mesh.triangles)) {
    const std::vector<PartKind> kinds = vertexKinds(mesh);
    const VertexSides sides = vertexSides(mesh, control, kinds, graphOf(mesh, control));
    forbidden_ = sides.forbidden;
    for (std::size_t v = 0; v < kinds.size(); ++v) {
      if (kinds[v] == PartKind::kSkin || kinds[v] == PartKind::kLips) skin_.push_back(static_cast<Eigen::Index>(v));
    }
  }

  ControlMesh fill() {
    for (int round = 0; round < kMaxRounds && added_ < kMaxFill; ++round) {
      const std::vector<Gap> gaps = widestGaps();
      if (gaps.empty()) break;
      for (const Gap& gap : gaps) add(gap);
      control_.triangles = triangulate(control_);
    }
    return control_;
  }

 private:
  [[nodiscard]] std::vector<Gap> widestGaps() const {
    const BezierSurface surface(control_);
    const SurfaceProjector projector(surface, control_, triangleSides(control_));
    const double width = control_.mouth_width;
    std::vector<Gap> gaps;
    const std::size_t stride = skin_.size() / kMaxSamples + 1;
    for (std::size_t i = 0; i < skin_.size(); i += stride) {
      const Eigen::Vector3d vertex = mesh_.vertices.row(skin_[i]).transpose().cast<double>();
      const Eigen::Vector3d normal = normals_.row(skin_[i]).transpose().cast<double>();
      const auto foot = projector.closest(vertex, normal, kLeastCosine, forbidden_[static_cast<std::size_t>(skin_[i])]);
      if (!foot || foot->at_border || foot->distance < kNearEnough * width || foot->distance > kTooFar * width) continue;
      if (nearest(vertex) > kFromOld * width) gaps.push_back({foot->distance, vertex, planePlace(control_, foot->place)});
    }
    std::stable_sort(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
    std::vector<Gap> chosen;
    for (const Gap& gap : gaps) {
      const bool is_apart = std::none_of(chosen.begin(), chosen.end(), [&](const Gap& c) { return (c.vertex - gap.vertex).norm() < kApart * width; });
      if (is_apart && added_ + chosen.size() < kMaxFill) chosen.push_back(gap);
    }
    return chosen;
  }

  [[nodiscard]] double nearest(const Eigen::Vector3d& p) const {
    return std::sqrt((control_.rest.rowwise() - p.transpose()).rowwise().squaredNorm().minCoeff());
  }

  void add(const Gap& gap) {
    const auto place = locate(coarse_, gap.plane);
    if (!place) return;
    ControlPoint point{.name = {}, .rule = PointRule::kFollow, .side = lipOf(coarse_, static_cast<std::size_t>(place->triangle)), .drivers = {}};
    const char* prefix = point.side == LipSide::kUpper ? "LIP_UP_" : point.side == LipSide::kLower ? "LIP_LO_" : "";
    point.name = prefix + ("FILL_" + std::to_string(added_++));
    const Eigen::VectorXd weights = influences(coarse_surface_, coarse_, *place);
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      if (std::abs(weights[i]) > kLeastWeight && !coarse_.points[static_cast<std::size_t>(i)].fixed) {
        point.drivers.push_back({static_cast<int>(i), weights[i]});
      }
    }
    const Eigen::Index row = control_.rest.rows();
    control_.points.push_back(std::move(point));
    control_.rest.conservativeResize(row + 1, Eigen::NoChange);
    control_.domain.conservativeResize(row + 1, Eigen::NoChange);
    control_.rest.row(row) = gap.vertex.transpose();
    control_.domain.row(row) = gap.plane.transpose();
  }

  const ControlMesh& coarse_;
  BezierSurface coarse_surface_;
  ControlMesh control_;
  const FaceMesh& mesh_;
  VertexPositions normals_;
  std::vector<std::uint32_t> forbidden_;
  std::vector<Eigen::Index> skin_;
  std::size_t added_ = 0;
};

}  // namespace

ControlMesh filledToMesh(const ControlMesh& control, const FaceMesh& mesh) { return Filler(control, mesh).fill(); }

}  // namespace mouthpiece
