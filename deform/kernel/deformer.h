#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "deform/mesh/triangles.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"
#include "deform/surface/face_motion.h"
#include "motion/tongue_pose.h"

namespace mouthpiece {

class HeadTopology;
struct FaceMesh;

struct DeformerOptions {
  bool portable_loops = false;  ///< the loops that any processor runs, even where it has faster ones; for comparison
  bool guard_lips = true;       ///< LipGuard; without it for comparison
  std::span<const std::uint32_t> guard = {};  ///< guardWords() of the same face; empty: its guard is found anew
  const HeadTopology* topology = nullptr;  ///< of the mesh, opened as `control` tells; null: found where it is needed
};

/// Moves a face's mesh with the markers (EDGE 6, BIDs). Immutable; any number of threads may call deform() at once, and
/// the result does not depend on how many do.
class FaceDeformer {
 public:
  /// `binding` is bindFace()'s for the same mesh and control mesh. Throws InputError when it does not fit them.
  FaceDeformer(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding,
               const DeformerOptions& options = {});
  FaceDeformer(FaceDeformer&&) noexcept;
  FaceDeformer& operator=(FaceDeformer&&) noexcept;
  ~FaceDeformer();

  /// `out`: vertices x 3, resized when needed; otherwise nothing is allocated once a thread has posed this face. The
  /// rest markers give the rest mesh back.
  void deform(const FacePose& pose, const TonguePose& tongue, VertexPositions& out) const;

  /// LipGuard::words(), or none.
  [[nodiscard]] std::vector<std::uint32_t> guardWords() const;

  /// The vertices that some markers or tongue can move, rising: a head is mostly hair and back.
  [[nodiscard]] const std::vector<std::uint32_t>& movingVertices() const;
  /// The same as deform() for the moving vertices alone: x y z of each side by side, in their order.
  void deformMoving(const FacePose& pose, const TonguePose& tongue, std::span<float> out) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace mouthpiece
