// The lips of face_fit.h, measured on the mesh.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mesh/triangle_tree.h"
#include "deform/surface/virtual_points.h"
#include "retarget/rig/face_fit.h"

namespace mouthpiece {
namespace {

// Lengths as shares of the mouth's width.
constexpr double kRegion = 0.25;          ///< the lips' surfaces reach this far from the line where they meet
constexpr double kLips = 0.12;            ///< and are looked at this far
constexpr double kBetweenCorners = 0.35;  ///< and this far to both sides: at the corners the lips are one
constexpr double kMostCuts = 64;          ///< points looked at on an edge
constexpr double kDeepest = 0.2;          ///< further behind a surface a point is elsewhere, not inside it
constexpr double kDeepInTongue = 0.06;    ///< the same of the tongue, which is soft
constexpr double kStraight = 0.7;         ///< cosine to the normal of a way straight out of the tongue
constexpr double kOpposed = -0.3;         ///< cosine between two surfaces that meet
constexpr double kOnBorder = 1e-9;        ///< a weight below this: the closest point lies on the opposite edge
constexpr std::size_t kColumns = 10;      ///< over the middle half of the mouth
constexpr std::size_t kNoColumn = kColumns;

/// A place on a triangle of the mesh.
struct LipPoint {
  Triangle triangle;
  Eigen::Vector3d weights;
  std::size_t column;
};

Eigen::Vector3d placeOf(const LipPoint& point, const VertexPositions& vertices) {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < 3; ++k) {
    p += point.weights[signedIndex(k)] * pointAt(vertices, point.triangle[k]);
  }
  return p;
}

/// One surface of the mouth: triangles, and which of their edges end it.
struct Surface {
  std::vector<Triangle> triangles;
  std::vector<std::array<bool, 3>> is_border;  ///< edge opposite of corner k

  void findBorders() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> uses;
    const auto edge = [](const Triangle& t, std::size_t k) { return std::minmax(t[(k + 1) % 3], t[(k + 2) % 3]); };
    for (const Triangle& triangle : triangles) {
      for (std::size_t k = 0; k < 3; ++k) ++uses[edge(triangle, k)];
    }
    for (const Triangle& triangle : triangles) {
      auto& border = is_border.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) border[k] = uses[edge(triangle, k)] == 1;
    }
  }
};

struct Lip {
  Surface surface;
  std::vector<LipPoint> points;
};

/// A surface in a pose: distances from it, below zero inside.
class PosedSurface {
 public:
  PosedSurface(const Surface& surface, const VertexPositions& vertices)
      : surface_(surface), normals_(vertexNormals(vertices, surface.triangles)), tree_(vertices, surface.triangles) {}

  /// nullopt where no triangle is near. `facing`: the normal of the surface that `p` lies on; inside is only what faces
  /// the other way, as the folds of one lip do not. `least_cosine`: between the way there and its normal, for surfaces
  /// with sharp edges, where normals do not tell what is inside.
  [[nodiscard]] std::optional<double> signedDistance(const Eigen::Vector3d& p, const Eigen::Vector3d& facing,
                                                     double least_cosine = 0) const {
    const auto foot = tree_.closest(p);
    if (!foot) return std::nullopt;
    const double distance = (p - foot->point).norm();
    for (std::size_t k = 0; k < 3; ++k) {
      if (surface_.is_border[foot->triangle][k] && foot->weights[signedIndex(k)] < kOnBorder) return distance;
    }
    const Eigen::Vector3d normal = normalAt({surface_.triangles[foot->triangle], foot->weights, kNoColumn});
    const double over = (p - foot->point).dot(normal);
    return over < -least_cosine * distance && normal.dot(facing) < kOpposed ? -distance : distance;
  }

  [[nodiscard]] Eigen::Vector3d normalAt(const LipPoint& point) const { return placeOf(point, normals_).normalized(); }

 private:
  const Surface& surface_;
  VertexPositions normals_;
  TriangleTree tree_;
};

/// Chooses what is measured, once, on the mesh at rest.
class Chooser {
 public:
  Chooser(const FaceMesh& mesh, const ControlMesh& control, double step)
      : mesh_(mesh),
        topology_(mesh, openingsOf(control)),
        step_(step * control.mouth_width),
        lips_(kLips * control.mouth_width) {
    const auto place = [&](const std::string& name) -> Eigen::Vector3d {
      const int point = findPoint(control, name);
      if (point < 0) throw InputError("found no point " + name + " on the control surface; expected a face's mouth");
      return control.rest.row(point).transpose();
    };
    for (const std::string& name : mouthRim()) rim_.push_back(place(name));
    from_ = place("LIP_CORNER_R");
    along_ = place("LIP_CORNER_L") - from_;
    for (std::size_t v = 0; v < mesh.vertexCount(); ++v) {
      const PartKind kind = topology_.kinds()[v];
      is_near_.push_back((isSkin(kind) || kind == PartKind::kMouthInside) &&
                         distanceToLine(vertex(v), rim_) < kRegion * control.mouth_width);
    }
  }

