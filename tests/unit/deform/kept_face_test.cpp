// What is made of a face from its markers to its vertices, held against what was kept.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "deform/kernel/deformer.h"
#include "deform/mouth/jaw.h"
#include "deform/mouth/lip_levelling.h"
#include "deform/mouth/lip_tuck.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/surface_projection.h"
#include "deform/surface/virtual_points.h"
#include "deform/topology/head_topology.h"
#include "tests/unit/deform/kept_numbers.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::openMouth;
using test::KeptNumbers;
using test::numberBetween;

/// A face that is a little askew, with a bump on a cheek, and its vertices 2.5 mm apart.
class KeptFace : public ::testing::Test {
 protected:
  struct Made {
    samples::SampleFace face = samples::makeSampleFace(2.5);
    ControlMesh control;
    FaceBinding binding;
    Made() {
      std::mt19937 random(11);
      for (Eigen::Index v = 0; v < signedIndex(face.skin_vertices); ++v) {
        const float x = face.mesh.vertices(v, 0) - 45, y = face.mesh.vertices(v, 1) + 45;
        face.mesh.vertices(v, 2) += 6 * std::exp(-0.5F * (x * x + y * y) / 36);
      }
      for (double& axis : face.rest.reshaped()) axis += numberBetween(-0.5, 0.5, random);
      control = buildControlMesh(face.names, face.rest, face.known, &face.mesh);
      binding = bindFace(face.mesh, control);
    }
  };
  static const Made& made() {
    static const Made all;
    return all;
  }
  /// The jaw open by so much, the mouth drawn to one side, every marker trembling.
  static MarkerPositions pose(double open_mm, std::mt19937& random) {
    MarkerPositions pose = openMouth(made().face, open_mm);
    for (std::size_t i = 0; i < made().face.names.size(); ++i) {
      const auto row = signedIndex(i);
      if (made().face.names[i].starts_with("LIP_")) pose.row(row) += Eigen::RowVector3d(1.5, 0.02 * pose(row, 0), 2);
      for (Eigen::Index axis = 0; axis < 3; ++axis) pose(row, axis) += numberBetween(-1, 1, random);
    }
    return pose;
  }
  static constexpr double kOpen_mm[] = {-3, 0, 2, 14};
};

TEST_F(KeptFace, ControlMesh) {
  KeptNumbers kept("control mesh");
  const ControlMesh& control = made().control;
  kept.add(control.rest).add(control.domain).add(control.rest_slopes).add(control.mouth_width);
  for (const ControlPoint& point : control.points) {
    kept.add(static_cast<int>(point.rule)).add(static_cast<int>(point.side)).add(point.opposite).add(point.fixed);
    for (const PointDriver& driver : point.drivers) kept.add(driver.point).add(driver.weight);
  }
  for (const auto& [a, b, c] : control.triangles) kept.add(a).add(b).add(c);
  const FaceOpenings openings = openingsOf(control);
  kept.add(openings.lip_line).add(openings.lips_reach);
  for (const FaceOpenings::Sides& sides : openings.sides) kept.add(sides.upper).add(sides.lower);
}

TEST_F(KeptFace, ControlPoints) {
  KeptNumbers kept("control points");
  std::mt19937 random(12);
  samples::SampleFace open = made().face;
  for (auto& [name, place] : open.known) {
    if (name.starts_with("RIM_LO")) place.y() -= 3;
  }
  for (const ControlMesh& control : {made().control, buildControlMesh(open.names, open.rest, open.known)}) {
    kept.add(closingOffsets(control));
    for (const double open_mm : kOpen_mm) {
      std::vector<LipGap> gaps;
      for (std::size_t pair = 0; pair < lipPairs(control).size(); ++pair)
        gaps.push_back({.opened = 0.2 * asReal(pair), .least = 0.1 * asReal(pair % 3), .tuck = 0.3 * asReal(pair % 2)});
      const MarkerPositions markers = pose(open_mm, random);
      kept.add(controlPoints(control, markers)).add(controlPoints(control, {markers, gaps}));
    }
  }
}

