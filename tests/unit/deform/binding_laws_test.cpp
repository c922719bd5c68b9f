// How much of the surface's motion a vertex takes, by where it stands: lengths are shares of the mouth's width.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <vector>

#include "base/smooth_step.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/binding.h"
#include "deform/surface/virtual_points.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::sampleBinding;
using samples::sampleControl;
using samples::sampleFace;

double width() { return sampleControl().mouth_width; }

/// The skin's vertex nearest to a marker.
std::uint32_t skinAt(const char* marker) {
  const Eigen::RowVector3f place = sampleControl().rest.row(findPoint(sampleControl(), marker)).cast<float>();
  Eigen::Index nearest = 0;
  (sampleFace().mesh.vertices.topRows(signedIndex(sampleFace().skin_vertices)).rowwise() - place)
      .rowwise()
      .squaredNorm()
      .minCoeff(&nearest);
  return static_cast<std::uint32_t>(nearest);
}

/// Out of the skin where a vertex of it hangs.
Eigen::RowVector3f outOf(std::uint32_t v) {
  const BezierSurface surface(sampleControl());
  return evaluate(surface.restPose(), sampleBinding().placeOf(v)).normal().transpose().cast<float>();
}

/// Adds a part of its own; returns its first vertex.
std::uint32_t addPart(FaceMesh& mesh, PartKind kind, const VertexPositions& vertices,
                      const std::vector<Triangle>& triangles) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(first + vertices.rows(), Eigen::NoChange);
  mesh.vertices.bottomRows(vertices.rows()) = vertices;
  mesh.parts.push_back(
      {.name = "added", .kind = kind, .first_triangle = mesh.triangles.size(), .triangle_count = triangles.size()});
  for (const Triangle& t : triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return first;
}

TEST(BindingLaws, WhatStandsOffTheSurfaceTakesLessOfItsMotion) {
  const std::map<const char*, std::vector<double>> offs{{"CHEEK_MID_R", {0.2, 0.49}},
                                                        {"CHEEK_BONE_L", {0.29, 0.45}},
                                                        {"CHIN_MID", {0.35, 0.53}},
                                                        {"JAW_FRONT_L", {0.4, 0.51}}};
  for (const std::size_t i : {0U, 1U}) {
    FaceMesh mesh = sampleFace().mesh;
    for (const auto& [marker, off] : offs) {
      const std::uint32_t v = skinAt(marker);
      ASSERT_EQ(sampleBinding().skin_weight[v], 1) << marker;
      mesh.vertices.row(v) += asFloat(off[i] * width()) * outOf(v);
    }
    const FaceBinding binding = bindFace(mesh, sampleControl());
    for (const auto& [marker, off] : offs)
      EXPECT_NEAR(binding.skin_weight[skinAt(marker)], off[i] < 0.5 ? 1 - smoothStep((off[i] - 0.3) / 0.2) : 0, 0.03)
          << marker << off[i];
  }
}

