#pragma once

#include <cstdint>
#include <vector>

#include "deform/binding.h"
#include "deform/control_surface.h"
#include "deform/face_mesh.h"
#include "deform/jaw.h"

namespace mouthpiece {

/// Keeps the lips of a deformed mesh out of each other and out of the teeth. Each vertex near the line where the lips
/// meet watches the place of the other lip (of its own row of teeth) that is nearest at rest, and is pushed back where
/// it gets behind the plane there; lips give way by half each, teeth not at all. Continuous in the pose.
class LipGuard {
 public:
  LipGuard(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding);

  /// `out`: x y z of each vertex of the posed mesh; `points`: the pose's leadingPoints().
  void separate(const MarkerPositions& points, const AddedMotion& jaw, float* out) const;

 private:
  struct LipWatch {
    std::uint32_t vertex;
    std::uint32_t corners[3];
    float weights[2];  ///< of the second and third at the place watched
    float allowed;     ///< signed distance at rest where it is below zero
  };
  struct ToothWatch {
    std::uint32_t vertex;
    bool with_jaw;
    float allowed;
    Eigen::Vector3f place, normal;  ///< at rest
  };
  void watchLips(const FaceMesh& mesh, const std::vector<std::uint32_t>& own, const std::vector<Triangle>& other,
                 const VertexPositions& normals);
  void watchTeeth(const FaceMesh& mesh, const std::vector<std::uint32_t>& own, const std::vector<Triangle>& teeth,
                  const VertexPositions& normals, bool with_jaw);
  [[nodiscard]] double narrowestGap(const MarkerPositions& points) const;

  std::vector<LipWatch> lips_;
  std::vector<ToothWatch> teeth_;
  std::vector<std::pair<int, int>> rims_;  ///< points that face each other
  double mouth_width_ = 0;
};

}  // namespace mouthpiece
