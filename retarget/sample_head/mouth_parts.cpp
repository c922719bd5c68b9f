#include "retarget/sample_head/head_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// The dental arch seen from above: half an ellipse around (0, back).
struct Arch {
  double half_width, depth, back;

  [[nodiscard]] Vector3d point(double turn) const {
    return {half_width * std::sin(turn), 0, back + depth * std::cos(turn)};
  }
  [[nodiscard]] Vector3d tangent(double turn) const {
    return Vector3d(half_width * std::cos(turn), 0, -depth * std::sin(turn)).normalized();
  }
  /// The turn at an arc length from the middle, in millimetres.
  [[nodiscard]] double turnAt(double length) const {
    double turn = 0;
    constexpr double kStep = 0.002;
    for (double walked = 0; walked < std::abs(length); turn += kStep)
      walked += (point(turn + kStep) - point(turn)).norm();
    return length < 0 ? -turn : turn;
  }
};

constexpr double kGapMm = 0.08;  ///< between teeth

struct ToothForm {
  double width, height, thickness;
  bool is_molar;
};
/// From the middle outward, millimetres (crowns).
constexpr std::array kUpperForms{ToothForm{8.4, 10.2, 6.8, false}, ToothForm{6.6, 9.0, 6.2, false},
                                 ToothForm{7.4, 10.0, 7.6, false}, ToothForm{6.9, 8.4, 8.6, true},
                                 ToothForm{6.7, 8.0, 8.8, true},   ToothForm{9.8, 7.4, 10.4, true},
                                 ToothForm{9.4, 7.0, 10.2, true}};
constexpr std::array kLowerForms{ToothForm{5.2, 8.8, 6.0, false},  ToothForm{5.7, 9.0, 6.2, false},
                                 ToothForm{6.7, 10.0, 7.4, false}, ToothForm{6.9, 8.6, 7.8, true},
                                 ToothForm{7.0, 8.2, 8.4, true},   ToothForm{10.6, 7.6, 10.0, true},
                                 ToothForm{10.2, 7.2, 9.8, true}};

/// A rounded box: superellipse cross-sections from the gum to the biting edge.
void addTooth(ModelMesh& mesh, const Vector3d& neck, const Vector3d& right, const Vector3d& out, double down,
              const ToothForm& form, int part) {
  constexpr int kAround = 14;
  struct Section {
    double way, width, thickness;  // shares of height, width, thickness
  };
  // An incisor narrows to an edge, a molar keeps its table.
  constexpr std::array kIncisor{Section{-0.35, 0.60, 0.70}, Section{0.0, 0.80, 0.98},  Section{0.30, 0.93, 0.92},
                                Section{0.62, 0.99, 0.66},  Section{0.88, 0.98, 0.38}, Section{0.98, 0.86, 0.24}};
  constexpr std::array kMolar{Section{-0.35, 0.70, 0.75}, Section{0.0, 0.86, 0.94},  Section{0.35, 0.98, 1.0},
                              Section{0.70, 0.98, 0.94},  Section{0.92, 0.86, 0.78}, Section{1.0, 0.62, 0.52}};
  std::vector<std::uint32_t> last;
  const auto& sections = form.is_molar ? kMolar : kIncisor;
  for (const Section& section : sections) {
    std::vector<std::uint32_t> ring;
    for (int k = 0; k < kAround; ++k) {
      const double turn = 2 * std::numbers::pi * k / kAround;
      constexpr double kSquareness = 0.62;
      const double c = std::copysign(std::pow(std::abs(std::cos(turn)), kSquareness), std::cos(turn));
      const double s = std::copysign(std::pow(std::abs(std::sin(turn)), kSquareness), std::sin(turn));
      // The front face leans back towards the biting edge a little.
      const double lean = form.is_molar ? 0.0 : -0.9 * section.way * section.way;
      const Vector3d point = neck + 0.5 * form.width * section.width * c * right +
                             (0.5 * form.thickness * section.thickness * s -
                              0.5 * form.thickness * (1 - section.thickness) * 0.35 + lean) *
                                 out +
                             Vector3d(0, -down * section.way * form.height, 0);
      ring.push_back(mesh.addVertex(point));
    }
    if (!last.empty()) mesh.addBand(last, ring, part, down < 0);
    last = ring;
  }
  Vector3d tip = Vector3d::Zero();
  for (const std::uint32_t vertex : last) tip += mesh.point(vertex) / asReal(last.size());
  const std::uint32_t cap = mesh.addVertex(tip + Vector3d(0, -down * (form.is_molar ? -0.4 : 0.25), 0));
  mesh.addFan(last, cap, part, down < 0);
}

