#include "retarget/sample_head/head_model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

constexpr double kMillimetresPerCentimetre = 10;

/// Columns of the lips across, right to left, as vertex numbers from the red's edge to the line where the lips meet.
struct LipColumn {
  std::uint32_t border, second, third, inner;
};
constexpr std::array kUpperColumns{
    LipColumn{185, 184, 183, 191}, LipColumn{40, 74, 42, 80},     LipColumn{39, 73, 41, 81},
    LipColumn{37, 72, 38, 82},     LipColumn{0, 11, 12, 13},      LipColumn{267, 302, 268, 312},
    LipColumn{269, 303, 271, 311}, LipColumn{270, 304, 272, 310}, LipColumn{409, 408, 407, 415}};
constexpr std::array kLowerColumns{
    LipColumn{146, 77, 96, 95},    LipColumn{91, 90, 89, 88},     LipColumn{181, 180, 179, 178},
    LipColumn{84, 85, 86, 87},     LipColumn{17, 16, 15, 14},     LipColumn{314, 315, 316, 317},
    LipColumn{405, 404, 403, 402}, LipColumn{321, 320, 319, 318}, LipColumn{375, 307, 325, 324}};
/// The corners' own column: 61 76 62 78 and 291 306 292 308.
constexpr std::array kCornerColumns{LipColumn{61, 76, 62, 78}, LipColumn{291, 306, 292, 308}};

/// Quadrilaterals left and right of the middle are cut so that one half mirrors the other.
ModelMesh::Cut cutFor(bool first) { return first ? ModelMesh::Cut::kFromFirst : ModelMesh::Cut::kFromSecond; }

void eraseTrianglesWithin(ModelMesh& mesh, const std::set<std::uint32_t>& ring) {
  std::vector<std::array<std::uint32_t, 3>> kept;
  for (const auto& triangle : mesh.triangles) {
    const bool inside =
        std::all_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return ring.contains(v); });
    if (!inside) kept.push_back(triangle);
  }
  mesh.triangles = std::move(kept);
  mesh.part_of_triangle.assign(mesh.triangles.size(), kPartSkin);
}

std::vector<std::uint32_t> mouthLoop() {
  std::vector<std::uint32_t> loop{kInnerCornerRight};
  loop.insert(loop.end(), kInnerLowerLip.begin(), kInnerLowerLip.end());
  loop.push_back(kInnerCornerLeft);
  loop.insert(loop.end(), kInnerUpperLip.rbegin(), kInnerUpperLip.rend());
  return loop;
}

/// Upper and lower lip meet half way; what lies in front of them follows less and less, and bulges.
void closeLips(ModelMesh& mesh) {
  constexpr double kSeamBackMm = 2.4;   // the line lies in a groove
  constexpr double kThirdShare = 0.80;  // of the closing that the third row follows
  constexpr double kSecondShare = 0.32;
  constexpr double kBulgeMm = 1.0;
  constexpr double kUpperLift = 0.42;  // the line lies nearer to the upper lip's old edge
  for (std::size_t i = 0; i < kUpperColumns.size(); ++i) {
    const LipColumn& upper = kUpperColumns[i];
    const LipColumn& lower = kLowerColumns[i];
    Vector3d seam = (1 - kUpperLift) * mesh.point(upper.inner) + kUpperLift * mesh.point(lower.inner);
    // Fullest in the middle, nothing at the corners.
    const double across = (asReal(i) - 4.0) / 5.0;
    const double fullness = 1 - across * across;
    for (const LipColumn* column : {&upper, &lower}) {
      const Vector3d way = seam - mesh.point(column->inner);
      const double bulge = fullness * kBulgeMm;
      const double back = kSeamBackMm * (0.35 + 0.65 * fullness);
      mesh.setPoint(column->third, mesh.point(column->third) + kThirdShare * way + Vector3d(0, 0, 1.7 * bulge));
      mesh.setPoint(column->second, mesh.point(column->second) + kSecondShare * way + Vector3d(0, 0, 1.0 * bulge));
      mesh.setPoint(column->inner, seam - Vector3d(0, 0, back));
      mesh.vertices(column->inner, kMouthDepth) = 0.14;  // the shadow where lips touch
    }
  }
}

/// The upper lip's bow: its middle dips between two peaks.
void drawBow(ModelMesh& mesh) {
  for (const auto& [vertex, lift] :
       {std::pair<std::uint32_t, double>{0, -0.5}, {37, 0.8}, {267, 0.8}, {39, 0.4}, {269, 0.4}}) {
    mesh.setPoint(vertex, mesh.point(vertex) + Vector3d(0, lift, 0));
  }
  mesh.setPoint(164, mesh.point(164) - Vector3d(0, 0, 0.7));  // the groove above it
}

