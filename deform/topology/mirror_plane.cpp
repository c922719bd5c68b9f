#include "deform/topology/mirror_plane.h"

#include <Eigen/Eigenvalues>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

/// Vertices of the skin within `reach` of `middle`, evenly drawn from all.
std::vector<Vector3f> placesAround(const FaceSkin& skin, const Vector3f& middle, float reach) {
  constexpr std::size_t kMostPlaces = 400;
  std::vector<Vector3f> near, places;
  for (const Triangle& triangle : skin.triangles()) {
    const Vector3f place = skin.vertex(triangle[0]);
    if ((place - middle).norm() < reach) near.push_back(place);
  }
  const std::size_t step = near.size() / kMostPlaces + 1;
  for (std::size_t i = 0; i < near.size(); i += step) places.push_back(near[i]);
  return places;
}

}  // namespace

FaceSkin::FaceSkin(const FaceMesh& mesh)
    : mesh_(mesh),
      triangles_(trianglesOf(mesh, {PartKind::kSkin, PartKind::kLips})),
      tree_(mesh.vertices, triangles_) {}

Vector3f FaceSkin::nearest(const Vector3f& place) const {
  const auto foot = tree_.closest(place.cast<double>());
  return foot ? Vector3f(foot->point.cast<float>()) : place;
}

Vector3f FaceSkin::vertex(std::uint32_t v) const { return mesh_.vertices.row(signedIndex(std::size_t{v})).transpose(); }

std::optional<MirrorPlane> mirrorPlane(const FaceSkin& skin, const FaceFrame& face) {
  constexpr float kFar = 0.9F, kAlike = 0.005F;  // of the eyes' distance
  constexpr int kRounds = 12;
  const std::vector<Vector3f> places = placesAround(skin, face.middle, kFar * face.eye_corners);
  if (places.empty()) return std::nullopt;
  MirrorPlane plane{face.face_from_mesh.row(0), 0};
  plane.offset = plane.normal.dot(face.middle);
  float off = 0;
  for (int round = 0; round < kRounds; ++round) {
    Matrix3f spread = Matrix3f::Zero();
    Vector3f halfway = Vector3f::Zero();
    off = 0;
    for (const Vector3f& place : places) {
      const Vector3f other = skin.nearest(plane(place));
      off += (plane(place) - other).norm();
      spread += (place - other) * (place - other).transpose();
      halfway += (place + other) / 2;
    }
    const Vector3f normal = Eigen::SelfAdjointEigenSolver<Matrix3f>(spread).eigenvectors().col(2);
    plane.normal = normal.dot(plane.normal) < 0 ? Vector3f(-normal) : normal;
    plane.offset = plane.normal.dot(halfway) / static_cast<float>(places.size());
  }
  if (off / static_cast<float>(places.size()) > kAlike * face.eye_corners) return std::nullopt;
  return plane;
}

float unevenness(const FaceSkin& skin, const MirrorPlane& plane, const Vector3f& middle, float reach) {
  const std::vector<Vector3f> places = placesAround(skin, middle, reach);
  float off = 0;
  for (const Vector3f& place : places) off += (plane(place) - skin.nearest(plane(place))).norm();
  return places.empty() ? 0 : off / static_cast<float>(places.size());
}

}  // namespace mouthpiece