/// One row: teeth with small gaps, and a gum that swells between the necks. `down` is +1 for the upper row, -1 for the
/// lower.
void addRow(ModelMesh& mesh, const Arch& arch, double edge_y, double down, std::span<const ToothForm> forms,
            int teeth_part, int gum_part) {
  for (const double side : {-1.0, 1.0}) {
    double walked = 0.05;
    for (const ToothForm& form : forms) {
      const double turn = arch.turnAt(side * (walked + 0.5 * form.width));
      const Vector3d right = arch.tangent(turn), out = Vector3d(-right.z(), 0, right.x()).normalized();
      Vector3d neck = arch.point(turn);
      neck.y() = edge_y + down * form.height;
      // The crown's front lies on the arch.
      neck -= 0.5 * form.thickness * out;
      addTooth(mesh, neck, right, out, down, form, teeth_part);
      walked += form.width + kGapMm;
    }
  }
  // The gum: a tube along the arch, its edge scalloped around the necks.
  constexpr int kAlong = 70;
  constexpr int kAround = 10;
  double length = 0;
  for (const ToothForm& form : forms) length += form.width + kGapMm;
  std::vector<std::uint32_t> last;
  for (int i = 0; i <= kAlong; ++i) {
    const double at = length * (2.0 * i / kAlong - 1.0);
    const double turn = arch.turnAt(at);
    const Vector3d right = arch.tangent(turn), out = Vector3d(-right.z(), 0, right.x()).normalized();
    // Which tooth stands here, and where within it: the gum reaches furthest between two.
    double walked = 0;
    ToothForm here = forms.back();
    double within = 0;
    for (const ToothForm& form : forms) {
      if (std::abs(at) <= walked + form.width + kGapMm) {
        here = form;
        within = 2 * (std::abs(at) - walked) / (form.width + kGapMm) - 1;
        break;
      }
      walked += form.width + kGapMm;
    }
    const double scallop = 1.7 * std::pow(std::abs(within), 2.2) - 0.4;
    const double edge = edge_y + down * (here.height - scallop);
    std::vector<std::uint32_t> ring;
    for (int k = 0; k < kAround; ++k) {
      const double around = 2 * std::numbers::pi * k / kAround;  // 0: biting side, pi/2: front
      const double rise = 0.5 * (1 - std::cos(around));
      const double front = std::sin(around);
      const double swell = 0.55 * here.thickness + 0.45 + 0.8 * rise;
      const Vector3d point =
          arch.point(turn) + (-0.5 * here.thickness + front * swell * (front > 0 ? 1.0 : 1.15)) * out;
      ring.push_back(mesh.addVertex({point.x(), edge + down * (9.0 * rise - 0.2), point.z()}));
    }
    if (!last.empty()) mesh.addBand(last, ring, gum_part, down > 0);
    last = ring;
  }
}

/// Root to tip along z: a flattened tube with a groove, round at the tip.
void addTongue(ModelMesh& mesh, double tip_z, double top_y) {
  constexpr int kAlong = 16;
  constexpr int kAround = 20;
  constexpr double kLengthMm = 58;
  std::vector<std::uint32_t> last;
  for (int i = 0; i < kAlong; ++i) {
    const double way = asReal(i) / (kAlong - 1);                          // 0 root, 1 tip
    const double taper = std::sqrt(std::max(0.0, 1 - std::pow(way, 5)));  // blunt
    const double half_width = (20.5 - 4.5 * way) * std::max(taper, 0.05);
    const double half_height = (9.0 - 4.8 * way) * std::max(taper, 0.06);
    const double middle_y = top_y - half_height - 5.0 * way * way + 2.0 * std::sin(std::numbers::pi * (1 - way)) - 2.0;
    std::vector<std::uint32_t> ring;
    for (int k = 0; k < kAround; ++k) {
      const double turn = 2 * std::numbers::pi * k / kAround;
      const double across = std::cos(turn);
      const double groove = std::sin(turn) > 0 ? -1.6 * std::exp(-across * across / 0.06) * taper : 0;
      ring.push_back(mesh.addVertex(
          {half_width * across, middle_y + half_height * std::sin(turn) + groove, tip_z - kLengthMm * (1 - way)}));
    }
    if (!last.empty()) mesh.addBand(last, ring, kPartTongue);
    last = ring;
  }
  const std::uint32_t tip = mesh.addVertex({0, mesh.point(last[0]).y(), tip_z + 0.4});
  mesh.addFan(last, tip, kPartTongue);
}

}  // namespace

ModelMesh makeMouthParts(const OpenedFace& face) {
  const Vector3d seam = face.mesh.point(13);
  ModelMesh mesh;
  // At rest the upper incisors' edges lie a little under the line where the lips meet, the lower ones a little apart.
  const Arch upper{27.0, 45.0, seam.z() - 5.4 - 45.0};
  const Arch lower{25.0, 42.5, seam.z() - 7.8 - 42.5};
  addRow(mesh, upper, seam.y() - 2.4, 1, kUpperForms, kPartUpperTeeth, kPartUpperGums);
  addRow(mesh, lower, seam.y() - 3.6, -1, kLowerForms, kPartLowerTeeth, kPartLowerGums);
  addTongue(mesh, seam.z() - 16.5, seam.y() - 3.6);
  return mesh;
}

