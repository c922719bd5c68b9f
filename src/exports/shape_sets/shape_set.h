#pragma once

#include <map>
#include <string>
#include <vector>

#include "deform/mesh/face_mesh.h"
#include "exports/shapes/principal_shapes.h"
#include "motion/lip_pose.h"
#include "motion/motion_clip.h"
#include "motion/tongue_pose.h"
#include "retarget/rig/face_rig.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {

enum class ShapeVocabulary { kArkit, kOculus, kVrm };

/// Shapes for a head that has none, as the deformer makes them of marker poses.
struct ShapeSet {
  std::vector<std::string> names;
  std::vector<VertexPositions> moves;  ///< of each vertex of the rig's mesh at weight 1, its unit
  std::vector<bool> closes;            ///< the lips meet in it; "mouthClose": together with "jawOpen"
  MotionClip poses;                    ///< the markers of each, a frame a shape
  std::vector<LipPose> lips;           ///< one a frame
  std::vector<TonguePose> tongue;
};

/// The 52 of ARKit, by Apple's names in lower camel case, from what these shapes do to markers on a head that has them
/// (arkitMarkerMoves), both sides made alike; or 14 visemes of Oculus (all but "sil") or VRM's mouth and lids, from
/// `poses`, learnt from `actor`'s capture. Eyes turn about their own middles. `actor_markers`: names of
/// actor.neutral_mm's rows; `strengths`: of a shape of that name, how far the markers go; 1 where there is none.
ShapeSet makeShapeSet(const FaceRig& rig, const ActorPose& actor, const std::vector<std::string>& actor_markers,
                      const VisemePoses& poses, ShapeVocabulary vocabulary,
                      const std::map<std::string, double>& strengths = {});

/// The set as the writers of scenes take it, without frames.
PrincipalShapes shapesWithoutMotion(const ShapeSet& set, const FaceMesh& mesh);

}  // namespace mouthpiece
