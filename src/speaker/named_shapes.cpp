// The moving face by shapes that have the same names in every line: ARKit's, or Oculus' visemes.
#include <algorithm>

#include "base/errors.h"
#include "base/files.h"
#include "deform/mesh/mesh_files.h"
#include "deform/mesh/mesh_limits.h"
#include "exports/arkit.h"
#include "exports/curves/weight_tracks.h"
#include "exports/gltf/glb.h"
#include "exports/shape_sets/shape_set.h"
#include "speaker/speaker_data.h"

namespace mouthpiece {
namespace {

/// Columns by the shapes' names.
OwnShapeWeights visemeWeights(const UtteranceAnimation& animation) {
  if (animation.labels.phones.empty())
    throw InputError("nothing is known of what the motion says; expected its labels");
  const MotionClip& motion = animation.motion;
  WeightTracks tracks = oculusVisemes(animation.labels, motion.positions_mm.rows(), motion.frame_rate_hz);
  return {std::move(tracks.weights), [names = std::move(tracks.names)](std::string_view name) {
            const auto found = std::find(names.begin(), names.end(), name);
            return found == names.end() ? -1 : static_cast<int>(found - names.begin());
          }};
}

}  // namespace

std::string Performance::Data::namedGlb(NamedShapes kind) const {
  const bool is_arkit = kind == NamedShapes::kArkit;
  const SharedFace::Data& own = needFace();
  const FaceMesh& mesh = own.rig().mesh();
  const std::filesystem::path mesh_path = own.meshPath();
  const double rate = animation.motion.frame_rate_hz;
  std::string given = isGlb(mesh_path) ? readFile(mesh_path, kMaxMeshBytes) : "";
  if (!given.empty() && is_arkit) {
    // A head that has them is driven by its own.
    if (auto driven =
            glbWithWeights(given, mesh_path.string(), rate, {arkitOfHead(), arkitIndex}, own.file.mesh_object))
      return *driven;
  }
  // Of motion from elsewhere no actor is known whose visemes could be taken: those of the sample corpus, as in
  // `retarget shapes`.
  const SharedCorpus learnt_from = corpus ? *corpus : SharedCorpus();
  const SharedCorpus::Data& by = learnt_from.data();
  const std::vector<std::string> markers = by.corpus.layout.markerNames();
  const ShapeMaker maker(own.rig(), own.file, by.actor, markers, by.curve_model.poses());
  const ShapeSet set = maker.make(is_arkit ? ShapeVocabulary::kArkit : ShapeVocabulary::kOculus);
  const OwnShapeWeights weights =
      is_arkit ? OwnShapeWeights{fitArkit(uprightFrames(), mesh, {set.names, set.moves}).weights, arkitIndex}
               : visemeWeights(animation);
  PrincipalShapes shapes = shapesWithoutMotion(set, mesh);
  if (!given.empty()) {
    const auto shaped = glbWithShapes(given, mesh_path.string(), shapes, own.file.upright_from_mesh,
                                      own.file.mesh_object, nullptr, set.names);
    const auto driven = shaped ? glbWithWeights(*shaped, mesh_path.string(), rate, weights, own.file.mesh_object)
                               : std::optional<std::string>();
    if (driven) return *driven;
  }
  shapes.frame_rate_hz = rate;
  shapes.weights = RowMajorMatrixF::Zero(weights.weights.rows(), shapes.shapeCount());
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k) {
    const int column = weights.column_of(set.names[unsignedIndex(k)]);
    if (column >= 0) shapes.weights.col(k) = weights.weights.col(column);
  }
  return glbBytes(mesh, shapes, own.rig().name(), set.names);
}

}  // namespace mouthpiece
