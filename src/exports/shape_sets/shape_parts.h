#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "deform/mesh/triangles.h"
#include "deform/mouth/jaw.h"
#include "deform/surface/binding.h"
#include "deform/surface/control_surface.h"
#include "deform/topology/head_topology.h"
#include "deform/topology/welding.h"
#include "retarget/rig/face_fit.h"

namespace mouthpiece {

struct FaceMesh;

/// The balls of a head's eyes in shapes. `moves` below: of each vertex of the mesh.
class ShapeEyes {
 public:
  /// `mesh` stands upright and must outlive it.
  explicit ShapeEyes(const FaceMesh& mesh);

  /// Turns the eye that ARKit's EyeLook... of that name turns; other shapes turn none.
  void look(std::string_view arkit, VertexPositions& moves) const;
  /// Lids slide over the balls: what a shape takes into one is brought out to its front again, as far as it lay before
  /// it.
  void slideLids(VertexPositions& moves) const;

  /// The vertices of one eye, and the middle of the ball that they lie on.
  struct Eyeball {
    std::vector<Eigen::Index> vertices;
    Eigen::RowVector3f middle = Eigen::RowVector3f::Zero();
    float radius = 0;  ///< of what lies in front, the cornea too
  };

 private:
  const FaceMesh& mesh_;
  Eyeball left_, right_;
};

/// A head's skin, which spreads what its neighbours are torn apart by. `moves` below: of each vertex of the mesh.
class ShapeSkin {
 public:
  /// `mesh` stands upright; `control` and `binding` are fitted to it.
  ShapeSkin(const FaceMesh& mesh, const ControlMesh& control, const FaceBinding& binding);

  /// Under the jaw no marker tells how skin moves, and the control surface ends in a ring that rests: a jaw that opens
  /// wide goes through it. The skin there and down the neck moves as the harmonic mean of the jaw's edge and of what
  /// rests below.
  void spreadBelowJaw(VertexPositions& moves) const;
  /// The same of the skin within `reach` mouths of the vertices of `torn`, but for the lips' rims, which are only moved
  /// where they are torn.
  void relax(const std::vector<std::uint32_t>& torn, double reach, VertexPositions& moves) const;
  /// Takes what the jaw carries, lower teeth, gums, and tongue, as far as the chin goes in `pose`: the deformer's jaw,
  /// made for speech, lags behind wide movements. `vertices`: the deformer's.
  void carryByChin(const FacePose& pose, VertexPositions& vertices) const;
  /// The outer lip markers of each of lipPairs(), the upper and the lower one.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& pairMarkers() const { return pair_markers_; }
  /// How the lips lie then, millimetres.
  struct Lips {
    std::vector<double> apart;  ///< at each of lipPairs(); below zero: in each other, more than at rest
    double in_teeth = 0;        ///< more than at rest
  };
  [[nodiscard]] Lips lipsIn(const VertexPositions& moves) const;

 private:
  [[nodiscard]] const FaceMesh& whole() const { return welding_.isNothing() ? mesh_ : welding_.mesh; }
  void apply(const SkinRelaxing& relaxing, VertexPositions& moves) const;

  const FaceMesh& mesh_;
  Welding welding_;
  HeadTopology topology_;
  ControlMesh control_;
  JawHinge jaw_;
  std::vector<float> by_jaw_;  ///< how far each vertex of the mesh goes along with the jaw
  double mouth_width_;
  LipContactMeter meter_;
  LipContact at_rest_;
  std::vector<std::pair<std::string, std::string>> pair_markers_;
  std::vector<double> pairs_at_;  ///< shares of the way across the mouth
  std::vector<bool> rims_;
  std::optional<SkinRelaxing> below_jaw_;
};

}  // namespace mouthpiece
