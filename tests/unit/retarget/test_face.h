#pragma once

#include <filesystem>
#include <optional>

#include "deform/mesh/face_mesh.h"
#include "retarget/rig/face_fit.h"
#include "retarget/sample_head/default_face.h"
#include "units/file/corpus.h"

namespace mouthpiece::test {

/// Heads that lie beside the repository; any of them may be missing.
inline const std::filesystem::path kSharedFaces = std::filesystem::path(MOUTHPIECE_SOURCE_DIR) / "../shared/faces";

/// Where `make data` puts the canonical face; nullopt when it is not there (no network yet).
std::optional<std::filesystem::path> canonicalFace();
inline constexpr const char* kNoCanonicalFace =
    "build/third_party/canonical_face.obj is not here; `make data` brings it";

/// The default face, made once.
const DefaultFace& defaultFace();

/// Another head's neutral markers: the default face's, stretched, turned a little and bent, with their names.
struct MadeUpActor {
  std::vector<std::string> names;
  MarkerPositions neutral_mm;
};
MadeUpActor madeUpActor();

/// Twelve frames in which the actor's lower lip, chin and jaw go down and come back.
CorpusTake openingTake(const MadeUpActor& actor);

/// `defaultFace()` fitted to `madeUpActor()`.
FaceFile fittedDefaultFace(FaceMesh& mesh);

}  // namespace mouthpiece::test
