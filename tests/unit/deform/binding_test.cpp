#include "deform/surface/binding.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "base/errors.h"
#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using testing::openMouth;
using testing::sampleBinding;
using testing::sampleControl;
using testing::sampleFace;

TEST(Binding, NoVertexOfOneLipHangsOnTheOther) {
  // The sides come from the grid the mesh was laid on, not from the binding's own distances.
  std::size_t upper_bound = 0, lower_bound = 0;
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    if (sampleBinding().patch[v] < 0) continue;
    const LipSide side = sampleControl().sideOf(static_cast<std::size_t>(sampleBinding().patch[v]));
    const bool is_lip = sampleFace().mesh.vertices.row(static_cast<Eigen::Index>(v)).cwiseAbs()(0) < 20;
    if (!is_lip || side == LipSide::kNone) continue;
    EXPECT_EQ(side == LipSide::kUpper, static_cast<bool>(sampleFace().is_above_slit[v])) << "vertex " << v;
    ++(side == LipSide::kUpper ? upper_bound : lower_bound);
  }
  EXPECT_GT(upper_bound, 50U);
  EXPECT_GT(lower_bound, 50U);
  EXPECT_EQ(inspectBinding(sampleBinding(), sampleFace().mesh, sampleControl()).lip_side_errors, 0U);
}

TEST(Binding, CountsLipSideErrors) {
  FaceBinding wrong = sampleBinding();
  std::int32_t lower = 0;
  while (sampleControl().sideOf(static_cast<std::size_t>(lower)) != LipSide::kLower) ++lower;
  std::size_t changed = 0;
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    if (wrong.patch[v] < 0 || sampleControl().sideOf(static_cast<std::size_t>(wrong.patch[v])) != LipSide::kUpper ||
        !sampleFace().is_above_slit[v])
      continue;
    wrong.patch[v] = lower;
    if (++changed == 7) break;
  }
  EXPECT_EQ(inspectBinding(wrong, sampleFace().mesh, sampleControl()).lip_side_errors, changed);
}

TEST(Binding, WhatLiesBehindOtherSkinHangsAlongTheMesh) {
  // A wall 10 mm behind a cheek that faces as the cheek does but hangs together with the chin, as sockets of eyes and
  // walls of nostrils hang together with other skin than what is before them.
  const auto& given = sampleFace();
  const auto placeOf = [&](const char* name) -> Eigen::RowVector3f {
    return given.rest.row(findPoint(sampleControl(), name)).cast<float>();
  };
  const Eigen::RowVector3f cheek = placeOf("CHEEK_MID_R"), chin = placeOf("CHIN_LOW");
  FaceMesh mesh = given.mesh;
  Eigen::Index nearest_chin = 0;
  mesh.vertices.topRows(signedIndex(given.skin_vertices))
      .rowwise()
      .
      operator-(chin)
      .rowwise()
      .squaredNorm()
      .minCoeff(&nearest_chin);
  std::map<std::uint32_t, std::uint32_t> copies;
  std::vector<Triangle> wall;
  for (const Triangle& t : trianglesOf(mesh, {PartKind::kSkin})) {
    if ((mesh.vertices.row(t[0]) - cheek).norm() > 8) continue;
    Triangle copy{};
    for (std::size_t k = 0; k < 3; ++k) {
      copy[k] = copies.try_emplace(t[k], static_cast<std::uint32_t>(mesh.vertexCount() + copies.size())).first->second;
    }
    wall.push_back(copy);
  }
  ASSERT_GT(wall.size(), 4U);
  const Eigen::Index old = mesh.vertices.rows();
  mesh.vertices.conservativeResize(old + signedIndex(copies.size()), Eigen::NoChange);
  for (const auto& [from, to] : copies) mesh.vertices.row(to) = mesh.vertices.row(from) + Eigen::RowVector3f(0, 0, -10);
  wall.push_back({wall[0][0], wall[0][1], static_cast<std::uint32_t>(nearest_chin)});
  mesh.parts.push_back({.name = "wall",
                        .kind = PartKind::kSkin,
                        .first_triangle = mesh.triangles.size(),
                        .triangle_count = wall.size()});
  mesh.triangles.insert(mesh.triangles.end(), wall.begin(), wall.end());
  const FaceBinding binding = bindFace(mesh, sampleControl());
  for (const auto& [from, to] : copies) {
    EXPECT_GT(binding.skin_weight[from], 0.9F) << "the cheek, vertex " << from;
    EXPECT_EQ(binding.skin_weight[to], 0) << "the wall behind it, vertex " << to;
  }
  constexpr double kAFewVertices = 1e-3;  // of some thousand
  EXPECT_NEAR(inspectBinding(binding, mesh, sampleControl()).coverage,
              inspectBinding(sampleBinding(), given.mesh, sampleControl()).coverage, kAFewVertices)
      << "what other skin hides is not in front";
}

