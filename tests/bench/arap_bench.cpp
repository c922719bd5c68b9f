// A frame of the ICT head by our deformer and by CGAL's as-rigid-as-possible deformation with the same markers.
#include <benchmark/benchmark.h>

#include <chrono>

#include "arap_deformer.h"
#include "ict_bench_head.h"

namespace mouthpiece {
namespace {

void ictDeformAgainstAsRigidAsPossible(benchmark::State& state) {
  const Head* ict = head();
  if (ict == nullptr) return state.SkipWithError(kMissing);
  ArapDeformer arap(ict->mesh, ict->face.marker_targets, ict->deformer->movingVertices());
  VertexPositions out = ict->mesh.vertices;
  // By turns open and at rest: ARAP starts from the frame before and would have nothing left to do.
  bool open = false;
  double ours_ms = 1e9, arap_ms = 1e9;
  for (auto _ : state) {
    open = !open;
    const FacePose pose(open ? ict->open : ict->face.marker_targets);
    ours_ms = std::min(ours_ms, fastestMs([&] { ict->deformer->deform(pose, {}, out); }));
    const auto start = std::chrono::steady_clock::now();
    arap.deform(pose.markers, out);
    const std::chrono::duration<double, std::milli> passed = std::chrono::steady_clock::now() - start;
    arap_ms = std::min(arap_ms, passed.count());
  }
  state.counters["vertices"] = static_cast<double>(arap.vertexCount());
  state.counters["deform_ms"] = ours_ms;
  state.counters["arap_ms"] = arap_ms;
  state.counters["times_faster"] = arap_ms / ours_ms;
}
BENCHMARK(ictDeformAgainstAsRigidAsPossible)->Iterations(10)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mouthpiece
