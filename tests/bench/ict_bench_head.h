#pragma once

// The ICT head (26,719 vertices, ../shared/faces) for benchmarks.
#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/files.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "motion/marker_layout.h"
#include "retarget/rig/face_fit.h"

namespace mouthpiece {

inline constexpr const char* kMissing = "../shared/faces/ict_head.obj is not here";

inline std::filesystem::path root() { return MOUTHPIECE_SOURCE_DIR; }

/// The head with itself as the actor: its own hand-set places.
struct Head {
  FaceMesh mesh = readFaceMesh(root() / "../shared/faces/ict_head.obj");
  Anchors all = parseAnchors(readFile(root() / "sample_data/anchors/ict_head.anchors.json"), "ict_head.anchors.json");
  FitRequest request;
  FaceFile face;
  std::optional<FaceDeformer> deformer, portable;
  MarkerPositions open;

  Head() {
    request.marker_names = defaultLayout().markerNames();
    request.actor_neutral_mm.resize(static_cast<Eigen::Index>(request.marker_names.size()), 3);
    for (std::size_t i = 0; i < request.marker_names.size(); ++i) {
      request.actor_neutral_mm.row(static_cast<Eigen::Index>(i)) =
          placeOf(all, request.marker_names[i], mesh, "anchors")->transpose();
    }
    // Another head's proportions.
    request.actor_neutral_mm.col(0) *= 1.06;
    request.actor_neutral_mm.col(1) *= 0.95;
    face = fitFace(mesh, all, "anchors", request);
    deformer.emplace(mesh, face.control, face.binding);
    portable.emplace(mesh, face.control, face.binding, DeformerOptions{.portable_loops = true});
    open = face.marker_targets;
    for (std::size_t i = 0; i < request.marker_names.size(); ++i) {
      const std::string& name = request.marker_names[i];
      if (name.starts_with("LIP_LO") || name.starts_with("CHIN")) open(static_cast<Eigen::Index>(i), 1) -= 9;
    }
  }

  void deform(const FaceDeformer& which, VertexPositions& out) const { which.deform(open, {}, out); }
};

inline const Head* head() {
  static const std::unique_ptr<Head> made =
      std::filesystem::exists(root() / "../shared/faces/ict_head.obj") ? std::make_unique<Head>() : nullptr;
  return made.get();
}

/// The fastest of thirty runs.
inline double fastestMs(const auto& work) {
  double best = 1e9;
  for (int i = 0; i < 30; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

}  // namespace mouthpiece
