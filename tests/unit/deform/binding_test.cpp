#include "deform/surface/binding.h"
#include "deform/surface/left_out.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "deform/kernel/deformer.h"
#include "deform/mesh/face_mesh.h"
#include "deform/surface/bezier_surface.h"
#include "deform/surface/virtual_points.h"
#include "support/error_of.h"
#include "tests/unit/deform/sample_face.h"

namespace mouthpiece {
namespace {

using samples::openMouth;
using samples::sampleBinding;
using samples::sampleControl;
using samples::sampleFace;

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

/// What coarse lips have behind their rims is an edge away from these, however long that is.
TEST(Binding, MotionFadesOverLongEdgesAsIfTheyWereShort) {
  constexpr float kBehindMm = 30;
  FaceMesh mesh = sampleFace().mesh;
  std::uint32_t rim = 0;  // the upper lip's, in its middle
  const Eigen::RowVector3f middle = sampleControl().rest.row(lipPairs(sampleControl())[2].upper_rim).cast<float>();
  for (std::uint32_t v = 0; v < sampleFace().skin_vertices; ++v) {
    const auto off = [&](std::uint32_t of) { return (mesh.vertices.row(of) - middle).norm(); };
    if (sampleFace().is_above_slit[v] && off(v) < off(rim)) rim = v;
  }
  const auto first = static_cast<std::uint32_t>(mesh.vertexCount());
  mesh.vertices.conservativeResize(signedIndex(first) + 2, Eigen::NoChange);
  for (std::uint32_t k = 0; k < 2; ++k)
    mesh.vertices.row(first + k) = mesh.vertices.row(rim) + Eigen::RowVector3f(asFloat(k), 0, -kBehindMm);
  mesh.parts.push_back(
      {.name = "wall", .kind = PartKind::kMouthInside, .first_triangle = mesh.triangles.size(), .triangle_count = 1});
  mesh.triangles.push_back({rim, first, first + 1});
  const FaceBinding far = bindFace(mesh, sampleControl()),
                    near = bindFace(mesh, sampleControl(), {.longest_edge = 0.06});
  EXPECT_EQ(far.skin_weight[first], 0);
  EXPECT_GT(near.skin_weight[first], 0.8F * near.skin_weight[rim]);
  ASSERT_GE(near.patch[first], 0);
  EXPECT_EQ(sampleControl().sideOf(static_cast<std::size_t>(near.patch[first])), LipSide::kUpper);
}

/// A vertex of a coarse lip's rim that faces backwards, and hangs on the mesh by the skin beside the mouth's corner
/// only.
TEST(Binding, RimsOfCoarseLipsHangWhereTheyLie) {
  FaceMesh mesh = sampleFace().mesh;
  const auto nearestRim = [&](const char* name) {
    const Eigen::RowVector3f place = sampleControl().rest.row(findPoint(sampleControl(), name)).cast<float>();
    std::uint32_t nearest = 0;
    for (std::uint32_t v = 0; v < sampleFace().skin_vertices; ++v) {
      const auto off = [&](std::uint32_t of) { return (mesh.vertices.row(of) - place).norm(); };
      if (sampleFace().is_above_slit[v] && off(v) < off(nearest)) nearest = v;
    }
    return nearest;
  };
  const std::uint32_t beside = nearestRim("RIM_UP_OUT_R"), above = nearestRim("LIP_UP_OUT_R");
  ASSERT_NE(beside, above);
  const auto rim = static_cast<std::uint32_t>(mesh.vertexCount());
  mesh.vertices.conservativeResize(signedIndex(rim) + 1, Eigen::NoChange);
  mesh.vertices.row(rim) = sampleControl().rest.row(findPoint(sampleControl(), "RIM_UP_MID")).cast<float>();
  mesh.parts.push_back(
      {.name = "rim", .kind = PartKind::kSkin, .first_triangle = mesh.triangles.size(), .triangle_count = 1});
  mesh.triangles.push_back({beside, above, rim});
  ASSERT_LT(vertexNormals(mesh.vertices, {mesh.triangles.back()})(rim, 2), 0) << "faces backwards";
  const FaceBinding binding = bindFace(mesh, sampleControl());
  ASSERT_GE(binding.patch[rim], 0);
  EXPECT_EQ(binding.skin_weight[rim], 1);
  EXPECT_EQ(sampleControl().sideOf(static_cast<std::size_t>(binding.patch[rim])), LipSide::kUpper);
  const SurfacePoint place = evaluate(BezierSurface(sampleControl()).restPose(), binding.placeOf(rim));
  EXPECT_LT((place.position - pointAt(mesh.vertices, rim)).norm(), 0.02 * sampleControl().mouth_width);
}

TEST(Binding, TellsLipsThatAreOneSurface) {
  const BindingReport apart = inspectBinding(sampleBinding(), sampleFace().mesh, sampleControl());
  EXPECT_GT(apart.way_between_lips, 1);
  EXPECT_FALSE(apart.lips_are_one);
  // The slit sewn up: of vertices in one place all triangles take the first.
  FaceMesh sewn = sampleFace().mesh;
  std::map<std::array<float, 3>, std::uint32_t> first;
  for (Triangle& triangle : sewn.triangles) {
    for (std::uint32_t& corner : triangle) {
      const auto place = sewn.vertices.row(static_cast<Eigen::Index>(corner));
      corner = first.try_emplace({place.x(), place.y(), place.z()}, corner).first->second;
    }
  }
  const BindingReport one = inspectBinding(sampleBinding(), sewn, sampleControl());
  EXPECT_LT(one.way_between_lips, 0.6);
  EXPECT_TRUE(one.lips_are_one);
}

/// On coarse heads the slit ends further in than the mouth's corners are.
TEST(Binding, LipsThatPartBetweenCornersFurtherInAreTwo) {
  const auto across = [](const char* name) { return sampleControl().rest(findPoint(sampleControl(), name), 0); };
  const double middle = 0.5 * (across("LIP_CORNER_R") + across("LIP_CORNER_L"));
  const double beyond = 0.25 * (across("LIP_CORNER_L") - across("LIP_CORNER_R"));
  FaceMesh sewn = sampleFace().mesh;
  std::map<std::array<float, 3>, std::uint32_t> first;
  for (Triangle& triangle : sewn.triangles) {
    for (std::uint32_t& corner : triangle) {
      const auto place = sewn.vertices.row(static_cast<Eigen::Index>(corner));
      if (std::abs(double{place.x()} - middle) < beyond) continue;
      corner = first.try_emplace({place.x(), place.y(), place.z()}, corner).first->second;
    }
  }
  EXPECT_GT(inspectBinding(sampleBinding(), sewn, sampleControl()).way_between_lips, 0.9);
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

TEST(Binding, TellsWhichPartIsLeftOutAndWhy) {
  EXPECT_EQ(skinLeftOut(sampleBinding(), sampleFace().mesh, sampleControl()).part, "") << "nothing is";
  // Some of the face is of another part and hangs on nothing.
  FaceMesh mesh = sampleFace().mesh;
  MeshPart& skin = mesh.parts[0];
  const auto first = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(skin.first_triangle);
  const auto last = first + static_cast<std::ptrdiff_t>(skin.triangle_count);
  const auto is_right = [&](const Triangle& t) { return mesh.vertices(t[0], 0) >= -10; };
  const auto border = std::stable_partition(first, last, is_right);
  MeshPart left = skin;
  left.name = "Material.007";
  left.first_triangle = static_cast<std::size_t>(border - mesh.triangles.begin());
  left.triangle_count = static_cast<std::size_t>(last - border);
  skin.triangle_count -= left.triangle_count;
  mesh.parts.insert(mesh.parts.begin() + 1, left);
  FaceBinding binding = sampleBinding();
  for (const Triangle& t : trianglesOf(mesh, mesh.parts[1])) {
    for (const std::uint32_t v : t) binding.patch[v] = -1;
  }
  const SkinLeftOut told = skinLeftOut(binding, mesh, sampleControl());
  EXPECT_EQ(told.part, "Material.007");
  EXPECT_FALSE(told.is_of_face);
  EXPECT_GT(told.vertices, told.all * 9 / 10);
  EXPECT_LT(told.median_distance, 0.1);
  EXPECT_LT(told.median_angle_deg, 30);
}

/// A figure's hands may have more vertices than its face, and hang together where they are folded.
TEST(Binding, TheFaceIsThePieceThatTheMarkersLieOn) {
  FaceMesh mesh = sampleFace().mesh;
  const auto first = static_cast<std::uint32_t>(mesh.vertices.rows());
  const auto count = static_cast<std::uint32_t>(sampleFace().skin_vertices + 100);
  mesh.vertices.conservativeResize(first + count, 3);
  for (std::uint32_t i = 0; i < count; ++i)
    mesh.vertices.row(first + i) << static_cast<float>(i), static_cast<float>(i % 2) - 400, 0;
  MeshPart hands;
  hands.name = "hands";
  hands.first_triangle = mesh.triangles.size();
  hands.triangle_count = count - 2;
  for (std::uint32_t i = first; i + 2 < first + count; ++i) mesh.triangles.push_back({i, i + 1, i + 2});
  mesh.parts.push_back(hands);
  const FaceBinding binding = bindFace(mesh, sampleControl());
  EXPECT_TRUE(std::equal(sampleBinding().patch.begin(), sampleBinding().patch.end(), binding.patch.begin()));
  EXPECT_EQ(std::count(binding.patch.begin() + first, binding.patch.end(), -1), std::ptrdiff_t{count});
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

/// Each is told with what was found and what was expected.
TEST(Binding, ChecksWhatComesFromFiles) {
  const auto said = [](const FaceBinding& binding) {
    return errorOf([&] { checkBinding(binding, sampleFace().mesh, sampleControl(), "x.face"); });
  };
  const auto after = [&](auto&& damage) {
    FaceBinding damaged = sampleBinding();
    damage(damaged);
    return said(damaged);
  };
  ASSERT_EQ(said(sampleBinding()), "no error");
  const std::string count = std::to_string(sampleBinding().d.size()),
                    patches = std::to_string(sampleControl().triangles.size() - 1), in = "x.face:binding: found ";
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN(), kFar = std::numeric_limits<float>::infinity();
  EXPECT_EQ(after([](FaceBinding& b) { b.patch[5] = 100000; }), in + "patch 100000; expected -1 to " + patches);
  EXPECT_EQ(after([](FaceBinding& b) { b.patch[5] = static_cast<int>(sampleControl().triangles.size()); }),
            in + "patch " + std::to_string(sampleControl().triangles.size()) + "; expected -1 to " + patches);
  EXPECT_EQ(after([](FaceBinding& b) { b.patch[5] = -2; }), in + "patch -2; expected -1 to " + patches);
  EXPECT_EQ(after([](FaceBinding& b) { b.patch.clear(); }), in + "0 vertices; expected " + count);
  EXPECT_EQ(after([](FaceBinding& b) { b.d.pop_back(); }),
            in + "columns of different lengths; expected " + count + " entries each");
  const std::string out_of_range = in + "vertex 3 out of range";
  for (const float value : {-0.001F, 1.001F, 2.0F, kNone, kFar}) {
    EXPECT_EQ(after([&](FaceBinding& b) { b.u[3] = value; }), out_of_range) << value;
    EXPECT_EQ(after([&](FaceBinding& b) { b.v[3] = value; }), out_of_range) << value;
    EXPECT_EQ(after([&](FaceBinding& b) { b.skin_weight[3] = value; }), out_of_range) << value;
    EXPECT_EQ(after([&](FaceBinding& b) { b.jaw_weight[3] = value; }), out_of_range) << value;
  }
  EXPECT_EQ(after([](FaceBinding& b) { b.u[3] = b.v[3] = 0.6F; }), out_of_range) << "beyond the triangle's long side";
  EXPECT_EQ(after([](FaceBinding& b) { b.d[3] = -kFar; }), out_of_range);
  const std::string rising = "; expected rising numbers under " + count;
  EXPECT_EQ(after([](FaceBinding& b) { b.carried = {static_cast<std::uint32_t>(b.d.size())}; }),
            in + "carried vertex " + count + rising);
  EXPECT_EQ(after([](FaceBinding& b) { b.carried = {2, 1}; }), in + "carried vertex 1" + rising);
  EXPECT_EQ(after([](FaceBinding& b) { b.carried = {2, 2}; }), in + "carried vertex 2" + rising);
  EXPECT_EQ(after([](FaceBinding& b) { b.pressed = {0.1F}; }),
            in + "1 columns of lips; expected " + std::to_string(kLipColumns));
  for (const float value : {kNone, kFar, -2 * asFloat(sampleControl().mouth_width)}) {
    EXPECT_EQ(after([&](FaceBinding& b) { b.pressed.assign(kLipColumns, value); }),
              in + "lips that are pressed by no usable length");
    EXPECT_EQ(after([&](FaceBinding& b) {
                b.levelled = {{3}, {value}};
              }),
              in + "lips that are levelled by no usable length");
  }
  EXPECT_EQ(after([](FaceBinding& b) { b.levelled = {{3}, {}}; }), in + "levelled lips of different lengths");
  EXPECT_EQ(after([](FaceBinding& b) { b.levelled = {{4, 4}, {0, 0}}; }), in + "levelled vertex 4" + rising);
  EXPECT_EQ(after([](FaceBinding& b) {
              b.levelled = {{0, static_cast<std::uint32_t>(b.d.size())}, {0, 0}};
            }),
            in + "levelled vertex " + count + rising);
  FaceMesh tiny = sampleFace().mesh;
  tiny.vertices *= 0.01F;
  EXPECT_EQ(errorOf([&] { checkBinding(sampleBinding(), tiny, sampleControl(), "x.face"); }),
            in + "a mouth wider than the mesh");
}

TEST(Binding, ChecksRowsOfRelaxedSkin) {
  using Relaxed = FaceBinding::Relaxed;
  const auto after = [&](const auto& damage) {
    FaceBinding binding = sampleBinding();
    binding.relaxed = {.vertices = {3, 5}, .ends = {1, 3}, .from = {4, 4, 6}, .weights = {1, 0.5F, 0.5F}};
    damage(binding.relaxed);
    return errorOf([&] { checkBinding(binding, sampleFace().mesh, sampleControl(), "x.face"); });
  };
  ASSERT_EQ(after([](Relaxed&) {}), "no error");
  const std::string count = std::to_string(sampleBinding().d.size()), in = "x.face:binding: found ";
  const std::string rising = "; expected rising numbers under " + count,
                    columns =
                        in + "relaxed columns of different lengths; expected a row a vertex and a weight an entry",
                    share = in + "a relaxed weight that is no share";
  EXPECT_EQ(after([](Relaxed& r) { r.vertices = {5, 3}; }), in + "relaxed vertex 3" + rising);
  EXPECT_EQ(after([](Relaxed& r) { r.vertices = {5, 5}; }), in + "relaxed vertex 5" + rising);
  EXPECT_EQ(after([&](Relaxed& r) { r.vertices[1] = static_cast<std::uint32_t>(std::stoul(count)); }),
            in + "relaxed vertex " + count + rising);
  EXPECT_EQ(after([](Relaxed& r) { r.ends[0] = 9; }),
            in + "a relaxed row that ends at 9; expected rising ends up to 3");
  EXPECT_EQ(after([](Relaxed& r) {
              r.vertices.push_back(7);
              r.ends = std::vector<std::uint32_t>{2, 1, 3};
              r.weights.assign(3, 0.5F);
            }),
            in + "a relaxed row that ends at 1; expected rising ends up to 3");
  EXPECT_EQ(after([](Relaxed& r) { r.ends.pop_back(); }), columns);
  EXPECT_EQ(after([](Relaxed& r) { std::swap(r.ends[0], r.ends[1]); }), columns);
  EXPECT_EQ(after([](Relaxed& r) { r.weights.pop_back(); }), columns);
  EXPECT_EQ(after([](Relaxed& r) { r.vertices.clear(), r.ends.clear(); }), columns);
  EXPECT_EQ(after([](Relaxed& r) { r.from[0] = 5; }),
            in + "vertex 5 of a relaxed one; expected one under " + count + " that is not relaxed");
  EXPECT_EQ(after([&](Relaxed& r) { r.from[2] = static_cast<std::uint32_t>(std::stoul(count)); }),
            in + "vertex " + count + " of a relaxed one; expected one under " + count + " that is not relaxed");
  EXPECT_EQ(after([](Relaxed& r) { r.weights[0] = -1; }), share);
  EXPECT_EQ(after([](Relaxed& r) { r.weights[2] = std::numeric_limits<float>::quiet_NaN(); }), share);
  EXPECT_EQ(after([](Relaxed& r) { r.weights[2] = 0.75F; }),
            in + "weights of 1.25 in a relaxed row; expected 1 at most");
}

/// Skin whose edges are longer than the reach is relaxed in rings where they count as shorter.
TEST(Relaxing, ReachesOverLongEdgesThatCountAsShort) {
  const FaceMesh& mesh = sampleFace().mesh;
  std::uint32_t torn = 0;
  while (sampleBinding().patch[torn] < 0 || sampleBinding().skin_weight[torn] < 1) ++torn;
  const HeadTopology topology(mesh, openingsOf(sampleControl()));
  const double reach = 1e-3 * sampleControl().mouth_width;
  const auto relaxedWithin = [&](double longest) {
    FaceBinding binding = sampleBinding();
    relaxAround(mesh, topology, {torn}, {}, reach, binding, longest);
    return binding.relaxed.vertices;
  };
  EXPECT_EQ(relaxedWithin(std::numeric_limits<double>::infinity()), std::vector<std::uint32_t>{torn});
  const std::vector<std::uint32_t> one_ring = relaxedWithin(0.6 * reach), two_rings = relaxedWithin(0.4 * reach);
  EXPECT_GT(one_ring.size(), 3U);
  EXPECT_GT(two_rings.size(), one_ring.size() + 3);
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
  EXPECT_EQ(held.relaxed.vertices, std::vector<std::uint32_t>{torn}) << "one alone, too";
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