void markVermilion(ModelMesh& mesh) {
  const auto mark = [&](const LipColumn& column) {
    mesh.vertices(column.border, kVermilion) = 0.5;
    for (const std::uint32_t vertex : {column.second, column.third, column.inner})
      mesh.vertices(vertex, kVermilion) = 1;
  };
  std::for_each(kUpperColumns.begin(), kUpperColumns.end(), mark);
  std::for_each(kLowerColumns.begin(), kLowerColumns.end(), mark);
  std::for_each(kCornerColumns.begin(), kCornerColumns.end(), mark);
}

/// A ring of the mouth bag behind the lips, in millimetres: how far back of the line where the lips meet; height over
/// that line of the upper and the lower half's middle; half width (0: that of the line itself); how much of the line's
/// curvature in depth it keeps; channel values.
struct BagRing {
  double back, upper, lower, half_width, curvature, depth, vermilion;
};
/// The first ring tucks the lower lip behind the upper one: where lips touch no light comes through.
constexpr std::array kBagRings{
    BagRing{2.0, 1.7, 0.7, 21.9, 1.0, 0.25, 1.0}, BagRing{3.8, 3.6, -1.2, 22.6, 1.0, 0.5, 0.6},
    BagRing{4.4, 8.0, -7.5, 25, 0.95, 0.8, 0},    BagRing{6.0, 13.0, -13.0, 29, 0.85, 0.95, 0},
    BagRing{14, 17.0, -17.5, 33, 0.7, 1, 0},      BagRing{31, 16.0, -17.0, 34, 0.4, 1, 0},
    BagRing{50, 12.0, -13.0, 28, 0.1, 1, 0},      BagRing{62, 6.0, -6.5, 15, 0.0, 1, 0}};

/// Rolls the lips inward and on into a closed bag: `loop` runs right corner, lower lip, left corner, upper lip.
void addMouthBag(ModelMesh& mesh) {
  const std::vector<std::uint32_t> loop = mouthLoop();
  const std::size_t n = loop.size();
  const Vector3d middle = mesh.point(13);
  const double half_width = 0.5 * (mesh.point(kInnerCornerLeft) - mesh.point(kInnerCornerRight)).norm();
  std::vector<std::uint32_t> outer = loop;
  for (std::size_t k = 0; k < n; ++k) mesh.creases.insert(ModelMesh::edge(loop[k], loop[(k + 1) % n]));
  for (const BagRing& shape : kBagRings) {
    std::vector<std::uint32_t> inner;
    for (std::size_t k = 0; k < n; ++k) {
      const Vector3d seam = mesh.point(loop[k]);
      const bool is_corner = k == 0 || k == n / 2;
      const double across = std::clamp((seam.x() - middle.x()) / half_width, -1.0, 1.0);
      const double arch = std::sqrt(std::sqrt(std::max(0.0, 1 - across * across)));
      const double height =
          is_corner ? 0.25 * (shape.upper + shape.lower) : arch * (k < n / 2 ? shape.lower : shape.upper);
      const double z = middle.z() - shape.back + shape.curvature * (seam.z() - middle.z());
      const Vector3d point(middle.x() + across * shape.half_width, seam.y() + height, z);
      inner.push_back(mesh.addVertex(point));
      mesh.vertices(inner.back(), kMouthDepth) = shape.depth;
      mesh.vertices(inner.back(), kVermilion) = shape.vermilion;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      const bool is_left = mesh.point(loop[k]).x() + mesh.point(loop[next]).x() > 0;
      mesh.addQuad(outer[k], outer[next], inner[k], inner[next], kPartMouth, cutFor(is_left != (k < n / 2)));
    }
    outer = inner;
  }
  const std::uint32_t back = mesh.addVertex(middle + Vector3d(0, 0, -70));
  mesh.vertices(back, kMouthDepth) = 1;
  for (std::size_t k = 0; k < n; ++k) mesh.addTriangle(outer[k], outer[(k + 1) % n], back, kPartMouth);
}

/// Opens the lids a little and sets the ball behind them.
EyeBall openEye(ModelMesh& mesh, std::span<const std::uint32_t, 16> loop, std::span<const std::uint32_t> upper_fold) {
  constexpr double kUpperLiftMm = 1.7;
  constexpr double kLowerDropMm = 0.7;
  constexpr double kRadiusMm = 14.0;
  constexpr double kLidThicknessMm = 1.3;
  const double middle = 0.5 * (mesh.point(loop[0]).x() + mesh.point(loop[8]).x());
  const double half = std::abs(mesh.point(loop[0]).x() - middle);
  for (std::size_t k = 1; k < 16; ++k) {
    if (k == 8) continue;
    Vector3d point = mesh.point(loop[k]);
    const double across = std::min(1.0, std::abs(point.x() - middle) / half);
    point.y() += (1 - across * across) * (k < 8 ? kUpperLiftMm : -kLowerDropMm);
    mesh.setPoint(loop[k], point);
  }
  for (const std::uint32_t vertex : upper_fold) mesh.setPoint(vertex, mesh.point(vertex) + Vector3d(0, 0.9, 0.3));
  // The lids' middles touch the ball, a lid's thickness in front of it.
  const Vector3d upper = mesh.point(loop[4]);
  const Vector3d lower = mesh.point(loop[12]);
  const Vector3d centre(middle, 0.5 * (upper.y() + lower.y()), 0);
  const double half_gap = 0.5 * (upper.y() - lower.y());
  const double front = 0.5 * (upper.z() + lower.z());
  const double reach = kRadiusMm + kLidThicknessMm;
  return {Vector3d(centre.x(), centre.y(), front - std::sqrt(reach * reach - half_gap * half_gap)), kRadiusMm};
}

