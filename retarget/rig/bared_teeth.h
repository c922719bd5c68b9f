#pragma once

#include <cstdint>
#include <vector>

#include "deform/mesh/face_mesh.h"

namespace mouthpiece {

/// Teeth of one jaw that stand out of its lip's skin, which faces forward as they do: no normals tell these apart.
/// Lengths in the mesh's unit.
class BaredTeeth {
 public:
  BaredTeeth() = default;
  /// `lip`: the lip's skin outside of the mouth; `teeth`: what lies behind it, as the head rests. What is further than
  /// `deepest` before the lip is elsewhere.
  BaredTeeth(const VertexPositions& rest, std::vector<Triangle> lip, const std::vector<Triangle>& teeth,
             double deepest);

  /// How far the tooth that stands out most does, square to the skin, more than it does at rest; 0: none does.
  [[nodiscard]] double measure(const VertexPositions& vertices) const;

 private:
  [[nodiscard]] std::vector<double> standOut(const VertexPositions& vertices) const;

  std::vector<Triangle> lip_;
  std::vector<std::uint32_t> teeth_;
  double deepest_ = 0;
  std::vector<double> at_rest_;  ///< of each of teeth_
};

}  // namespace mouthpiece
