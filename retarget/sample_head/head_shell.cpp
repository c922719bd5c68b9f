#include "retarget/sample_head/head_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "base/errors.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// Approximate signed distance to an ellipsoid; exact on its surface.
double ellipsoid(const Vector3d& point, const Vector3d& centre, const Vector3d& radii) {
  const Vector3d q = (point - centre).cwiseQuotient(radii);
  const double k = q.norm();
  const double slope = (point - centre).cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return slope > 0 ? k * (k - 1) / slope : -radii.minCoeff();
}

/// A cone with round ends along a segment.
double roundCone(const Vector3d& point, const Vector3d& from, const Vector3d& to, double radius_from,
                 double radius_to) {
  const Vector3d axis = to - from;
  const double way = std::clamp((point - from).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (point - from - way * axis).norm() - ((1 - way) * radius_from + way * radius_to);
}

/// Union of two forms with a rounded joint `width` millimetres wide.
double smoothUnion(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - 0.25 * h * h * width;
}

/// Signed distance to the head's outer form, millimetres; negative inside. The shell lies on its zero level.
double headDistance(const Vector3d& p) {
  const double skull = ellipsoid(p, {0, 42, -34}, {77, 83, 97});
  const double jaw = ellipsoid(p, {0, -32, 4}, {63, 66, 58});
  const double neck = roundCone(p, {0, -40, -50}, {0, -230, -68}, 47, 55);
  return smoothUnion(smoothUnion(skull, jaw, 36), neck, 26);
}

/// The half planes that sweep the head turn about this line (along x): in front of the neck, below the chin.
constexpr double kPivotY = -142;
constexpr double kPivotZ = 38;
/// The last half plane cuts the neck level, or a little lower at the back.
constexpr double kLastAngle = 96 * std::numbers::pi / 180;

Vector3d sweepDirection(double angle) { return {0, std::cos(angle), -std::sin(angle)}; }

/// How far from the pivot, within the mid plane, the head begins and ends in the half plane at `angle`.
std::pair<double, double> extent(double angle) {
  const Vector3d pivot(0, kPivotY, kPivotZ);
  const Vector3d direction = sweepDirection(angle);
  double near = -1;
  double far = -1;
  for (double way = 0; way < 400; way += 0.5) {
    if (headDistance(pivot + way * direction) > 0) continue;
    if (near < 0) near = way;
    far = way;
  }
  MOUTHPIECE_EXPECT(near >= 0);
  return {near, far};
}

Vector3d surfaceAlong(const Vector3d& from, const Vector3d& direction) {
  double low = 0;
  double high = 300;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (headDistance(from + middle * direction) < 0 ? low : high) = middle;
  }
  return from + low * direction;
}

/// One point of the head's form: half plane `angle`, direction `turn` within it (0: to the subject's left, pi/2:
/// outward).
Vector3d shellPoint(double angle, double turn) {
  const auto [near, far] = extent(angle);
  const Vector3d centre = Vector3d(0, kPivotY, kPivotZ) + 0.5 * (near + far) * sweepDirection(angle);
  return surfaceAlong(centre, std::cos(turn) * Vector3d::UnitX() + std::sin(turn) * sweepDirection(angle));
}

struct RimPoint {
  double angle = 0;
  double turn = 0;
  Vector3d offset;  ///< from the form to where the face's outline really is
};

RimPoint rimPointOf(const Vector3d& point) {
  RimPoint rim;
  rim.angle = std::atan2(-(point.z() - kPivotZ), point.y() - kPivotY);
  const auto [near, far] = extent(rim.angle);
  const double along = (point - Vector3d(0, kPivotY, kPivotZ)).dot(sweepDirection(rim.angle));
  rim.turn = std::atan2(along - 0.5 * (near + far), point.x());
  rim.offset = point - shellPoint(rim.angle, rim.turn);
  return rim;
}

}  // namespace

