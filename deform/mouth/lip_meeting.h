#pragma once

#include <array>
#include <memory>

#include "deform/mesh/triangles.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"

namespace mouthpiece {

class HeadTopology;
struct FaceMesh;

/// Lets the lips of a posed mesh meet by their surfaces as they are, whatever their make: in upright sections across
/// the mouth the upper lip's lower edge and the lower lip's upper edge are looked at; where they cross they are moved
/// apart, where they are further apart than their rims they are brought together, by the least upright movement that
/// spreads along the skin. Continuous in the pose.
class LipMeeting {
 public:
  static constexpr std::size_t kSections = 32;  ///< across the whole mouth

  /// `closed`: the mesh's vertices with the lips brought together. `binding`: of `mesh`, at rest. `topology`: of
  /// `mesh` opened at `control`'s openings, where it is known; null: it is found. Throws InputError where `control` has
  /// no corners of a mouth.
  LipMeeting(const FaceMesh& mesh, const VertexPositions& closed, const ControlMesh& control,
             const FaceBinding& binding, const HeadTopology* topology = nullptr);
  LipMeeting(LipMeeting&&) noexcept;
  LipMeeting& operator=(LipMeeting&&) noexcept;
  ~LipMeeting();

  /// What is wanted in each column across the mouth.
  struct Wanted {
    std::array<float, kLipColumns> may_shut;  ///< how much of what lips are too far apart is closed at most, [0, 1]
    std::array<float, kLipColumns> apart;     ///< how far apart they shall be, as their rims are; the mesh's unit
  };
  /// `near`: how much of what crosses is moved apart, [0, 1]. `out`: x y z of each vertex of the posed mesh. Allocates
  /// nothing once a thread has posed this face.
  void meet(const Wanted& wanted, double near, float* out) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

}  // namespace mouthpiece