/// A wall that goes in from the skin, as a nostril's does, faces as no skin before it: it goes along with where it
/// begins, and less the further in, by its way along the mesh.
TEST(BindingLaws, WhatGoesInFadesAlongTheMesh) {
  FaceMesh mesh = sampleFace().mesh;
  const std::uint32_t from = skinAt("CHEEK_MID_R");
  std::uint32_t beside = from;
  for (const Triangle& t : mesh.triangles) {  // its neighbour to the subject's left
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t to = t[(k + 1) % 3];
      if (t[k] == from && mesh.vertices(to, 0) > mesh.vertices(beside, 0) &&
          std::abs(mesh.vertices(to, 1) - mesh.vertices(from, 1)) < 0.1F)
        beside = to;
    }
  }
  ASSERT_NE(beside, from);
  constexpr std::uint32_t kSteps = 12;
  const double step = 0.4 * width() / kSteps;
  const Eigen::RowVector3f in = -asFloat(step) * outOf(from);
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(first + 2 * kSteps, Eigen::NoChange);
  mesh.parts.push_back(
      {.name = "wall", .kind = PartKind::kSkin, .first_triangle = mesh.triangles.size(), .triangle_count = 2 * kSteps});
  std::uint32_t a = from, b = beside;
  for (std::uint32_t k = 0; k < kSteps; ++k) {
    const std::uint32_t c = first + 2 * k, d = c + 1;
    mesh.vertices.row(c) = mesh.vertices.row(from) + asFloat(k + 1) * in;
    mesh.vertices.row(d) = mesh.vertices.row(beside) + asFloat(k + 1) * in;
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({c, b, d});
    a = c;
    b = d;
  }
  const FaceBinding binding = bindFace(mesh, sampleControl());
  ASSERT_EQ(binding.skin_weight[from], 1);
  for (std::uint32_t k = 0; k < kSteps; ++k) {
    const std::uint32_t v = first + 2 * k;
    const double way = step * (k + 1), expected = 1 - smoothStep(way / (0.35 * width()));
    EXPECT_NEAR(binding.skin_weight[v], expected, 1e-4) << way / width();
    EXPECT_EQ(binding.patch[v] >= 0, expected > 0) << way / width();
    EXPECT_EQ(isCarried(binding, v), expected > 0) << "it does not swing out: " << way / width();
  }
}

/// Gums that hang on nothing are the jaw's where they are below the line between the lips.
TEST(BindingLaws, GumsBelowTheMouthsLineAreTheJaws) {
  const VertexPositions sheet{{-1, 0, 0}, {1, 0, 0}, {0, 0, -10}};
  const Eigen::RowVector3f middle = sampleControl().rest.row(findPoint(sampleControl(), "RIM_UP_MID")).cast<float>();
  FaceMesh mesh = sampleFace().mesh;
  std::map<float, std::uint32_t> gums;  // by height
  for (const float height : {-8.0F, -1.0F, 1.0F, 8.0F})
    gums[height] = addPart(mesh, PartKind::kMouthInside,
                           sheet.rowwise() + (middle + Eigen::RowVector3f(height, height, -30)), {{0, 1, 2}});
  const FaceBinding binding = bindFace(mesh, sampleControl());
  for (const auto& [height, v] : gums) {
    EXPECT_EQ(binding.jaw_weight[v], height < 0 ? 1 : 0) << height;
    EXPECT_EQ(binding.patch[v], -1) << height;
  }
}

/// Lashes, beards and the like: what comes near the skin hangs on it whole, what hovers before it stays.
TEST(BindingLaws, LoosePartsNearTheSkinGoAlongWhole) {
  const std::map<const char*, double> offs{
      {"CHIN_MID", 0.02}, {"CHEEK_MID_R", 0.1}, {"CHEEK_BONE_L", 0.29}, {"JAW_FRONT_L", 0.32}, {"CHEEK_LOW_R", 0.5}};
  FaceMesh mesh = sampleFace().mesh;
  std::map<const char*, std::uint32_t> hairs;
  for (const auto& [marker, off] : offs) {
    const std::uint32_t skin = skinAt(marker);
    const Eigen::RowVector3f out = asFloat(width()) * outOf(skin), root = mesh.vertices.row(skin) + asFloat(off) * out;
    VertexPositions hair(3, 3);
    hair << root, root + Eigen::RowVector3f(0.1F, 0, 0), root + 0.4F * out;
    hairs[marker] = addPart(mesh, PartKind::kOther, hair, {{0, 1, 2}});
  }
  const FaceBinding binding = bindFace(mesh, sampleControl());
  for (const auto& [marker, v] : hairs) {
    const bool is_near = offs.at(marker) < 0.3;
    for (const std::uint32_t at : {v, v + 1, v + 2}) {
      EXPECT_EQ(binding.skin_weight[at], is_near ? 1 : 0) << marker;
      EXPECT_EQ(isCarried(binding, at), is_near) << marker;
    }
    EXPECT_EQ(binding.patch[v + 2], binding.patch[v]) << "the tip hangs where the root does: " << marker;
  }
}

}  // namespace
}  // namespace mouthpiece
