// A frame of the deformer against a dense linear blend of 52 shapes of the same mesh, both on one thread.
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>

#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "tests/unit/deform/sample_face.cpp"  // a benchmark is one source file

namespace mouthpiece {
namespace {

constexpr int kBlendShapes = 52;  // ARKit's number

struct Scene {
  samples::SampleFace face = samples::makeSampleFace(1.05);
  ControlMesh control = buildControlMesh(face.names, face.rest, face.known, &face.mesh);
  FaceBinding binding = bindFace(face.mesh, control);
  FaceDeformer deformer{face.mesh, control, binding};
  FaceDeformer portable{face.mesh, control, binding, {.portable_loops = true}};
  MarkerPositions pose = samples::openMouth(face, 12);
  VertexPositions out = face.mesh.vertices;

  Eigen::MatrixXf shapes = Eigen::MatrixXf::Random(face.mesh.vertices.size(), kBlendShapes);
  Eigen::VectorXf weights = Eigen::VectorXf::Random(kBlendShapes);
  Eigen::VectorXf neutral = Eigen::VectorXf::Random(face.mesh.vertices.size());
  Eigen::VectorXf blended = neutral;

  void deform(const FaceDeformer& which) { which.deform(pose, {.tip_up = 0.3F}, out); }
  void blend() {
    blended = neutral;
    blended.noalias() += shapes * weights;
  }
};

Scene& scene() {
  static Scene made;
  return made;
}

double millisecondsOf(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

/// Frames of both in turn, so that both meet the same machine; the least time of each counts.
void deformAgainstBlend(benchmark::State& state, const FaceDeformer& which) {
  double ours_ms = 1e9, blend_ms = 1e9;
  for (auto _ : state) {
    for (int i = 0; i < 10; ++i) ours_ms = std::min(ours_ms, millisecondsOf([&] { scene().deform(which); }));
    for (int i = 0; i < 10; ++i) blend_ms = std::min(blend_ms, millisecondsOf([&] { scene().blend(); }));
    benchmark::DoNotOptimize(scene().out.data());
    benchmark::DoNotOptimize(scene().blended.data());
  }
  const auto vertices = static_cast<double>(scene().face.mesh.vertices.rows());
  state.counters["vertices"] = vertices;
  state.counters["deform_ms"] = ours_ms;
  state.counters["blend_ms"] = blend_ms;
  state.counters["vertices_per_s"] = 1000 * vertices / ours_ms;
  state.counters["times_faster"] = blend_ms / ours_ms;
}

void deformAgainstDenseBlend(benchmark::State& state) { deformAgainstBlend(state, scene().deformer); }
BENCHMARK(deformAgainstDenseBlend)->Unit(benchmark::kMillisecond);

void portableDeformAgainstDenseBlend(benchmark::State& state) { deformAgainstBlend(state, scene().portable); }
BENCHMARK(portableDeformAgainstDenseBlend)->Unit(benchmark::kMillisecond);

void controlPointsOfAFrame(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(controlPoints(scene().control, scene().pose));
}
BENCHMARK(controlPointsOfAFrame)->Unit(benchmark::kMicrosecond);

void bind(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(bindFace(scene().face.mesh, scene().control));
}
BENCHMARK(bind)->Unit(benchmark::kMillisecond);

void fitControlSurface(benchmark::State& state) {
  for (auto _ : state)
    benchmark::DoNotOptimize(
        buildControlMesh(scene().face.names, scene().face.rest, scene().face.known, &scene().face.mesh));
}
BENCHMARK(fitControlSurface)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