TEST_F(KeptFace, SurfaceAndItsFeet) {
  KeptNumbers places("surface", 1e-5), feet("feet on the surface");
  std::mt19937 random(13);
  const BezierSurface surface(made().control);
  const auto moved = surface.pose(controlPoints(made().control, pose(6, random)));
  places.add(surface.maxNormalAngleAcrossEdges(moved));
  for (int t = 0; t < static_cast<int>(made().control.triangles.size()); ++t) {
    const double u = numberBetween(0, 0.6, random), v = numberBetween(0, 0.4, random);
    for (const BezierSurface::Pose* which : {&surface.restPose(), &moved}) {
      const SurfacePoint at = evaluate(*which, SurfacePlace{t, u, v});
      places.add(at.position).add(at.du).add(at.dv);
    }
  }
  const SurfaceProjector projector(surface, made().control, triangleSides(made().control));
  for (int i = 0; i < 300; ++i) {
    const double across = numberBetween(-60, 60, random), up = numberBetween(-90, 80, random);
    const Eigen::Vector3d from(across, up, numberBetween(40, 85, random));
    const auto foot = projector.closest(from, {0.2, 0.1, 1}, 0.3, i % 2 == 0 ? kUpperLip : kLowerLip);
    if (foot) feet.add(evaluate(surface.restPose(), foot->place).position).add(foot->distance).add(foot->at_border);
  }
}

TEST_F(KeptFace, Binding) {
  KeptNumbers kept("binding");
  const auto& [face, control, binding] = made();
  kept.add(binding.d).add(binding.skin_weight).add(binding.jaw_weight).add(binding.carried);
  const BezierSurface surface(control);
  for (std::size_t v = 0; v < face.mesh.vertexCount(); ++v) {
    if (binding.patch[v] >= 0) kept.add(evaluate(surface.restPose(), binding.placeOf(v)).position);
  }
  const BindingReport report = inspectBinding(binding, face.mesh, control);
  kept.add(asReal(report.bound_vertices)).add(report.way_between_lips).add(report.coverage).add(report.largest_offset);
  kept.add(bindFace(face.mesh, control, {.max_normal_angle_deg = 40, .longest_edge = 1.5}).skin_weight);
}

TEST_F(KeptFace, Topology) {
  KeptNumbers kept("topology");
  const HeadTopology topology(made().face.mesh, openingsOf(made().control));
  kept.add(topology.pieces()).add(topology.forbidden());
  for (std::size_t v = 0; v < made().face.mesh.vertexCount(); ++v)
    kept.add(topology.lowerShare(v)).add(topology.isInMouth(v)).add(static_cast<int>(topology.kinds()[v]));
  const auto reach = topology.reachFrom(
      {5, 700}, [](std::uint32_t v) { return v % 11 != 3; }, 4);
  for (const double distance : reach.distance) kept.add(std::isfinite(distance) ? distance : -1);
  kept.add(reach.source);
}

TEST_F(KeptFace, Vertices) {
  std::mt19937 random(14);
  const auto& [face, control, plain] = made();
  FaceBinding mended = plain;
  mended.meets = true;
  for (std::size_t c = 0; c < kLipColumns; ++c) mended.pressed.push_back(asFloat(0.02 * std::sin(asReal(c))));
  VertexPositions closed = face.mesh.vertices;
  for (Eigen::Index v = 0; v < signedIndex(face.skin_vertices); ++v) {
    if (face.is_above_slit[unsignedIndex(v)] && v % 3 == 0) closed(v, 1) += 0.4F;
  }
  LipLevelling(face.mesh, control, mended).level(std::vector{closed}, mended);
  ASSERT_FALSE(mended.levelled.vertices.empty());
  relaxAround(face.mesh, HeadTopology(face.mesh, openingsOf(control)), {400, 900}, {}, 8, mended);
  ASSERT_FALSE(mended.relaxed.vertices.empty());
  for (const auto& [name, binding] : {std::pair("vertices", &plain), {"mended vertices", &mended}}) {
    KeptNumbers kept(name);
    const FaceDeformer deformer(face.mesh, control, *binding);
    for (const double open_mm : kOpen_mm) {
      std::vector<LipGap> gaps(lipPairs(control).size(), {.opened = open_mm > 0 ? 1.0 : 0.0});
      if (open_mm == 2) gaps[1].tuck = gaps[2].tuck = 0.8;
      VertexPositions out;
      deformer.deform({pose(open_mm, random), gaps}, {0.3F, 0.6F, 0.5F}, out);
      kept.add(out - face.mesh.vertices);
    }
  }
}

TEST_F(KeptFace, JawAndTuck) {
  KeptNumbers kept("jaw and tuck");
  std::mt19937 random(15);
  const JawHinge jaw(made().control);
  const LipTuck tuck(made().face.mesh, made().control, 1);
  kept.add(jaw.pivot()).add(tuck.places());
  for (const double open_mm : kOpen_mm) {
    MarkerPositions points = controlPoints(made().control, pose(open_mm, random));
    const AddedMotion motion = jaw.motion(points);
    kept.add(motion.turn).add(motion.shift);
    tuck.apply(std::vector<LipGap>(lipPairs(made().control).size(), {.tuck = 0.7}), points);
    kept.add(points);
  }
}

}  // namespace
}  // namespace mouthpiece
