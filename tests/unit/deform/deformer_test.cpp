#include "deform/kernel/deformer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "deform/mouth/jaw.h"
#include "deform/surface/bezier_surface.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::openMouth;
using samples::randomPose;
using samples::sampleBinding;
using samples::sampleControl;
using samples::sampleFace;

constexpr double kSameAsExact_mm = 0.01;
constexpr double kCarried = 0.04;  ///< share of a shift that the fixed ring may hold back well inside the markers

const FaceDeformer& deformer() {
  static const FaceDeformer made(sampleFace().mesh, sampleControl(), sampleBinding());
  return made;
}

VertexPositions deformed(const FaceDeformer& which, const MarkerPositions& markers, const TonguePose& tongue = {}) {
  VertexPositions out;
  which.deform(markers, tongue, out);
  return out;
}

float largestMove(const VertexPositions& moved, PartKind kind) {
  float largest = 0;
  for (const MeshPart& part : sampleFace().mesh.parts) {
    if (part.kind != kind) continue;
    for (std::size_t t = part.first_triangle; t < part.first_triangle + part.triangle_count; ++t) {
      for (const std::uint32_t v : sampleFace().mesh.triangles[t])
        largest = std::max(largest, (moved.row(v) - sampleFace().mesh.vertices.row(v)).norm());
    }
  }
  return largest;
}

TEST(FaceDeformer, RestGivesTheRestMesh) {
  EXPECT_LT((deformed(deformer(), sampleFace().rest) - sampleFace().mesh.vertices).cwiseAbs().maxCoeff(), 1e-4F);
}

TEST(FaceDeformer, MovesTheSameWithoutTheRest) {
  std::mt19937 random(5);
  const MarkerPositions pose = randomPose(sampleFace(), random);
  const VertexPositions whole = deformed(deformer(), pose, {0.5F, 0.2F, 0.3F});
  const std::vector<std::uint32_t>& moving = deformer().movingVertices();
  ASSERT_FALSE(moving.empty());
  std::vector<float> some(3 * moving.size());
  deformer().deformMoving(pose, {0.5F, 0.2F, 0.3F}, some);
  VertexPositions rebuilt = sampleFace().mesh.vertices;
  for (std::size_t i = 0; i < moving.size(); ++i)
    rebuilt.row(moving[i]) = Eigen::Map<const Eigen::RowVector3f>(some.data() + 3 * i);
  EXPECT_EQ(rebuilt, whole);
}

/// In the finite: a normal is square to where the surface goes from the vertex to its neighbours, as they shrink.
TEST(FaceDeformer, NormalsAreThoseOfTheSurface) {
  const BezierSurface surface(sampleControl());
  const MarkerPositions markers = openMouth(sampleFace(), 8);
  const auto pose = surface.pose(controlPoints(sampleControl(), markers));
  const VertexPositions moved = deformed(deformer(), markers);
  const VertexPositions normals = vertexNormals(moved, sampleFace().mesh.triangles);
  std::vector<double> angles;
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    if (sampleBinding().patch[v] < 0 || sampleBinding().skin_weight[v] < 1 || std::abs(sampleBinding().d[v]) > 0.3)
      continue;
    const SurfacePlace place{sampleBinding().patch[v], static_cast<double>(sampleBinding().u[v]),
                             static_cast<double>(sampleBinding().v[v])};
    const Eigen::Vector3d normal = normals.row(static_cast<Eigen::Index>(v)).transpose().cast<double>();
    angles.push_back(std::acos(std::clamp(normal.dot(evaluate(pose, place).normal()), -1.0, 1.0)));
  }
  ASSERT_GT(angles.size(), 500U);
  std::nth_element(angles.begin(), angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2), angles.end());
  EXPECT_LT(angles[angles.size() / 2] * 180 / 3.14159265, 3.0) << "degrees, the median";
}

/// Whether the surface covers less than three tenths of the plane that it is drawn in.
bool isFolded(const ControlMesh& control, const SurfacePlace& place, const SurfacePoint& at_rest) {
  const auto& [a, b, c] = control.triangles[static_cast<std::size_t>(place.triangle)];
  const Eigen::RowVector2d ab = control.domain.row(b) - control.domain.row(a),
                           ac = control.domain.row(c) - control.domain.row(a);
  return at_rest.du.cross(at_rest.dv).norm() < 0.3 * std::abs(ab.x() * ac.y() - ab.y() * ac.x()) / 3;
}

