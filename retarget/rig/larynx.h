#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Where the larynx shows at the front of a neck, and how it goes up with a singer's pitch (VOCAL 3.1). No marker says
/// so: it is the "larynx" curve that moves it.
class LarynxBump {
 public:
  LarynxBump() = default;
  /// `chin`: its place on the mesh at rest (the mesh upright, Y up, face +Z); `face_width`: between the outer canthi.
  /// Empty where the mesh has no neck.
  LarynxBump(const FaceMesh& mesh, const Eigen::Vector3d& chin, double face_width);

  /// The vertices that it moves, rising.
  [[nodiscard]] const std::vector<std::uint32_t>& vertices() const { return vertices_; }
  /// What it adds to each of them, x y z side by side, the mesh's unit. `height`: 0 at rest to 1.
  void displacements(double height, std::span<float> out) const;

 private:
  std::vector<std::uint32_t> vertices_;
  std::vector<Eigen::Vector2d> places_;  ///< beside and above the larynx at rest, in radii
  double radius_ = 0;                    ///< mesh units
};

/// Of the face's width: how far it goes up, and how far it stands out where it is. 10 and 2.7 mm on a face of 90 mm.
inline constexpr double kLarynxTravel = 0.11, kLarynxBulge = 0.03;

}  // namespace mouthpiece
