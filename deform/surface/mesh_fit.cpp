// Lays the control surface along the skin of a mesh.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/control_steps.h"
#include "deform/surface/surface_projection.h"
#include "deform/surface/virtual_points.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kLongEdge = 0.15;     ///< only edges longer than this are halved: 7.5 mm on a mouth of 50 mm
constexpr double kNearEnough = 0.025;  ///< where the surface is this near the skin no point is added
constexpr double kFromOld = 0.08;      ///< least distance of a new point from an old one
constexpr double kTooFar = 0.3;        ///< skin further off than this is other skin
constexpr double kTrusted = 0.05;      ///< skin further off counts less and less: it may be the inside of a nostril
constexpr double kOutside = 0.3;       ///< outside the markers little moves: being off the skin matters less
constexpr double kRingReach = 1;       ///< the ring is put on skin no further off
constexpr int kRounds = 4;
constexpr int kFinalFits = 2;
constexpr std::size_t kMaxFill = 90;
constexpr std::size_t kMaxSamples = 6000;
constexpr double kLeastCosine = 0.5;   ///< between the normals of skin and surface where the surface is laid along it
constexpr double kLeastWeight = 1e-6;  ///< drivers below it are left out

/// What each point's displacement adds to the displacement at `place`.
/// slopes: of the surface from each point's displacement.
Eigen::VectorXd influences(const BezierSurface& surface, const Eigen::MatrixXd& slopes, const ControlMesh& control,
                           const SurfacePlace& place) {
  const TriangleForm form = formAt(surface, place);
  Eigen::VectorXd all = Eigen::VectorXd::Zero(control.rest.rows());
  for (int i = 0; i < 3; ++i) {
    const int point = control.triangles[unsignedIndex(place.triangle)][unsignedIndex(i)];
    all[point] += form[i];
    all += form[3 + 2 * i] * slopes.row(2 * point).transpose();
    all += form[4 + 2 * i] * slopes.row(2 * point + 1).transpose();
  }
  return all;
}

/// The triangle that holds a place of the plane.
std::optional<SurfacePlace> locate(const ControlMesh& control, const Eigen::Vector2d& p) {
  int t = -1;
  for (const auto& triangle : control.triangles) {
    ++t;
    const Eigen::Vector2d c = control.domain.row(triangle[2]);
    Eigen::Matrix2d sides;
    sides << control.domain.row(triangle[0]).transpose() - c, control.domain.row(triangle[1]).transpose() - c;
    const Eigen::Vector2d uv = sides.inverse() * (p - c);
    if (uv.x() >= 0 && uv.y() >= 0 && uv.sum() <= 1) return SurfacePlace{t, uv.x(), uv.y()};
  }
  return std::nullopt;
}

/// On the edge of one of the face's openings.
bool isRim(const ControlPoint& point) {
  return point.name.starts_with("RIM_") || point.name.starts_with("LID_") || point.name.starts_with("EYE_") ||
         point.name.starts_with("CANTHUS_");
}

/// Between the slit's end and the lips' own: what lies on it belongs to neither lip, and a point there that went with
/// one would join it to the other.
bool isBetweenLips(const ControlPoint& one, const ControlPoint& other) {
  const auto ends = [](const ControlPoint& inner, const ControlPoint& outer) {
    return inner.name.starts_with("RIM_CORNER_") && outer.name.starts_with("LIP_CORNER_");
  };
  return ends(one, other) || ends(other, one);
}

/// The lip that a triangle wholly belongs to; skin beside the lips is on neither.
LipSide lipOf(const ControlMesh& control, std::size_t t) {
  for (const int point : control.triangles[t]) {
    const std::string& name = control.points[unsignedIndex(point)].name;
    if (!name.starts_with("LIP_") && !name.starts_with("RIM_")) return LipSide::kNone;
  }
  return control.sideOf(t);
}