TEST(FaceDeformer, IsEquationThree) {
  // The other route: the surface in doubles, normals by its own derivatives.
  const BezierSurface surface(sampleControl());
  std::mt19937 random(21);
  for (int i = 0; i < 10; ++i) {
    const MarkerPositions markers = randomPose(sampleFace(), random);
    const VertexPositions out = deformed(deformer(), markers);
    const auto pose = surface.pose(controlPoints(sampleControl(), markers));
    std::size_t compared = 0;
    for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
      if (sampleBinding().patch[v] < 0 || sampleBinding().skin_weight[v] < 1 || isCarried(sampleBinding(), v)) continue;
      const SurfacePlace place{sampleBinding().patch[v], static_cast<double>(sampleBinding().u[v]),
                               static_cast<double>(sampleBinding().v[v])};
      const SurfacePoint at_rest = evaluate(surface.restPose(), place);
      if (isFolded(sampleControl(), place, at_rest)) continue;  // its normal turns nothing there
      const Eigen::Vector3d offset =
          sampleFace().mesh.vertices.row(static_cast<Eigen::Index>(v)).transpose().cast<double>() - at_rest.position;
      const double d = offset.dot(at_rest.normal());
      if ((offset - d * at_rest.normal()).norm() > 1e-4) continue;  // hangs beside its patch
      const SurfacePoint s = evaluate(pose, place);
      EXPECT_LT((out.row(static_cast<Eigen::Index>(v)).transpose().cast<double>() - s.position - d * s.normal()).norm(),
                kSameAsExact_mm);
      ++compared;
    }
    EXPECT_GT(compared, sampleFace().skin_vertices / 2);
  }
}

/// All that hangs on the surface, beside its place or above it, wholly or in part, and what the jaw alone carries: the
/// other route, vertex by vertex in doubles.
TEST(FaceDeformer, WhatHangsInPartGoesTheRestOfItsWayWithTheJaw) {
  FaceBinding binding = sampleBinding();
  std::mt19937 random(31);
  std::uniform_real_distribution<float> share(0, 1);
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    if (random() % 3 == 0) binding.skin_weight[v] *= share(random);
    if (random() % 3 == 0) binding.jaw_weight[v] = share(random);
    if (random() % 20 == 0) binding.patch[v] = -1;
  }
  const FaceMesh& mesh = sampleFace().mesh;
  const FaceDeformer unguarded(mesh, sampleControl(), binding, {.guard_lips = false});
  const BezierSurface surface(sampleControl());
  const JawHinge hinge(sampleControl());
  const auto pointOf = [&](std::size_t v) { return pointAt(mesh.vertices, v); };
  for (int round = 0; round < 4; ++round) {
    const MarkerPositions markers = randomPose(sampleFace(), random);
    const VertexPositions out = deformed(unguarded, markers);
    const MarkerPositions points = controlPoints(sampleControl(), markers);
    const auto pose = surface.pose(points);
    const AddedMotion jaw = hinge.motion(points);
    std::size_t in_part = 0, beside = 0, carried_by_jaw = 0;
    for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
      if (isCarried(binding, v)) continue;
      const double weight = binding.patch[v] < 0 ? 0 : double{binding.skin_weight[v]};
      Eigen::Vector3d expected = pointOf(v) + double{binding.jaw_weight[v]} * (jaw.turn * pointOf(v) + jaw.shift);
      if (weight > 0) {
        const SurfacePlace place{binding.patch[v], double{binding.u[v]}, double{binding.v[v]}};
        const PatchPlace at = patchPlace(place);
        const SurfacePoint rest = evaluate(surface.restPose()[at.patch], at.u, at.v),
                           now = evaluate(pose[at.patch], at.u, at.v);
        if (isFolded(sampleControl(), place, rest)) continue;  // its normal turns nothing there
        const auto frameOf = [](const SurfacePoint& s) {
          Eigen::Matrix3d frame;
          frame << s.du.normalized(), s.normal().cross(s.du.normalized()), s.normal();
          return frame;
        };
        const Eigen::Vector3d offset = frameOf(rest).transpose() * (pointOf(v) - rest.position);
        expected += weight * (now.position + frameOf(now) * offset - expected);
        beside += offset.head<2>().norm() > 0.1 ? 1U : 0U;
        in_part += weight < 1 ? 1U : 0U;
      } else {
        carried_by_jaw += binding.jaw_weight[v] > 0 ? 1U : 0U;
      }
      EXPECT_LT((pointAt(out, v) - expected).norm(), kSameAsExact_mm) << v << ", weight " << weight;
    }
    EXPECT_GT(in_part, 500U);
    EXPECT_GT(beside, 10U);
    EXPECT_GT(carried_by_jaw, 20U);
  }
}

