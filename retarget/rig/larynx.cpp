// The larynx of face_rig.h.
#include <algorithm>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_rig.h"

namespace mouthpiece {
namespace {

/// Of the face's width: how far the larynx lies under the chin, how far the skin around it moves with it, and how far
/// it lies behind the chin at least (else it is no neck).
constexpr double kBelowChin = 0.5, kRadius = 0.30, kBehindChin = 0.2;
/// Skin that looks forward by less is the neck's side or back.
constexpr float kLeastForward = 0.2F;
/// A neck has some vertices here.
constexpr std::size_t kFewestVertices = 5;

/// 1 in the middle, 0 from one radius on, smooth at both.
double bell(const Eigen::Vector2d& place) {
  const double rest = std::max(0.0, 1 - place.squaredNorm());
  return rest * rest;
}

}  // namespace

LarynxBump::LarynxBump(const FaceMesh& mesh, const Eigen::Vector3d& chin, double face_width)
    : radius_(kRadius * face_width) {
  const Eigen::Vector2d middle(chin.x(), chin.y() - kBelowChin * face_width);
  std::vector<bool> is_skin(mesh.vertexCount(), false);
  for (const Triangle& triangle : trianglesOf(mesh, {PartKind::kSkin, PartKind::kOther})) {
    for (const std::uint32_t vertex : triangle) is_skin[vertex] = true;
  }
  const VertexPositions normals = vertexNormals(mesh.vertices, mesh.triangles);
  for (std::uint32_t i = 0; i < is_skin.size(); ++i) {
    const Eigen::Vector3d at = pointAt(mesh.vertices, i);
    const Eigen::Vector2d place = (at.head<2>() - middle) / radius_;
    if (!is_skin[i] || place.squaredNorm() >= 1 || normals(i, 2) < kLeastForward) continue;
    // Not the chin's own underside, which hangs over the neck.
    if (at.z() > chin.z() - kBehindChin * face_width) continue;
    vertices_.push_back(i);
    places_.push_back(place);
  }
  if (vertices_.size() < kFewestVertices) {
    vertices_.clear();
    places_.clear();
  }
}

void LarynxBump::displacements(double height, std::span<float> out) const {
  MOUTHPIECE_EXPECT(out.size() == 3 * vertices_.size());
  const double travel = height * kLarynxTravel / kRadius;  // radii
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    const double rest = bell(places_[i]);
    const double raised = bell(places_[i] - Eigen::Vector2d(0, travel));
    out[3 * i] = 0;
    out[3 * i + 1] = asFloat(radius_ * travel * rest);
    out[3 * i + 2] = asFloat(radius_ * kLarynxBulge / kRadius * (raised - rest));
  }
}

}  // namespace mouthpiece