/// The mesh's skin in the plane, to find what lies over a place of it.
class UnrolledSkin {
 public:
  UnrolledSkin(const FaceMesh& mesh, const Cylinder& cylinder)
      : mesh_(mesh), cylinder_(cylinder), plane_(mesh.vertices.rows(), 2) {
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v)
      plane_.row(v) = cylinder.unrolled(pointAt(mesh.vertices, v)).transpose();
    if (plane_.rows() == 0) return;
    left_ = plane_.col(0).minCoeff();
    column_ = (plane_.col(0).maxCoeff() - left_) / kColumns;
    for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips})) {
      const auto [from, to] = std::minmax({plane_(t[0], 0), plane_(t[1], 0), plane_(t[2], 0)});
      // A triangle across the seam behind the head spans the plane; it is none of the face's.
      if (to - from > cylinder_.radius) continue;
      for (std::size_t c = columnOf(from); c <= columnOf(to); ++c) columns_[c].push_back(t);
    }
  }

  /// The skin over `p` nearest to `near`, no further from it than `reach`, that faces outwards.
  [[nodiscard]] std::optional<Eigen::Vector3d> over(const Eigen::Vector2d& p, const Eigen::Vector3d& near,
                                                    double reach) const {
    std::optional<Eigen::Vector3d> best;
    double nearest = reach;
    for (const Triangle& t : columns_[columnOf(p.x())]) {
      const Eigen::RowVector2d a = plane_.row(t[0]), b = plane_.row(t[1]), c = plane_.row(t[2]);
      if (std::max({a.x(), b.x(), c.x()}) < p.x() || std::min({a.x(), b.x(), c.x()}) > p.x()) continue;
      if (std::max({a.y(), b.y(), c.y()}) < p.y() || std::min({a.y(), b.y(), c.y()}) > p.y()) continue;
      Eigen::Matrix2d sides;
      sides << (a - c).transpose(), (b - c).transpose();
      const Eigen::Vector2d uv = sides.inverse() * (p - c.transpose());
      if (!(uv.x() >= 0 && uv.y() >= 0 && uv.sum() <= 1)) continue;
      const Eigen::Vector3d place = vertex(t[0]) * uv.x() + vertex(t[1]) * uv.y() + vertex(t[2]) * (1 - uv.sum());
      const Eigen::Vector3d normal = (vertex(t[1]) - vertex(t[0])).cross(vertex(t[2]) - vertex(t[0]));
      const bool faces_outwards =
          normal.x() * (place.x() - cylinder_.axis_x) + normal.z() * (place.z() - cylinder_.axis_z) > 0;
      if (!faces_outwards || (place - near).norm() >= nearest) continue;
      nearest = (place - near).norm();
      best = place;
    }
    return best;
  }

 private:
  [[nodiscard]] Eigen::Vector3d vertex(std::uint32_t v) const { return pointAt(mesh_.vertices, v); }

  [[nodiscard]] std::size_t columnOf(double x) const {
    const double at = column_ > 0 ? (x - left_) / column_ : 0;
    return unsignedIndex(wholePart(std::clamp(at, 0.0, kColumns - 1.0)));
  }

  static constexpr int kColumns = 256;
  const FaceMesh& mesh_;
  Cylinder cylinder_;
  Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::RowMajor> plane_;
  double left_ = 0, column_ = 0;                         ///< of the plane's triangles, in columns of x
  std::array<std::vector<Triangle>, kColumns> columns_;  ///< those that reach into each
};

class Fitter {
 public:
  Fitter(const ControlMesh& control, const FaceMesh& mesh, const HeadTopology& topology)
      : coarse_(control),
        surface_(control),
        slopes_(surface_.slopesFrom(Eigen::MatrixXd::Identity(control.rest.rows(), control.rest.rows()))),
        unrolled_(mesh, cylinderOf(control)),
        mesh_(mesh),
        forbidden_(topology.forbidden()),
        control_(control),
        normals_(vertexNormals(mesh.vertices, mesh.triangles)) {
    for (std::size_t v = 0; v < forbidden_.size(); ++v) {
      if (isSkin(topology.kinds()[v]) && !topology.isInMouth(v)) skin_.push_back(v);
    }
  }

  ControlMesh fit() {
    putRingOnSkin();
    for (int round = 0; round < kRounds; ++round) {
      layAlongSkin();
      const std::size_t before = added_;
      for (const Gap& gap : gaps()) close(gap);
      if (added_ == before) break;
      control_.triangles = triangulate(control_);
      control_.rest_slopes.resize(0, 3);
    }
    for (int i = 0; i < kFinalFits; ++i) layAlongSkin();
    return control_;
  }

 private:
  /// A place where a point is wanted: in the plane, and on the skin over it.
  struct Gap {
    Eigen::Vector2d plane;
    Eigen::Vector3d skin;
    double distance;  ///< of the surface from the skin, as far as it matters
  };

  /// Ring points may lie anywhere near where motion shall end; on the skin they make the better surface.
  void putRingOnSkin() {
    for (std::size_t i = 0; i < control_.points.size(); ++i) {
      const auto row = signedIndex(i);
      if (!control_.points[i].fixed) continue;
      const auto over = unrolled_.over(control_.domain.row(row).transpose(), control_.rest.row(row).transpose(),
                                       kRingReach * control_.mouth_width);
      if (over) control_.rest.row(row) = over->transpose();
    }
  }

  /// Slopes at rest from the skin above the surface as it lies now.
  void layAlongSkin() {
    const BezierSurface surface(control_);
    const SurfaceProjector projector(surface, control_, triangleSides(control_));
    std::vector<SurfaceSample> samples;
    const std::size_t stride = skin_.size() / kMaxSamples + 1;
    for (std::size_t i = 0; i < skin_.size(); i += stride) {
      const Eigen::Vector3d vertex = pointAt(mesh_.vertices, skin_[i]);
      const auto foot = projector.closest(vertex, pointAt(normals_, skin_[i]), kLeastCosine, forbidden_[skin_[i]]);
      if (foot && !foot->at_border && foot->distance < kTooFar * control_.mouth_width) {
        samples.push_back(
            {foot->place, vertex, 1 / (1 + std::pow(foot->distance / (kTrusted * control_.mouth_width), 2))});
      }
    }
    control_.rest_slopes = slopesNear(control_, samples);
  }