ModelMesh makeEyeBall(const EyeBall& eye) {
  constexpr int kAround = 32;
  // Angles from the front in degrees, close together where the iris and the pupil end.
  constexpr std::array kRings{4.0,  7.6,  8.6,  12.0, 16.0, 20.0, 22.6,  24.2, 25.6,
                              29.0, 36.0, 46.0, 58.0, 72.0, 90.0, 112.0, 140.0};
  ModelMesh mesh;
  const std::uint32_t front = mesh.addVertex(eye.centre + Vector3d(0, 0, eye.radius + 0.5));
  std::vector<std::uint32_t> last;
  for (const double degrees : kRings) {
    const double angle = degrees * std::numbers::pi / 180;
    // The cornea bulges over the iris.
    const double bulge = degrees < 26 ? 0.5 * (1 - degrees * degrees / (26.0 * 26.0)) : 0;
    std::vector<std::uint32_t> ring;
    for (int k = 0; k < kAround; ++k) {
      const double turn = 2 * std::numbers::pi * k / kAround;
      const Vector3d ray(std::sin(angle) * std::cos(turn), std::sin(angle) * std::sin(turn), std::cos(angle));
      ring.push_back(mesh.addVertex(eye.centre + (eye.radius + bulge) * ray));
      mesh.vertices(ring.back(), kMouthDepth) = degrees / 180;
    }
    if (!last.empty()) mesh.addBand(last, ring, kPartEyes, true);
    for (std::size_t a = 0; a < ring.size() && last.empty(); ++a)
      mesh.addTriangle(front, ring[a], ring[(a + 1) % ring.size()], kPartEyes);
    last = ring;
  }
  return mesh;
}

namespace {

/// A smooth curve through points (Catmull-Rom), way in [0, 1].
Vector3d curvePoint(std::span<const Vector3d> points, double way) {
  const double at = std::clamp(way, 0.0, 1.0) * asReal(points.size() - 1);
  const auto i = std::min(unsignedIndex(wholePart(at)), points.size() - 2);
  const double t = at - asReal(i);
  const Vector3d& b = points[i];
  const Vector3d& c = points[i + 1];
  const Vector3d a = i > 0 ? points[i - 1] : Vector3d(2 * b - c);
  const Vector3d d = i + 2 < points.size() ? points[i + 2] : Vector3d(2 * c - b);
  return 0.5 * (2 * b + t * (c - a) + t * t * (2 * a - 5 * b + 4 * c - d) + t * t * t * (3 * b - a - 3 * c + d));
}

void addLash(ModelMesh& mesh, const Vector3d& root, const Vector3d& along, const Vector3d& out, double length) {
  constexpr double kHalfWidthMm = 0.22;
  // A blade of three triangles that bends up.
  const Vector3d middle = root + length * (0.55 * out + Vector3d(0, 0.10, 0));
  const Vector3d tip = root + length * (0.85 * out + Vector3d(0, 0.52, 0));
  const auto a = mesh.addVertex(root - kHalfWidthMm * along);
  const auto b = mesh.addVertex(root + kHalfWidthMm * along);
  const auto c = mesh.addVertex(middle - 0.7 * kHalfWidthMm * along);
  const auto d = mesh.addVertex(middle + 0.7 * kHalfWidthMm * along);
  const auto e = mesh.addVertex(tip);
  mesh.addQuad(a, b, c, d, kPartLashes);
  mesh.addTriangle(c, d, e, kPartLashes);
}

}  // namespace

ModelMesh makeLashes(const OpenedFace& face) {
  constexpr int kLashes = 30;
  ModelMesh mesh;
  for (std::size_t side = 0; side < 2; ++side) {
    const auto& loop = side == 0 ? kEyeRight : kEyeLeft;
    std::vector<Vector3d> edge;  // outer corner, upper lid, inner corner
    for (std::size_t k = 0; k <= 8; ++k) edge.push_back(face.mesh.point(loop[k]));
    for (int i = 0; i < kLashes; ++i) {
      const double way = 0.06 + 0.80 * i / (kLashes - 1);
      const Vector3d root = curvePoint(edge, way);
      const Vector3d along = (curvePoint(edge, way + 0.02) - curvePoint(edge, way - 0.02)).normalized();
      Vector3d out = root - face.eyes[side].centre;
      // Fan outward: lashes near the temple point to it.
      out.normalize();
      out += Vector3d((side == 0 ? -1.0 : 1.0) * 0.55 * (0.55 - way), 0, 0);
      const double length = 6.4 * std::sin(std::numbers::pi * (0.16 + 0.62 * (1 - way))) * (i % 3 == 1 ? 0.82 : 1.0);
      addLash(mesh, root, along, out.normalized(), length);
    }
  }
  return mesh;
}

}  // namespace mouthpiece
