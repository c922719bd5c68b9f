#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "deform/mesh/triangle_tree.h"
#include "deform/mesh/triangles.h"

namespace mouthpiece {

struct FaceMesh;

/// A head's skin, on which places are laid. `mesh` must outlive it and have skin.
class FaceSkin {
 public:
  explicit FaceSkin(const FaceMesh& mesh);

  [[nodiscard]] const std::vector<Triangle>& triangles() const { return triangles_; }
  /// The point of the skin that is nearest.
  [[nodiscard]] Eigen::Vector3f nearest(const Eigen::Vector3f& place) const;
  [[nodiscard]] Eigen::Vector3f vertex(std::uint32_t v) const;

 private:
  const FaceMesh& mesh_;
  std::vector<Triangle> triangles_;
  TriangleTree tree_;
};

/// A plane that a face is alike on both sides of.
struct MirrorPlane {
  Eigen::Vector3f normal;
  float offset;

  [[nodiscard]] Eigen::Vector3f operator()(const Eigen::Vector3f& place) const {
    return place - 2 * (normal.dot(place) - offset) * normal;
  }
};

/// Where a face is and how it stands, in the mesh's own axes.
struct FaceFrame {
  Eigen::Matrix3f face_from_mesh;  ///< rows: the face's left, up and forward
  Eigen::Vector3f middle;          ///< between eyes and mouth
  float eye_corners;               ///< distance of the outer eye corners, the mesh's unit
};

/// By turns: places of the skin are mirrored and pulled onto it, and the plane is fitted between the places and those.
/// nullopt for a face that is not alike on both sides.
std::optional<MirrorPlane> mirrorPlane(const FaceSkin& skin, const FaceFrame& face);

/// How far places of the skin within `reach` of `middle` lie from the skin once they are mirrored, in the mean.
float unevenness(const FaceSkin& skin, const MirrorPlane& plane, const Eigen::Vector3f& middle, float reach);

}  // namespace mouthpiece