TEST(Binding, TellsLipsThatAreOneSurface) {
  EXPECT_GT(inspectBinding(sampleBinding(), sampleFace().mesh, sampleControl()).way_between_lips, 1);
  // The slit sewn up: of vertices in one place all triangles take the first.
  FaceMesh sewn = sampleFace().mesh;
  std::map<std::array<float, 3>, std::uint32_t> first;
  for (Triangle& triangle : sewn.triangles) {
    for (std::uint32_t& corner : triangle) {
      const auto place = sewn.vertices.row(static_cast<Eigen::Index>(corner));
      corner = first.try_emplace({place.x(), place.y(), place.z()}, corner).first->second;
    }
  }
  EXPECT_LT(inspectBinding(sampleBinding(), sewn, sampleControl()).way_between_lips, 0.6);
}

TEST(Binding, OffsetsAreEquationThree) {
  const BezierSurface surface(sampleControl());
  std::size_t checked = 0;
  for (std::size_t v = 0; v < sampleFace().skin_vertices; ++v) {
    if (sampleBinding().patch[v] < 0 || isCarried(sampleBinding(), v)) continue;
    const SurfacePoint s =
        evaluate(surface.restPose(), {sampleBinding().patch[v], static_cast<double>(sampleBinding().u[v]),
                                      static_cast<double>(sampleBinding().v[v])});
    const Eigen::Vector3d offset =
        sampleFace().mesh.vertices.row(static_cast<Eigen::Index>(v)).transpose().cast<double>() - s.position;
    EXPECT_NEAR(offset.dot(s.normal()), static_cast<double>(sampleBinding().d[v]), 1e-4);
    checked += (offset - static_cast<double>(sampleBinding().d[v]) * s.normal()).norm() < 1e-4 ? 1U : 0U;
  }
  EXPECT_GT(checked, sampleFace().skin_vertices * 7 / 10) << "most of the skin must lie right above its place";
}

TEST(Binding, CoversTheFaceAndLeavesOtherPartsToTheJawOrAlone) {
  const BindingReport report = inspectBinding(sampleBinding(), sampleFace().mesh, sampleControl());
  EXPECT_EQ(report.skin_vertices, sampleFace().skin_vertices);
  EXPECT_GT(report.coverage, 0.97);
  EXPECT_LT(report.largest_offset, 15.0);
  const FaceMesh& mesh = sampleFace().mesh;
  for (const MeshPart& part : mesh.parts) {
    if (part.kind == PartKind::kSkin) continue;
    const float jaw = part.kind == PartKind::kLowerTeeth || part.kind == PartKind::kTongue ? 1.0F : 0.0F;
    for (const std::uint32_t v : mesh.triangles[part.first_triangle]) {
      EXPECT_EQ(sampleBinding().patch[v], -1) << part.name;
      EXPECT_EQ(sampleBinding().jaw_weight[v], jaw) << part.name;
    }
  }
}