/// The lids' edge: from the skin's last row straight to the ball, then behind the lid along the ball.
void addLidEdge(ModelMesh& mesh, std::span<const std::uint32_t, 16> loop, const EyeBall& eye, bool is_left) {
  constexpr double kTuckMm = 3.0;
  Vector3d opening = Vector3d::Zero();
  for (const std::uint32_t vertex : loop) opening += mesh.point(vertex) / 16.0;
  std::array<std::vector<std::uint32_t>, 2> rows;
  for (const std::uint32_t vertex : loop) {
    const Vector3d point = mesh.point(vertex);
    const Vector3d ray = (point - eye.centre).normalized();
    const Vector3d on_ball = eye.centre + (eye.radius + 0.15) * ray;
    Vector3d away = point - opening;
    away -= away.dot(ray) * ray;
    const Vector3d tucked =
        (on_ball + kTuckMm * away.normalized() - eye.centre).normalized() * (eye.radius - 0.6) + eye.centre;
    rows[0].push_back(mesh.addVertex(on_ball));
    rows[1].push_back(mesh.addVertex(tucked));
    mesh.vertices(vertex, kFlush) = 0.3;
    for (auto& row : rows) mesh.vertices(row.back(), kFlush) = 1;
  }
  std::vector<std::uint32_t> outer(loop.begin(), loop.end());
  for (const auto& inner : rows) {
    for (std::size_t k = 0; k < 16; ++k) {
      const std::size_t next = (k + 1) % 16;
      if (is_left)
        mesh.addQuad(outer[k], outer[next], inner[k], inner[next], kPartSkin, ModelMesh::Cut::kFromSecond);
      else
        mesh.addQuad(outer[next], outer[k], inner[next], inner[k], kPartSkin);
    }
    outer = inner;
  }
}

bool looksCanonical(const FaceMesh& mesh) {
  if (mesh.vertices.rows() != signedIndex(kCanonicalVertexCount) || mesh.triangles.size() != 898) return false;
  // Nose tip and mouth corners where they belong, in centimetres.
  return (mesh.vertices.row(4) - Eigen::RowVector3f(0, -0.463170F, 7.586580F)).norm() < 1e-3F &&
         mesh.vertices(291, 0) > 2 && mesh.vertices(61, 0) < -2;
}

}  // namespace

OpenedFace openCanonicalFace(const FaceMesh& canonical, std::string_view file) {
  if (!looksCanonical(canonical)) {
    throw InputError(
        file, "",
        fmt::format("found a mesh of {} vertices and {} triangles; expected the canonical face of 468 and 898 "
                    "(`make data` brings it)",
                    canonical.vertices.rows(), canonical.triangles.size()));
  }
  OpenedFace face;
  ModelMesh& mesh = face.mesh;
  mesh.vertices.setZero(canonical.vertices.rows(), kChannelCount);
  mesh.vertices.leftCols<3>() = kMillimetresPerCentimetre * canonical.vertices.cast<double>();
  mesh.triangles = canonical.triangles;
  const std::vector<std::uint32_t> mouth = mouthLoop();
  eraseTrianglesWithin(mesh, {mouth.begin(), mouth.end()});
  eraseTrianglesWithin(mesh, {kEyeRight.begin(), kEyeRight.end()});
  eraseTrianglesWithin(mesh, {kEyeLeft.begin(), kEyeLeft.end()});
  closeLips(mesh);
  drawBow(mesh);
  markVermilion(mesh);
  constexpr std::array<std::uint32_t, 5> kFoldRight{30, 29, 27, 28, 56};
  constexpr std::array<std::uint32_t, 5> kFoldLeft{260, 259, 257, 258, 286};
  face.eyes = {openEye(mesh, kEyeRight, kFoldRight), openEye(mesh, kEyeLeft, kFoldLeft)};
  addMouthBag(mesh);
  addLidEdge(mesh, kEyeRight, face.eyes[0], false);
  addLidEdge(mesh, kEyeLeft, face.eyes[1], true);
  return face;
}

}  // namespace mouthpiece