/// Rows of a sparse matrix over displacements, taken from what moves already.
TEST(FaceDeformer, RelaxedVerticesGoWhereOthersTakeThem) {
  FaceBinding binding = sampleBinding();
  std::mt19937 random(32);
  std::uniform_real_distribution<float> share(0, 1);
  const auto skin = static_cast<std::uint32_t>(sampleFace().skin_vertices);
  for (std::uint32_t v = 7; v < skin; v += 13) {
    binding.relaxed.vertices.push_back(v);
    const std::size_t entries = random() % 5;
    for (std::size_t k = 0; k < entries; ++k) {
      const auto from = static_cast<std::uint32_t>(random() % skin);
      binding.relaxed.from.push_back(from % 13 == 7 ? from - 1 : from);
      binding.relaxed.weights.push_back(share(random) / asFloat(entries));
    }
    binding.relaxed.ends.push_back(static_cast<std::uint32_t>(binding.relaxed.from.size()));
  }
  const VertexPositions& rest = sampleFace().mesh.vertices;
  const FaceDeformer relaxed(sampleFace().mesh, sampleControl(), binding);
  const VertexPositions moves = deformed(relaxed, openMouth(sampleFace(), 9)) - rest;
  std::size_t entry = 0;
  for (std::size_t row = 0; row < binding.relaxed.vertices.size(); ++row) {
    Eigen::RowVector3f expected = Eigen::RowVector3f::Zero();
    for (; entry < binding.relaxed.ends[row]; ++entry)
      expected += binding.relaxed.weights[entry] * moves.row(binding.relaxed.from[entry]);
    EXPECT_LT((moves.row(binding.relaxed.vertices[row]) - expected).norm(), 1e-3F) << binding.relaxed.vertices[row];
  }
  EXPECT_LT((deformed(relaxed, sampleFace().rest) - rest).cwiseAbs().maxCoeff(), 1e-4F);
}

/// The guard is there for lips that come near each other; an open mouth is as if there were none.
TEST(FaceDeformer, GuardedLipsAreLeftAloneWhereTheyAreApart) {
  const FaceDeformer unguarded(sampleFace().mesh, sampleControl(), sampleBinding(), {.guard_lips = false});
  std::mt19937 random(33);
  std::uniform_real_distribution<double> open(14, 22), pressed(-5, 0);
  for (int round = 0; round < 5; ++round) {
    const MarkerPositions wide = openMouth(sampleFace(), open(random));
    const auto difference = (deformed(deformer(), wide) - deformed(unguarded, wide)).rowwise().norm().eval();
    for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
      if (std::abs(sampleFace().mesh.vertices(signedIndex(v), 0)) < 12) {
        EXPECT_EQ(difference[signedIndex(v)], 0) << v;
      }
    }
    // Pressed together, some of the lips would be in each other without it.
    const MarkerPositions shut = openMouth(sampleFace(), pressed(random));
    const auto deepest = [&](const VertexPositions& moved) {
      float most = 0;
      const VertexPositions& rest = sampleFace().mesh.vertices;
      for (Eigen::Index v = 0; v + 1 < signedIndex(sampleFace().skin_vertices); ++v) {
        if (rest.row(v) == rest.row(v + 1)) most = std::max(most, moved(v, 1) - moved(v + 1, 1));
      }
      return most;
    };
    EXPECT_LT(deepest(deformed(deformer(), shut)), 0.3F);
    EXPECT_LE(deepest(deformed(deformer(), shut)), deepest(deformed(unguarded, shut)) + 0.02F);
  }
}

TEST(FaceDeformer, PortableLoopsAgreeWithTheFastest) {
  const FaceDeformer portable(sampleFace().mesh, sampleControl(), sampleBinding(), {.portable_loops = true});
  std::mt19937 random(22);
  for (int i = 0; i < 10; ++i) {
    const MarkerPositions markers = randomPose(sampleFace(), random);
    const TonguePose tongue{.tip_up = 0.5F, .tip_forward = 0.2F, .back_up = 0.4F};
    EXPECT_LT((deformed(portable, markers, tongue) - deformed(deformer(), markers, tongue)).cwiseAbs().maxCoeff(),
              1e-3F);
  }
}

TEST(FaceDeformer, MarkersThatMoveTogetherCarryTheFace) {
  // Inside the markers; towards the fixed ring the motion fades.
  const Eigen::RowVector3d shift(1, -2, 3);
  const VertexPositions out = deformed(deformer(), sampleFace().rest.rowwise() + shift);
  std::size_t inside = 0;
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    const Eigen::RowVector3f p = sampleFace().mesh.vertices.row(static_cast<Eigen::Index>(v));
    if (std::abs(p.x()) > 25 || p.y() > 45 || p.y() < -55) continue;
    EXPECT_LT((out.row(static_cast<Eigen::Index>(v)) - p - shift.cast<float>()).norm(), kCarried * shift.norm()) << p;
    ++inside;
  }
  EXPECT_GT(inside, 1000U);
}