/// A tuft of hair on the chin, modelled from the skin on: its roots are in the places of skin vertices.
TEST(Binding, LoosePartsAreCarriedByTheirRootsWithoutTurning) {
  constexpr float kStandsOff_mm = 6;
  FaceMesh mesh = sampleFace().mesh;
  const Triangle* skin = nullptr;
  const Eigen::RowVector3f chin = sampleControl().rest.row(findPoint(sampleControl(), "CHIN_MID")).cast<float>();
  float nearest = std::numeric_limits<float>::infinity();
  for (const Triangle& triangle : sampleFace().mesh.triangles) {
    const float distance = (mesh.vertices.row(triangle[0]) - chin).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    skin = &triangle;
  }
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(first + 3, 3);
  mesh.vertices.row(first) = mesh.vertices.row((*skin)[0]);
  mesh.vertices.row(first + 1) = mesh.vertices.row((*skin)[1]);
  mesh.vertices.row(first + 2) = mesh.vertices.row(first) + Eigen::RowVector3f(0, 1, kStandsOff_mm);
  MeshPart tuft;
  tuft.name = "beard";
  tuft.stands_off = true;
  tuft.first_triangle = mesh.triangles.size();
  tuft.triangle_count = 1;
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.parts.push_back(tuft);
  const FaceBinding binding = bindFace(mesh, sampleControl());
  const auto of_the_part = std::lower_bound(binding.carried.begin(), binding.carried.end(), first);
  EXPECT_EQ((std::vector<std::uint32_t>{of_the_part, binding.carried.end()}),
            (std::vector<std::uint32_t>{first, first + 1, first + 2}));
  const FaceDeformer deformer(mesh, sampleControl(), binding);
  const MarkerPositions pose = openMouth(sampleFace(), 10);
  VertexPositions out;
  deformer.deform(pose, {}, out);
  const VertexPositions moves = out - mesh.vertices;
  EXPECT_GT(moves.row(first + 2).norm(), 5);
  EXPECT_LT((moves.row(first) - moves.row((*skin)[0])).norm(), 1e-3F) << "a root goes as the skin does";
  EXPECT_LT((moves.row(first + 2) - moves.row(first)).norm(), 1e-3F) << "and the tip as its root";
}

