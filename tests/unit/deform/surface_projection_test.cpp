#include "deform/surface/surface_projection.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleControl;

double nearestSample(const BezierSurface::Pose& pose, const Eigen::Vector3d& point) {
  double nearest = std::numeric_limits<double>::infinity();
  constexpr int kSteps = 16;
  for (const auto& patch : pose) {
    for (int i = 0; i <= kSteps; ++i) {
      for (int j = 0; i + j <= kSteps; ++j) {
        nearest = std::min(
            nearest,
            (evaluate(patch, static_cast<double>(i) / kSteps, static_cast<double>(j) / kSteps).position - point)
                .norm());
      }
    }
  }
  return nearest;
}

TEST(SurfaceProjection, IsNeverFurtherThanTheNearestSample) {
  const BezierSurface surface(sampleControl());
  const SurfaceProjector projector(surface, sampleControl(),
                                   std::vector<std::uint32_t>(sampleControl().triangles.size(), 0));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> x(-60, 60), y(-90, 80), z(30, 90);
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d point(x(random), y(random), z(random));
    const auto foot = projector.closest(point, Eigen::Vector3d::Zero(), -1, 0);
    ASSERT_TRUE(foot);
    EXPECT_LT(foot->distance, nearestSample(surface.restPose(), point) + 1e-9);
    EXPECT_NEAR((evaluate(surface.restPose(), foot->place).position - point).norm(), foot->distance, 1e-9);
  }
}

TEST(SurfaceProjection, FindsThePlaceAPointWasRaisedFrom) {
  const BezierSurface surface(sampleControl());
  const SurfaceProjector projector(surface, sampleControl(),
                                   std::vector<std::uint32_t>(sampleControl().triangles.size(), 0));
  for (int t = 0; t < static_cast<int>(sampleControl().triangles.size()); ++t) {
    const SurfacePoint s = evaluate(surface.restPose(), SurfacePlace{t, 0.5, 0.3});
    const auto foot = projector.closest(s.position + 0.5 * s.normal(), s.normal(), 0.2, 0);
    ASSERT_TRUE(foot);
    EXPECT_LT(foot->distance, 0.5 + 1e-9);
  }
}

TEST(SurfaceProjection, LeavesForbiddenTrianglesAndOppositeNormalsOut) {
  const BezierSurface surface(sampleControl());
  std::vector<std::uint32_t> marks(sampleControl().triangles.size(), 0);
  marks.at(30) = 4;
  const SurfaceProjector projector(surface, sampleControl(), marks);
  const SurfacePoint s = evaluate(surface.restPose(), SurfacePlace{30, 1.0 / 3, 1.0 / 3});
  EXPECT_EQ(projector.closest(s.position, s.normal(), 0.2, 0)->place.triangle, 30);
  EXPECT_NE(projector.closest(s.position, s.normal(), 0.2, 4)->place.triangle, 30);
  const auto behind = projector.closest(s.position, -s.normal(), 0.9, 0);
  if (behind) {
    EXPECT_LT(evaluate(surface.restPose(), behind->place).normal().dot(s.normal()), -0.85);
  }
}

}  // namespace
}  // namespace mouthpiece