  /// The triangles of one lip: those off the other one's side.
  [[nodiscard]] Lip lipOff(SideBit other) const {
    Lip lip;
    for (const Triangle& triangle : mesh_.triangles) {
      const bool is_in = std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) {
        return is_near_[v] && (topology_.forbidden()[v] & other) != 0;
      });
      if (!is_in) continue;
      lip.surface.triangles.push_back(triangle);
      addPoints(triangle, lip.points);
    }
    lip.surface.findBorders();
    return lip;
  }

 private:
  [[nodiscard]] Eigen::Vector3d vertex(std::size_t v) const { return pointAt(mesh_.vertices, v); }

  /// A regular net; corners and edges that two triangles share count once.
  void addPoints(const Triangle& triangle, std::vector<LipPoint>& points) const {
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (vertex(triangle[k]) - vertex(triangle[(k + 1) % 3])).norm());
    const int cuts = static_cast<int>(std::clamp(std::ceil(longest / step_), 1.0, kMostCuts));
    for (int i = 0; i < cuts; ++i) {
      for (int j = 0; i + j < cuts; ++j) {
        LipPoint point{triangle, Eigen::Vector3d(cuts - i - j, i, j) / cuts, kNoColumn};
        const Eigen::Vector3d p = placeOf(point, mesh_.vertices);
        if (distanceToLine(p, rim_) > lips_) continue;
        const double way = (p - from_).dot(along_) / along_.squaredNorm();
        if (std::abs(way - 0.5) > kBetweenCorners) continue;
        const double column = (way - 0.25) / 0.5 * asReal(kColumns);
        if (column >= 0 && column < asReal(kColumns)) point.column = unsignedIndex(wholePart(column));
        points.push_back(point);
      }
    }
  }

  const FaceMesh& mesh_;
  HeadTopology topology_;
  double step_, lips_;
  std::vector<Eigen::Vector3d> rim_;
  Eigen::Vector3d from_, along_;
  std::vector<bool> is_near_;
};

}  // namespace

struct LipContactMeter::Data {
  double deepest = 0, deep_in_tongue = 0;
  Lip upper, lower;
  Surface teeth, tongue;
};

LipContactMeter::LipContactMeter(const FaceMesh& mesh, const ControlMesh& control, double step) {
  const Chooser chooser(mesh, control, step);
  auto data = std::make_unique<Data>();
  data->deepest = kDeepest * control.mouth_width;
  data->deep_in_tongue = kDeepInTongue * control.mouth_width;
  data->upper = chooser.lipOff(kLowerLip);
  data->lower = chooser.lipOff(kUpperLip);
  data->teeth.triangles = trianglesOf(mesh, {PartKind::kUpperTeeth, PartKind::kLowerTeeth});
  data->teeth.findBorders();
  data->tongue.triangles = trianglesOf(mesh, {PartKind::kTongue});
  data->tongue.findBorders();
  data_ = std::move(data);
}

LipContactMeter::LipContactMeter(LipContactMeter&&) noexcept = default;
LipContactMeter::~LipContactMeter() = default;

LipContact LipContactMeter::measure(const VertexPositions& vertices) const {
  const PosedSurface upper(data_->upper.surface, vertices), lower(data_->lower.surface, vertices);
  const PosedSurface teeth(data_->teeth, vertices), tongue(data_->tongue, vertices);
  LipContact contact;
  std::array<double, kColumns> gaps;
  gaps.fill(std::numeric_limits<double>::infinity());
  const auto look = [&](const std::vector<LipPoint>& points, const PosedSurface& own, const PosedSurface& other) {
    for (const LipPoint& point : points) {
      const Eigen::Vector3d p = placeOf(point, vertices);
      const Eigen::Vector3d facing = own.normalAt(point);
      if (const auto gap = other.signedDistance(p, facing); gap && *gap > -data_->deepest) {
        contact.overlap = std::max(contact.overlap, -*gap);
        if (point.column != kNoColumn) gaps[point.column] = std::min(gaps[point.column], *gap);
      }
      if (const auto gap = teeth.signedDistance(p, facing); gap && *gap > -data_->deepest)
        contact.in_teeth = std::max(contact.in_teeth, -*gap);
      if (const auto gap = tongue.signedDistance(p, facing, kStraight); gap && *gap > -data_->deep_in_tongue)
        contact.in_tongue = std::max(contact.in_tongue, -*gap);
    }
  };
  look(data_->lower.points, lower, upper);
  look(data_->upper.points, upper, lower);
  contact.gap = *std::max_element(gaps.begin(), gaps.end());
  return contact;
}

}  // namespace mouthpiece
