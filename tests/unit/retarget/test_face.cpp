#include "test_face.h"

#include <cmath>
#include <numbers>

#include "base/files.h"
#include "deform/mesh/face_mesh.h"
#include "motion/marker_layout.h"
#include "support/tiny_corpus.h"

namespace mouthpiece::test {

namespace fs = std::filesystem;

std::optional<fs::path> canonicalFace() {
  for (const fs::path& folder :
       {fs::path(MOUTHPIECE_BIN_DIR) / "../third_party", fs::path(MOUTHPIECE_SOURCE_DIR) / "build/third_party"}) {
    if (fs::is_regular_file(folder / "canonical_face.obj")) return folder / "canonical_face.obj";
  }
  return std::nullopt;
}

const DefaultFace& defaultFace() {
  static const DefaultFace face = makeDefaultFace(readFaceMesh(*canonicalFace()), canonicalFace()->string());
  return face;
}

MadeUpActor madeUpActor() {
  MadeUpActor actor;
  actor.names = defaultLayout().markerNames();
  actor.neutral_mm.resize(static_cast<Eigen::Index>(actor.names.size()), 3);
  for (Eigen::Index i = 0; i < actor.neutral_mm.rows(); ++i) {
    const Eigen::Vector3d p =
        *placeOf(defaultFace().anchors, actor.names[static_cast<std::size_t>(i)], defaultFace().mesh, "default face");
    actor.neutral_mm.row(i) << 1.06 * p.x() + 0.02 * p.z() + 12, 0.94 * p.y() - 0.01 * p.x() - 30,
        1.1 * p.z() + 2 * std::sin(p.y() / 30) + 55;
  }
  return actor;
}

CorpusTake openingTake(const MadeUpActor& actor) {
  constexpr Eigen::Index kFrames = 13;
  CorpusTake take = samples::tinyTake("opening", "DH-AH T-AY-M", 0);
  take.motion = {60, actor.names, PositionMatrix(kFrames, actor.neutral_mm.size())};
  for (Eigen::Index f = 0; f < kFrames; ++f) {
    MarkerPositions pose = actor.neutral_mm;
    const double open = std::sin(std::numbers::pi * static_cast<double>(f) / (kFrames - 1));
    for (std::size_t i = 0; i < actor.names.size(); ++i) {
      const bool is_lower = actor.names[i].starts_with("LIP_LO") || actor.names[i].starts_with("CHIN") ||
                            actor.names[i].starts_with("JAW_FRONT");
      if (is_lower) pose(static_cast<Eigen::Index>(i), 1) -= 9 * open;
    }
    take.motion.positions_mm.row(f) = Eigen::Map<const Eigen::RowVectorXd>(pose.data(), pose.size());
  }
  return take;
}

FaceFile fittedDefaultFace(FaceMesh& mesh) {
  const MadeUpActor actor = madeUpActor();
  mesh = defaultFace().mesh;
  FitRequest request{.name = "default",
                     .mesh_file = "default.obj",
                     .mesh_sha256 = sha256Hex(objBytes(mesh)),
                     .corpus = "made up",
                     .marker_names = actor.names,
                     .actor_neutral_mm = actor.neutral_mm,
                     .warp = {},
                     .binding = {}};
  return fitFace(mesh, defaultFace().anchors, "default face", request);
}

}  // namespace mouthpiece::test