void addHeadShell(ModelMesh& face) {
  constexpr std::size_t kRings = 15;
  constexpr double kNeckDropMm = 34;
  const std::size_t n = kFaceOutline.size();
  std::vector<RimPoint> rim;
  for (const std::uint32_t vertex : kFaceOutline) rim.push_back(rimPointOf(face.point(vertex)));
  std::set<ModelMesh::Edge> forward;
  for (const auto& t : face.triangles) {
    for (std::size_t k = 0; k < 3; ++k) forward.insert({t[k], t[(k + 1) % 3]});
  }
  const bool runs_forward = forward.contains({kFaceOutline[0], kFaceOutline[1]});

  std::vector<std::uint32_t> outer(kFaceOutline.begin(), kFaceOutline.end());
  for (std::size_t ring = 1; ring <= kRings + 1; ++ring) {
    std::vector<std::uint32_t> inner;
    const double way = std::min(1.0, asReal(ring) / kRings);
    const double fade = (1 - way) * (1 - way) * (1 - way);
    for (std::size_t k = 0; k < n; ++k) {
      const RimPoint& start = rim[k];
      const double angle = start.angle + way * (kLastAngle - start.angle);
      Vector3d point = shellPoint(angle, start.turn) + fade * start.offset;
      if (ring > kRings) point = shellPoint(kLastAngle, start.turn) + Vector3d(0, -kNeckDropMm, -4);
      inner.push_back(face.addVertex(point));
      face.vertices(inner.back(), kShell) = 1;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      // The outline begins in the middle above and runs left first: cut the second half the other way, as a mirror
      // would.
      const auto cut = k < n / 2 ? ModelMesh::Cut::kFromFirst : ModelMesh::Cut::kFromSecond;
      if (runs_forward)
        face.addQuad(outer[next], outer[k], inner[next], inner[k], kPartSkin, cut);
      else
        face.addQuad(outer[k], outer[next], inner[k], inner[next], kPartSkin, cut);
    }
    outer = inner;
  }
}

namespace {

/// Height of the ear's relief over its own plane, by the way from its middle (0) to its edge (1) and the turn around.
double earRelief(double radius, double turn) {
  const double back = 0.5 - 0.5 * std::cos(turn);  // 0 at the front edge, where the ear meets the cheek
  const auto bump = [](double x, double at, double width) { return std::exp(-(x - at) * (x - at) / (width * width)); };
  const double helix = 5.0 * bump(radius, 0.93, 0.10) * (0.25 + 0.75 * back);
  const double antihelix = 3.8 * bump(radius, 0.66, 0.12) * back;
  const double bowl = -6.5 * bump(radius, 0.12, 0.36);
  const double tragus = 3.0 * bump(radius, 0.55, 0.2) * std::pow(std::max(0.0, std::cos(turn)), 6);
  return helix + antihelix + bowl + tragus + 5.0 * radius * back;
}

Vector3d earPoint(double radius, double turn, double relief, double side) {
  // An ear's outline: round above, narrow at the lobe; turn 0 points to the front, pi/2 up.
  const double up = std::sin(turn);
  const double height = up > 0 ? 28 : 27;
  const double width = 15.5 * (up > 0 ? 1.0 : 1.0 - 0.42 * up * up);
  const double front = radius * width * std::cos(turn) + 3.0 * up * radius;
  const double rise = radius * height * up;
  // Leans back, and stands off the head by some 25 degrees.
  constexpr double kLean = 0.16;
  constexpr double kStandOff = 0.42;
  const double z = std::cos(kLean) * front - std::sin(kLean) * rise;
  const double y = std::cos(kLean) * rise + std::sin(kLean) * front;
  const double x = relief + std::sin(kStandOff) * (11 - z);
  return {side * (76.2 + x), 5 + y, -41 + std::cos(kStandOff) * z};
}

}  // namespace

ModelMesh makeEars() {
  constexpr int kAround = 20;
  constexpr int kRows = 10;
  ModelMesh ears;
  for (const double side : {-1.0, 1.0}) {
    const auto place = [&](double radius, double turn, double relief) {
      const std::uint32_t vertex = ears.addVertex(earPoint(radius, turn, relief, side));
      ears.vertices(vertex, kShell) = 1;
      // Light does not reach the bowl, nor the groove inside the rim.
      const double bowl = std::exp(-std::pow((radius - 0.1) / 0.36, 2));
      const double groove = std::exp(-std::pow((radius - 0.80) / 0.07, 2)) * (0.5 - 0.5 * std::cos(turn));
      ears.vertices(vertex, kFlush) = std::max(0.42 * bowl, 0.3 * groove);
      return vertex;
    };
    const std::uint32_t centre = place(0, 0, earRelief(0, 0));
    std::vector<std::uint32_t> last;
    for (int row = 1; row <= kRows + 2; ++row) {
      std::vector<std::uint32_t> ring;
      for (int k = 0; k < kAround; ++k) {
        const double turn = 2 * std::numbers::pi * k / kAround;
        const double radius = asReal(std::min(row, kRows)) / kRows;
        double relief = earRelief(radius, turn);
        double shrink = 1;
        if (row == kRows + 1) relief -= 4, shrink = 0.98;  // the edge's thickness
        if (row == kRows + 2) relief -= 22, shrink = 0.7;  // into the head
        ring.push_back(place(radius * shrink, turn, relief));
      }
      if (row > 1) ears.addBand(last, ring, kPartSkin, side < 0);
      for (std::size_t a = 0; a < ring.size() && row == 1; ++a) {
        const std::uint32_t here = ring[a], next = ring[(a + 1) % ring.size()];
        ears.addTriangle(centre, side < 0 ? here : next, side < 0 ? next : here, kPartSkin);
      }
      last = ring;
    }
  }
  return ears;
}

