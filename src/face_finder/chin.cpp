#include "face_finder/chin.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace mouthpiece {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector2f;
using Eigen::Vector3f;

/// How far the skin on a profile lies from a seen chin at most, of the eyes' distance: past it begins the neck.
constexpr float kChinReach = 0.35F;
/// The way down and half as much forward, from straight forward, radians; directions to both sides of it are looked
/// into, so that on a coarse mesh the chin lies between vertices.
constexpr float kUnderChin = 1.1071F, kAroundIt = 0.26F;
constexpr int kDirections = 11;

/// Where the upright plane of the face through `through` cuts the skin near it: forward and up from there.
std::vector<Vector2f> profileNear(const FaceSkin& skin, const FaceFrame& face, const Vector3f& through, float reach) {
  std::vector<Vector2f> profile;
  for (const Triangle& triangle : skin.triangles()) {
    Matrix3f at;  // a column a corner: left, up, forward
    for (std::size_t k = 0; k < 3; ++k)
      at.col(signedIndex(k)) = face.face_from_mesh * (skin.vertex(triangle[k]) - through);
    for (Eigen::Index k = 0; k < 3; ++k) {
      const Vector3f a = at.col(k), b = at.col((k + 1) % 3);
      if ((a.x() < 0) == (b.x() < 0)) continue;
      const Vector3f cut = a + a.x() / (a.x() - b.x()) * (b - a);
      if (cut.norm() < reach) profile.emplace_back(cut.z(), cut.y());
    }
  }
  return profile;
}

}  // namespace

Vector3f chinOnProfile(const FaceSkin& skin, const FaceFrame& face, const Vector3f& seen) {
  const std::vector<Vector2f> profile = profileNear(skin, face, seen, kChinReach * face.eye_corners);
  if (profile.empty()) return seen;
  Vector2f sum = Vector2f::Zero();
  for (int i = 0; i < kDirections; ++i) {
    const float angle = kUnderChin + kAroundIt * (2 * static_cast<float>(i) / (kDirections - 1) - 1);
    const Vector2f way(std::cos(angle), -std::sin(angle));
    sum += *std::max_element(profile.begin(), profile.end(),
                             [&](const Vector2f& a, const Vector2f& b) { return way.dot(a) < way.dot(b); });
  }
  const Vector2f chin = sum / kDirections;
  return skin.nearest(seen + face.face_from_mesh.transpose() * Vector3f(0, chin.y(), chin.x()));
}

}  // namespace mouthpiece
