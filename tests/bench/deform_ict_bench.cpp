// The ICT head (26,719 vertices, ../shared/faces): a fit from ten anchors, and a frame of the deformer against a dense
// blend of 52 shapes of the same mesh and against a plain copy of its vertices, all in one run.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

#include "base/files.h"
#include "deform/deformer.h"
#include "motion/marker_layout.h"
#include "retarget/face_fit.h"
#include "retarget/face_page.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

constexpr int kBlendShapes = 52;  // ARKit's number
constexpr const char* kMissing = "../shared/faces/ict_head.obj is not here";

fs::path root() { return MOUTHPIECE_SOURCE_DIR; }

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

  void deform(const FaceDeformer& which, VertexPositions& out) const {
    which.deform({open.data(), static_cast<std::size_t>(open.size())}, {}, out);
  }
};

const Head* head() {
  static const std::unique_ptr<Head> made =
      fs::exists(root() / "../shared/faces/ict_head.obj") ? std::make_unique<Head>() : nullptr;
  return made.get();
}

double fastestMs(const auto& work) {
  double best = 1e9;
  for (int i = 0; i < 30; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

void ictDeformAgainstDenseBlend(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  VertexPositions out = ict->mesh.vertices;
  const Eigen::MatrixXf shapes = Eigen::MatrixXf::Random(out.size(), kBlendShapes);
  const Eigen::VectorXf weights = Eigen::VectorXf::Random(kBlendShapes), neutral = Eigen::VectorXf::Random(out.size());
  Eigen::VectorXf blended = neutral;
  double ours_ms = 1e9, portable_ms = 1e9, blend_ms = 1e9, copy_ms = 1e9;
  for (auto _ : state) {
    ours_ms = std::min(ours_ms, fastestMs([&] { ict->deform(*ict->deformer, out); }));
    portable_ms = std::min(portable_ms, fastestMs([&] { ict->deform(*ict->portable, out); }));
    blend_ms = std::min(blend_ms, fastestMs([&] {
                          blended = neutral;
                          blended.noalias() += shapes * weights;
                          benchmark::DoNotOptimize(blended.data());
                        }));
    copy_ms = std::min(copy_ms, fastestMs([&] {
                         std::memcpy(out.data(), ict->mesh.vertices.data(),
                                     static_cast<std::size_t>(out.size()) * sizeof(float));
                         benchmark::DoNotOptimize(out.data());
                       }));
  }
  state.counters["deform_ms"] = ours_ms;
  state.counters["blend_ms"] = blend_ms;
  state.counters["times_faster"] = blend_ms / ours_ms;
  state.counters["times_faster_portable"] = blend_ms / portable_ms;
  state.counters["share_of_copy"] = copy_ms / ours_ms;
}
BENCHMARK(ictDeformAgainstDenseBlend)->Unit(benchmark::kMillisecond);

/// 64 frames on one thread and on two.
void ictDeformOnTwoThreads(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  constexpr int kFrames = 64;
  std::array<VertexPositions, 2> out{ict->mesh.vertices, ict->mesh.vertices};
  const auto frames = [&](std::size_t thread, int count) {
    for (int f = 0; f < count; ++f) ict->deform(*ict->deformer, out[thread]);
  };
  double one_ms = 1e9, two_ms = 1e9;
  for (auto _ : state) {
    one_ms = std::min(one_ms, fastestMs([&] { frames(0, kFrames); }));
    two_ms = std::min(two_ms, fastestMs([&] {
                        std::thread other(frames, 1, kFrames / 2);
                        frames(0, kFrames / 2);
                        other.join();
                      }));
  }
  state.counters["times_faster"] = one_ms / two_ms;
}
BENCHMARK(ictDeformOnTwoThreads)->Unit(benchmark::kMillisecond);

void ictFitFromTenAnchors(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  Anchors ten;
  for (const AnchorToPick& anchor : suggestedAnchors())
    ten.markers[std::string(anchor.name)] = ict->all.markers.at(std::string(anchor.name));
  FitRequest request = ict->request;
  request.warp.any_kernel = true;
  for (auto _ : state) {
    FaceMesh mesh = ict->mesh;
    benchmark::DoNotOptimize(fitFace(mesh, ten, "ten", request));
  }
}
BENCHMARK(ictFitFromTenAnchors)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