  /// Middles of long edges and of large triangles where the surface is off the skin, worst first. Edges of the
  /// openings' rims, of the ring and between the lips stay whole.
  [[nodiscard]] std::vector<Gap> gaps() const {
    const BezierSurface surface(control_);
    std::vector<Gap> found;
    const auto look = [&](const SurfacePlace& place) {
      const auto& triangle = control_.triangles[unsignedIndex(place.triangle)];
      const Eigen::Vector2d plane =
          (place.u * control_.domain.row(triangle[0]) + place.v * control_.domain.row(triangle[1]) +
           (1 - place.u - place.v) * control_.domain.row(triangle[2]))
              .transpose();
      const Eigen::Vector3d position = evaluate(surface.restPose(), place).position;
      const auto over = unrolled_.over(plane, position, kTooFar * control_.mouth_width);
      if (!over) return;
      const bool is_outside =
          std::any_of(triangle.begin(), triangle.end(), [&](int corner) { return point(corner).fixed; });
      const double distance = (*over - position).norm() * (is_outside ? kOutside : 1);
      if (distance > kNearEnough * control_.mouth_width) found.push_back({plane, *over, distance});
    };
    for (std::size_t t = 0; t < control_.triangles.size(); ++t) {
      const int id = static_cast<int>(t);
      double longest = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const int from = control_.triangles[t][k], to = control_.triangles[t][(k + 1) % 3];
        const double length = (control_.rest.row(from) - control_.rest.row(to)).norm();
        longest = std::max(longest, length);
        const bool is_whole = (isRim(point(from)) && isRim(point(to))) || (point(from).fixed && point(to).fixed) ||
                              isBetweenLips(point(from), point(to));
        if (from < to && !is_whole && length > kLongEdge * control_.mouth_width)
          look({id, k == 1 ? 0.0 : 0.5, k == 2 ? 0.0 : 0.5});
      }
      if (longest > kLongEdge * control_.mouth_width) look({id, 1.0 / 3, 1.0 / 3});
    }
    std::stable_sort(found.begin(), found.end(), [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
    return found;
  }

  /// A new point on the skin.
  void close(const Gap& gap) {
    const auto place = locate(coarse_, gap.plane);
    const double nearest =
        std::sqrt((control_.rest.rowwise() - gap.skin.transpose()).rowwise().squaredNorm().minCoeff());
    if (added_ < kMaxFill && place && nearest > kFromOld * control_.mouth_width) add(gap.skin, gap.plane, *place);
  }

  void add(const Eigen::Vector3d& position, const Eigen::Vector2d& plane, const SurfacePlace& place) {
    ControlPoint added{
        .name = {}, .rule = PointRule::kFollow, .side = lipOf(coarse_, unsignedIndex(place.triangle)), .drivers = {}};
    const char* lip = added.side == LipSide::kUpper ? "LIP_UP_" : added.side == LipSide::kLower ? "LIP_LO_" : "";
    added.name = lip + ("FILL_" + std::to_string(added_++));
    const Eigen::VectorXd shares = influences(surface_, slopes_, coarse_, place);
    for (Eigen::Index i = 0; i < shares.size(); ++i) {
      if (std::abs(shares[i]) > kLeastWeight && !coarse_.points[unsignedIndex(i)].fixed) {
        added.drivers.push_back({static_cast<int>(i), shares[i]});
      }
    }
    const Eigen::Index row = control_.rest.rows();
    control_.points.push_back(std::move(added));
    control_.rest.conservativeResize(row + 1, Eigen::NoChange);
    control_.domain.conservativeResize(row + 1, Eigen::NoChange);
    control_.rest.row(row) = position.transpose();
    control_.domain.row(row) = plane.transpose();
  }

  [[nodiscard]] const ControlPoint& point(int index) const { return control_.points[unsignedIndex(index)]; }

  const ControlMesh& coarse_;
  BezierSurface surface_;
  Eigen::MatrixXd slopes_;
  UnrolledSkin unrolled_;
  const FaceMesh& mesh_;
  const std::vector<std::uint32_t>& forbidden_;
  ControlMesh control_;
  VertexPositions normals_;
  std::vector<std::size_t> skin_;
  std::size_t added_ = 0;
};

}  // namespace

ControlMesh laidAlongSkin(const ControlMesh& control, const FaceMesh& mesh, const HeadTopology& topology) {
  return Fitter(control, mesh, topology).fit();
}

}  // namespace mouthpiece
