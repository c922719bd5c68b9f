#include "retarget/placing/even_head.h"

#include <algorithm>
#include <array>
#include <limits>

#include "deform/mesh/face_mesh.h"
#include "deform/topology/mirror_plane.h"

namespace mouthpiece {
namespace {

using Eigen::Vector3d;

/// What the mouth's skin may be off its mirror image in the mean, and how far around the mouth that is looked at:
/// shares of the distance of the eyes' outer corners. A face may be even as a whole while its mouth is crooked.
constexpr float kAlikeMouth = 0.005F, kAroundMouth = 0.4F;

}  // namespace

std::string otherSideOf(const std::string& name) {
  if (name.ends_with("_R")) return name.substr(0, name.size() - 1) + "L";
  if (name.ends_with("_L")) return name.substr(0, name.size() - 1) + "R";
  return name;
}

std::optional<EvenHead> EvenHead::of(const FaceMesh& mesh, const Places& places) {
  const Vector3d eyes = 0.5 * (places.eye_right + places.eye_left);
  FaceFrame frame{Eigen::Matrix3f::Identity(), (0.5 * (eyes + places.mouth)).cast<float>(),
                  static_cast<float>((places.eye_left - places.eye_right).norm())};
  const FaceSkin skin(mesh);
  if (skin.triangles().empty()) return std::nullopt;
  const auto plane = mirrorPlane(skin, frame);
  if (!plane) return std::nullopt;
  frame.middle = places.mouth.cast<float>();
  if (unevenness(skin, *plane, frame.middle, kAroundMouth * frame.eye_corners) > kAlikeMouth * frame.eye_corners)
    return std::nullopt;
  return EvenHead(plane->normal.cast<double>().normalized(), double{plane->offset});
}

EvenHead::Profile EvenHead::profileOf(const FaceMesh& mesh, const std::vector<Triangle>& triangles) const {
  Profile profile;
  for (const Triangle& t : triangles) {
    std::array<Vector3d, 3> at;
    std::array<double, 3> side;
    for (std::size_t k = 0; k < 3; ++k) {
      at[k] = pointAt(mesh.vertices, t[k]);
      side[k] = normal_.dot(at[k]) - offset_;
    }
    std::vector<Vector3d> cuts;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3;
      if ((side[k] < 0) != (side[next] < 0))
        cuts.push_back(at[k] + side[k] / (side[k] - side[next]) * (at[next] - at[k]));
    }
    if (cuts.size() == 2) profile.emplace_back(cuts[0], cuts[1]);
  }
  return profile;
}

std::optional<Vector3d> closestOn(const EvenHead::Profile& profile, const Vector3d& place) {
  std::optional<Vector3d> best;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [from, to] : profile) {
    const Vector3d along = to - from;
    const double share = along.squaredNorm() > 0 ? (place - from).dot(along) / along.squaredNorm() : 0;
    const Vector3d foot = from + std::clamp(share, 0.0, 1.0) * along;
    if ((foot - place).norm() >= nearest) continue;
    nearest = (foot - place).norm();
    best = foot;
  }
  return best;
}

}  // namespace mouthpiece
