// The ICT head (26,719 vertices, ../shared/faces): a fit from ten anchors, and a frame of the deformer against a dense
// blend of 52 shapes of the same mesh and against a plain copy of its vertices, all in one run.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstring>
#include <thread>

#include "deform/mesh/face_mesh.h"
#include "ict_bench_head.h"
#include "retarget/placing/face_page.h"

namespace mouthpiece {
namespace {

constexpr int kBlendShapes = 52;  // ARKit's number

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

/// What keeping the lips out of each other and of the teeth costs where it costs most: closed lips.
void ictLipGuard(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  const FaceDeformer without(ict->mesh, ict->face.control, ict->face.binding, DeformerOptions{.guard_lips = false});
  const MarkerPositions& closed = ict->face.marker_targets;
  VertexPositions out = ict->mesh.vertices;
  double guarded_ms = 1e9, unguarded_ms = 1e9;
  for (auto _ : state) {
    guarded_ms = std::min(guarded_ms, fastestMs([&] { ict->deformer->deform(closed, {}, out); }));
    unguarded_ms = std::min(unguarded_ms, fastestMs([&] { without.deform(closed, {}, out); }));
  }
  state.counters["deform_ms"] = guarded_ms;
  state.counters["guard_share"] = 1 - unguarded_ms / guarded_ms;
}
BENCHMARK(ictLipGuard)->Unit(benchmark::kMillisecond);

/// The head over and over as one mesh: nanoseconds a vertex and frame must not grow.
void ictManyTimesOver(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  const auto copies = static_cast<Eigen::Index>(state.range(0));
  const Eigen::Index count = ict->mesh.vertices.rows();
  FaceMesh mesh = ict->mesh;
  mesh.vertices = ict->mesh.vertices.replicate(copies, 1);
  FaceBinding binding;
  const auto repeated = [&](const auto& column, auto& to) {
    for (Eigen::Index i = 0; i < copies; ++i) to.insert(to.end(), column.begin(), column.end());
  };
  repeated(ict->face.binding.patch, binding.patch);
  repeated(ict->face.binding.u, binding.u);
  repeated(ict->face.binding.v, binding.v);
  repeated(ict->face.binding.d, binding.d);
  repeated(ict->face.binding.skin_weight, binding.skin_weight);
  repeated(ict->face.binding.jaw_weight, binding.jaw_weight);
  mesh.triangles.clear();
  for (MeshPart& part : mesh.parts) {
    const std::size_t first = mesh.triangles.size();
    for (Eigen::Index i = 0; i < copies; ++i) {
      for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
        Triangle triangle = ict->mesh.triangles[t];
        for (std::uint32_t& corner : triangle) corner += static_cast<std::uint32_t>(i * count);
        mesh.triangles.push_back(triangle);
      }
    }
    part.first_triangle = first;
    part.triangle_count = mesh.triangles.size() - first;
  }
  const FaceDeformer deformer(mesh, ict->face.control, binding);
  VertexPositions out = mesh.vertices;
  double deform_ms = 1e9, copy_ms = 1e9;
  for (auto _ : state) {
    deform_ms = std::min(deform_ms, fastestMs([&] { ict->deform(deformer, out); }));
    copy_ms =
        std::min(copy_ms, fastestMs([&] {
                   std::memcpy(out.data(), mesh.vertices.data(), static_cast<std::size_t>(out.size()) * sizeof(float));
                   benchmark::DoNotOptimize(out.data());
                 }));
  }
  state.counters["vertices"] = static_cast<double>(mesh.vertices.rows());
  state.counters["ns_a_vertex"] = 1e6 * deform_ms / static_cast<double>(mesh.vertices.rows());
  state.counters["share_of_copy"] = copy_ms / deform_ms;
}
BENCHMARK(ictManyTimesOver)->Arg(1)->Arg(4)->Arg(12)->Arg(38)->Iterations(1)->Unit(benchmark::kMillisecond);

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