TEST(Binding, ChecksWhatComesFromFiles) {
  const auto expectRefused = [](auto&& damage) {
    FaceBinding damaged = sampleBinding();
    damage(damaged);
    EXPECT_THROW(checkBinding(damaged, sampleFace().mesh, sampleControl(), "x.face"), InputError);
  };
  EXPECT_NO_THROW(checkBinding(sampleBinding(), sampleFace().mesh, sampleControl(), "x.face"));
  expectRefused([](FaceBinding& b) { b.patch[5] = 100000; });
  expectRefused([](FaceBinding& b) { b.patch[5] = -2; });
  expectRefused([](FaceBinding& b) { b.patch.pop_back(); });
  expectRefused([](FaceBinding& b) { b.d.pop_back(); });
  expectRefused([](FaceBinding& b) { b.u[3] = -1; });
  expectRefused([](FaceBinding& b) { b.u[3] = std::numeric_limits<float>::quiet_NaN(); });
  expectRefused([](FaceBinding& b) { b.skin_weight[3] = 2; });
  expectRefused([](FaceBinding& b) { b.d[3] = std::numeric_limits<float>::infinity(); });
  expectRefused([](FaceBinding& b) { b.carried = {static_cast<std::uint32_t>(b.d.size())}; });
  expectRefused([](FaceBinding& b) { b.carried = {2, 1}; });
  expectRefused([](FaceBinding& b) { b.pressed = {0.1F}; });
  expectRefused([](FaceBinding& b) { b.pressed.assign(kLipColumns, std::numeric_limits<float>::quiet_NaN()); });
  const FaceBinding::Relaxed whole{.vertices = {3, 5}, .ends = {1, 3}, .from = {4, 4, 6}, .weights = {1, 0.5F, 0.5F}};
  const auto expectRefusedRelaxed = [&](const auto& damage) {
    expectRefused([&](FaceBinding& b) {
      b.relaxed = whole;
      damage(b.relaxed);
    });
  };
  FaceBinding relaxed = sampleBinding();
  relaxed.relaxed = whole;
  EXPECT_NO_THROW(checkBinding(relaxed, sampleFace().mesh, sampleControl(), "x.face"));
  using Relaxed = FaceBinding::Relaxed;
  expectRefusedRelaxed([](Relaxed& r) { r.vertices = {5, 3}; });
  expectRefusedRelaxed([](Relaxed& r) { r.vertices[1] = 4'000'000'000U; });
  expectRefusedRelaxed([](Relaxed& r) { r.ends = {3, 1}; });
  expectRefusedRelaxed([](Relaxed& r) { r.ends = {9, 3}; });
  expectRefusedRelaxed([](Relaxed& r) { r.ends.pop_back(); });
  expectRefusedRelaxed([](Relaxed& r) { r.from[0] = 5; });
  expectRefusedRelaxed([](Relaxed& r) { r.from[0] = 4'000'000'000U; });
  expectRefusedRelaxed([](Relaxed& r) { r.weights.pop_back(); });
  expectRefusedRelaxed([](Relaxed& r) { r.weights[0] = -1; });
  expectRefusedRelaxed([](Relaxed& r) { r.weights[0] = 2; });
  expectRefusedRelaxed([](Relaxed& r) { r.weights[0] = std::numeric_limits<float>::quiet_NaN(); });
}

TEST(Relaxing, SpreadsWhatWasTornApart) {
  const FaceMesh& mesh = sampleFace().mesh;
  FaceBinding binding = sampleBinding();
  std::uint32_t torn = 0;
  while (binding.patch[torn] < 0 || binding.skin_weight[torn] < 1) ++torn;
  const HeadTopology topology(mesh, openingsOf(sampleControl()));
  const double reach = 0.2 * sampleControl().mouth_width;
  relaxAround(mesh, topology, {torn}, {}, reach, binding);
  EXPECT_NO_THROW(checkBinding(binding, mesh, sampleControl(), "x.face"));
  const auto& [vertices, ends, from, weights] = binding.relaxed;
  ASSERT_TRUE(std::binary_search(vertices.begin(), vertices.end(), torn));
  std::size_t entry = 0;
  for (std::size_t row = 0; row < vertices.size(); ++row) {
    EXPECT_LE(double{(mesh.vertices.row(vertices[row]) - mesh.vertices.row(torn)).norm()}, reach * 1.0001);
    float sum = 0;
    for (; entry < ends[row]; ++entry) sum += weights[entry];
    EXPECT_NEAR(sum, 1, 1e-4) << "a head that moves as a whole stays whole";
  }
  FaceBinding held = sampleBinding();
  relaxAround(mesh, topology, {torn}, std::vector<bool>(mesh.vertexCount(), true), reach, held);
  for (const std::uint32_t v : held.relaxed.vertices)
    EXPECT_EQ(mesh.vertices.row(v), mesh.vertices.row(torn)) << "the others are held";
  // Steps between neighbours are less than before: that is what harmonic is.
  const FaceDeformer before(mesh, sampleControl(), sampleBinding()), after(mesh, sampleControl(), binding);
  const MarkerPositions markers = openMouth(sampleFace(), 8);
  VertexPositions was, is;
  before.deform({markers, {}}, {}, was);
  after.deform({markers, {}}, {}, is);
  const auto energy = [&](const VertexPositions& moved) {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto a = t[k], b = t[(k + 1) % 3];
        const Eigen::RowVector3f apart = mesh.vertices.row(a) - mesh.vertices.row(b);
        if (apart.norm() > 0) sum += double{(moved.row(a) - moved.row(b) - apart).squaredNorm() / apart.norm()};
      }
    }
    return sum;
  };
  EXPECT_LT(energy(is), energy(was));
  EXPECT_NE(is, was);
  // Of the displacements themselves it is the same, but for the smallest weights.
  VertexPositions moves = was - mesh.vertices;
  SkinRelaxing(mesh, topology, {torn}, {}, reach).relax(moves);
  for (const std::uint32_t v : vertices) EXPECT_LT((mesh.vertices.row(v) + moves.row(v) - is.row(v)).norm(), 0.05F);
  EXPECT_LT(energy(mesh.vertices + moves), energy(was));
}

}  // namespace
}  // namespace mouthpiece