/// Height of the hairline by depth: forehead, temple, in front of the ear, behind it, nape.
double hairlineHeight(double z) {
  struct Knot {
    double z, y;
  };
  constexpr std::array kLine{Knot{-140, -62}, Knot{-95, -58}, Knot{-66, -38}, Knot{-54, 4}, Knot{-40, 18}, Knot{-26, 8},
                             Knot{-19, 22},   Knot{-8, 46},   Knot{14, 62},   Knot{40, 76}, Knot{70, 80}};
  if (z <= kLine.front().z) return kLine.front().y;
  for (std::size_t i = 0; i + 1 < kLine.size(); ++i) {
    if (z > kLine[i + 1].z) continue;
    const double t = (z - kLine[i].z) / (kLine[i + 1].z - kLine[i].z);
    return kLine[i].y + t * (kLine[i + 1].y - kLine[i].y);
  }
  return kLine.back().y;
}

ModelMesh makeHair(const ModelMesh& head) {
  constexpr double kThicknessMm = 7.5;
  constexpr double kRootMm = 3.0;  // below the skin, so that no edge shows
  constexpr double kReachMm = 16;  // over which it grows to its thickness
  const auto above = [&](const Vector3d& p) {
    const double from_temple = (std::abs(p.x()) - 36) / 13;
    const double recess = p.z() > 10 ? 5.5 * std::exp(-from_temple * from_temple) : 0;
    const double uneven = 0.5 * std::sin(0.41 * p.x()) + 0.4 * std::sin(0.23 * p.x() + 1);
    return p.y() - hairlineHeight(p.z()) - recess - uneven;
  };
  ModelMesh hair;
  constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::vector<std::uint32_t> copy(unsignedIndex(head.vertices.rows()), kNone);
  for (std::size_t i = 0; i < head.triangles.size(); ++i) {
    const auto& corners = head.triangles[i];
    const bool grows =
        head.part_of_triangle[i] == kPartSkin &&
        std::any_of(corners.begin(), corners.end(), [&](std::uint32_t v) { return above(head.point(v)) > -8; });
    if (!grows) continue;
    std::array<std::uint32_t, 3> own{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = copy[corners[k]];
      if (vertex == kNone) vertex = hair.addVertex(head.point(corners[k]));
      own[k] = vertex;
    }
    hair.addTriangle(own[0], own[1], own[2], kPartHair);
  }
  // Fine where it begins, so that the hairline is a line.
  constexpr double kEdgeMm = 9.5;
  constexpr double kHairlineEdgeMm = 6;
  constexpr double kHairlineMm = 5;
  for (int level = 0; level < 2; ++level) {
    hair = loopSubdividedWhere(hair, [&](std::size_t i) {
      const bool is_hairline = std::abs(above(hair.centroid(i))) < kHairlineMm;
      return hair.longestEdge(i) > (is_hairline ? kHairlineEdgeMm : kEdgeMm);
    });
  }
  // Outward along the form's gradient; combed back in shallow waves.
  for (std::uint32_t vertex = 0; vertex < hair.vertices.rows(); ++vertex) {
    const Vector3d p = hair.point(vertex);
    constexpr double kStep = 0.5;
    const auto along = [&](const Vector3d& axis) {
      return headDistance(p + kStep * axis) - headDistance(p - kStep * axis);
    };
    const Vector3d outward =
        Vector3d(along(Vector3d::UnitX()), along(Vector3d::UnitY()), along(Vector3d::UnitZ())).normalized();
    const double across = std::atan2(p.x(), p.y() - 20);
    const double wave = 0.55 * std::sin(46 * across + 0.05 * p.z()) + 0.35 * std::sin(83 * across - 0.09 * p.z() + 1.3);
    const double reached = std::clamp((above(p) + 4) / kReachMm, 0.0, 1.0);
    const double grown = reached * (2 - reached);
    hair.setPoint(vertex, p + (grown * (kThicknessMm + 0.9 * wave) - (1 - grown) * kRootMm) * outward);
  }
  return hair;
}

}  // namespace mouthpiece
