#pragma once

#include <memory>
#include <vector>

#include "deform/surface/control_surface.h"
#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// How the lips of one frame lie to each other and to the teeth; the mesh's unit.
struct LipContact {
  /// Between the lips' surfaces where it is widest over the middle half of the mouth; below zero: everywhere
  /// overlapping.
  double gap = 0;
  double overlap = 0;   ///< deepest place of one lip inside the other
  double in_teeth = 0;  ///< deepest place of a lip inside teeth or gums
};

/// Measures lips on the mesh itself, whatever moved it: points less than 0.02 mouths apart on both lips, within
/// 0.12 mouths of the line where they meet, against the surfaces of the other lip and of the teeth.
class LipContactMeter {
 public:
  /// `mesh` as it rests, `control` fitted to it.
  LipContactMeter(const FaceMesh& mesh, const ControlMesh& control);
  LipContactMeter(LipContactMeter&&) noexcept;
  ~LipContactMeter();

  /// `vertices`: the same mesh moved.
  [[nodiscard]] LipContact measure(const VertexPositions& vertices) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace mouthpiece
