#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "motion/head_pose.h"

namespace mouthpiece {

/// The balls of a head's eyes, with what lies on them in front (iris, pupil, cornea): they turn about their middles.
/// What lines the lids (tear line, lashes) is none of it.
class Eyeballs {
 public:
  Eyeballs() = default;
  /// Of the parts that are eyes, what is round. Empty where nothing is: painted eyes, or none.
  explicit Eyeballs(const FaceMesh& mesh);

  /// The vertices that turn, rising.
  [[nodiscard]] const std::vector<std::uint32_t>& vertices() const { return vertices_; }
  /// Where each of them is, x y z side by side, the mesh's unit; `mesh` is the one they were found on.
  void places(const FaceMesh& mesh, const GazeTurn& gaze, std::span<float> out) const;

 private:
  std::vector<std::uint32_t> vertices_;
  std::vector<std::size_t> ball_;  ///< of each vertex
  std::vector<Eigen::Vector3f> middles_;
};

}  // namespace mouthpiece