TEST(FaceDeformer, LipsOpenAndDoNotPassWhenPressed) {
  // Vertex pairs of the slit lie in one place at rest.
  const VertexPositions& rest = sampleFace().mesh.vertices;
  const VertexPositions open = deformed(deformer(), openMouth(sampleFace(), 15));
  const VertexPositions pressed = deformed(deformer(), openMouth(sampleFace(), -4));
  int pairs = 0;
  for (Eigen::Index v = 0; v + 1 < static_cast<Eigen::Index>(sampleFace().skin_vertices); ++v) {
    if (rest.row(v) != rest.row(v + 1)) continue;
    ++pairs;
    const float shut = pressed(v + 1, 1) - pressed(v, 1);
    EXPECT_GT(shut, -0.3F) << rest.row(v);
    EXPECT_LT(shut, 0.3F) << rest.row(v);
    if (std::abs(rest(v, 0)) < 8) {
      EXPECT_GT(open(v + 1, 1) - open(v, 1), 9.0F);
    }
  }
  EXPECT_GT(pairs, 15);
}

TEST(FaceDeformer, PartsMoveAsTheyShould) {
  const VertexPositions out = deformed(deformer(), openMouth(sampleFace(), 15));
  EXPECT_EQ(largestMove(out, PartKind::kUpperTeeth), 0.0F);
  EXPECT_EQ(largestMove(out, PartKind::kEye), 0.0F);
  EXPECT_GT(largestMove(out, PartKind::kLowerTeeth), 2.5F);
  EXPECT_GT(largestMove(out, PartKind::kTongue), 3.0F);
  const VertexPositions spoken = deformed(deformer(), sampleFace().rest, {.tip_up = 1});
  EXPECT_GT(largestMove(spoken, PartKind::kTongue), 3.0F);
  EXPECT_LT(largestMove(spoken, PartKind::kSkin), 1e-4F);
}

TEST(FaceDeformer, GrowsWithTheTonguesPose) {
  float before = 0;
  for (const float tip : {0.0F, 0.25F, 0.5F, 1.0F}) {
    const float moved = largestMove(deformed(deformer(), sampleFace().rest, {.tip_up = tip}), PartKind::kTongue);
    EXPECT_GE(moved, before);
    before = moved;
  }
  EXPECT_GT(largestMove(deformed(deformer(), sampleFace().rest, {.tip_forward = 1}), PartKind::kTongue), 1.0F);
  EXPECT_GT(largestMove(deformed(deformer(), sampleFace().rest, {.back_up = 1}), PartKind::kTongue), 1.0F);
}

TEST(FaceDeformer, EveryTriangleKeepsItsSizeInBounds) {
  // No spikes: in speech no edge of the skin grows past a multiple of itself; the lips' own are let off.
  std::mt19937 random(23);
  const FaceMesh& mesh = sampleFace().mesh;
  for (int i = 0; i < 20; ++i) {
    const VertexPositions out = deformed(deformer(), randomPose(sampleFace(), random));
    for (std::size_t t = 0; t < mesh.parts[0].triangle_count; ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
        EXPECT_LT((out.row(a) - out.row(b)).norm(), 4 * (mesh.vertices.row(a) - mesh.vertices.row(b)).norm() + 2)
            << mesh.vertices.row(a);
      }
    }
  }
}

TEST(FaceDeformer, GivesTheSameToManyThreads) {
  std::mt19937 random(24);
  const MarkerPositions markers = randomPose(sampleFace(), random);
  const VertexPositions expected = deformed(deformer(), markers);
  std::vector<VertexPositions> results(4);
  std::vector<std::thread> threads;
  for (auto& result : results) {
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) result = deformed(deformer(), markers);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const VertexPositions& result : results) EXPECT_EQ((result - expected).cwiseAbs().maxCoeff(), 0.0F);
}

TEST(FaceDeformer, SurvivesAbsurdPoses) {
  EXPECT_TRUE(deformed(deformer(), MarkerPositions::Zero(66, 3)).allFinite());
  EXPECT_TRUE(deformed(deformer(), 100 * sampleFace().rest).allFinite());
  EXPECT_TRUE(deformed(deformer(), -sampleFace().rest).allFinite());
}

TEST(FaceDeformer, RefusesABindingOfAnotherMesh) {
  FaceBinding other = sampleBinding();
  other.patch.pop_back();
  EXPECT_THROW(FaceDeformer(sampleFace().mesh, sampleControl(), other), InputError);
}

}  // namespace
}  // namespace mouthpiece
