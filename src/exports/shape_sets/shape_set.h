#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "deform/mesh/triangles.h"
#include "exports/shapes/principal_shapes.h"
#include "retarget/rig/face_judge.h"
#include "retarget/rig/face_rig.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

enum class ShapeVocabulary { kArkit, kOculus, kVrm };

/// Shapes for a head that has none, as the deformer makes them of marker poses.
struct ShapeSet {
  std::vector<std::string> names;
  std::vector<VertexPositions> moves;  ///< of each vertex of the rig's mesh at weight 1, its unit
  std::vector<bool> closes;            ///< the lips meet in it; "mouthClose": together with "jawOpen"

  /// The vertices with a shape at 1, "mouthClose" together with "jawOpen".
  [[nodiscard]] VertexPositions posed(const FaceMesh& mesh, std::size_t shape) const;
};

/// How a shape is made.
struct ShapeManner {
  double strength = 1;   ///< how far its markers go
  std::string why = {};  ///< no further
  /// Vertices of the mesh that are torn from their neighbours, and how far around them skin is relaxed, one after the
  /// other; shares of the mouth's width.
  std::vector<std::pair<std::vector<std::uint32_t>, double>> relaxed = {};
};

/// Makes shapes for one head.
class ShapeMaker {
 public:
  /// `face` is the rig's. Visemes: of `poses`, learnt from `actor`'s capture; `actor_markers`: names of
  /// actor.neutral_mm's rows. All must outlive it.
  ShapeMaker(const FaceRig& rig, const FaceFile& face, const ActorPose& actor,
             const std::vector<std::string>& actor_markers, const VisemePoses& poses);
  ShapeMaker(ShapeMaker&&) noexcept;
  ~ShapeMaker();

  /// The 52 of ARKit, by Apple's names in lower camel case, from what these shapes do to markers on a head that has
  /// them (arkitMarkerMoves), both sides made alike; or 14 visemes of Oculus (all but "sil") or VRM's mouth and lids.
  /// Eyes turn about their own middles. `manners`: of shapes of that name.
  [[nodiscard]] ShapeSet make(ShapeVocabulary vocabulary, const std::map<std::string, ShapeManner>& manners = {}) const;

 private:
  struct Data;
  std::unique_ptr<const Data> data_;
};

/// The set as the writers of scenes take it, without frames.
PrincipalShapes shapesWithoutMotion(const ShapeSet& set, const FaceMesh& mesh);

}  // namespace mouthpiece
