#include "exports/shapes/principal_shapes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

#include "base/errors.h"
#include "deform/mesh/face_mesh.h"
#include "exports/shapes/trajectories.h"
#include "talking_head.h"

namespace mouthpiece {
namespace {

using samples::makeTalkingHead;
using samples::TalkingHead;

constexpr double kMetresPerMm = 0.001;
/// What 32-bit arithmetic may add when the shapes are summed up in another order.
constexpr double kRoundingMm = 1e-3;

double largestErrorMm(const FaceAnimation& animation, const PrincipalShapes& shapes) {
  double largest = 0;
  for (Eigen::Index f = 0; f < animation.positions.rows(); ++f) {
    const Eigen::RowVectorXd rebuilt =
        shapes.rest.cast<double>() + shapes.weights.row(f).cast<double>() * shapes.shapes.cast<double>();
    const Eigen::RowVectorXd error = animation.positions.row(f).cast<double>() - rebuilt;
    for (Eigen::Index v = 0; v < error.cols() / 3; ++v) largest = std::max(largest, error.segment<3>(3 * v).norm());
  }
  return largest;
}

TEST(PrincipalShapes, KeepsEveryVertexOfEveryFrameWithinTheTolerance) {
  const TalkingHead head = makeTalkingHead();
  for (const double tolerance_mm : {1.0, 0.1, 0.01}) {
    const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm, {tolerance_mm});
    EXPECT_LE(shapes.max_error_mm, tolerance_mm);
    EXPECT_NEAR(largestErrorMm(head.animation, shapes), shapes.max_error_mm, kRoundingMm);
    EXPECT_EQ(shapes.frameCount(), head.animation.positions.rows());
  }
}

TEST(PrincipalShapes, VerticesThatAreLeftOutRest) {
  const TalkingHead head = makeTalkingHead({.ripple_mm = 0.5});
  FaceAnimation some{head.animation.frame_rate_hz, {}, {}};
  for (std::uint32_t v = 1; v < head.mesh.vertices.rows(); v += 3) some.vertices.push_back(v);
  some.positions.resize(head.animation.positions.rows(), 3 * static_cast<Eigen::Index>(some.vertices.size()));
  for (std::size_t i = 0; i < some.vertices.size(); ++i) {
    some.positions.middleCols<3>(3 * static_cast<Eigen::Index>(i)) =
        head.animation.positions.middleCols<3>(3 * Eigen::Index{some.vertices[i]});
  }
  const auto shapes = principalShapes(some, head.mesh.vertices, kMetresPerMm);
  EXPECT_EQ(shapes.vertices, some.vertices);
  EXPECT_EQ(shapes.rest.cols(), head.mesh.vertices.size());
  ASSERT_EQ(shapes.shapes.cols(), some.positions.cols());
  for (std::size_t i = 0; i < some.vertices.size(); ++i) {
    const auto column = 3 * static_cast<Eigen::Index>(i);
    const Eigen::MatrixXf moved = shapes.weights * shapes.shapes.middleCols<3>(column);
    const Eigen::MatrixXf rebuilt = moved.rowwise() + head.mesh.vertices.row(some.vertices[i]);
    EXPECT_LE((rebuilt - some.positions.middleCols<3>(column)).rowwise().norm().maxCoeff(), 0.1F);
  }
  const ShapeNormals normals = shapeNormals(head.mesh.triangles, shapes);
  std::set<std::uint32_t> turned;
  for (const ShapeNormals::Turns& turns : normals.shapes) turned.insert(turns.vertices.begin(), turns.vertices.end());
  EXPECT_GT(turned.size(), some.vertices.size()) << "neighbours turn too";
}

TEST(PrincipalShapes, AHingeTakesFewShapes) {
  const TalkingHead head = makeTalkingHead();
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  // A rotation is no linear motion, yet the start and three shapes (cosine, sine, the narrowing) hold it.
  EXPECT_LE(shapes.shapeCount(), 4);
  EXPECT_GE(shapes.shapeCount(), 2);
}

TEST(PrincipalShapes, TheToleranceIsInMillimetresWhateverTheUnit) {
  TalkingHead head = makeTalkingHead({.ripple_mm = 0.5});
  const auto in_mm = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm, {0.05});
  head.animation.positions *= 0.001F;
  head.mesh.vertices *= 0.001F;
  const auto in_metres = principalShapes(head.animation, head.mesh.vertices, 1.0, {0.05});
  EXPECT_LE(in_metres.max_error_mm, 0.05);
  EXPECT_NEAR(static_cast<double>(in_metres.shapeCount()), static_cast<double>(in_mm.shapeCount()), 1);
}

// Blender 3.4 cuts a shape key's value to [0, 1]: it widens the range only to the first key of the animation.
TEST(PrincipalShapes, WeightsFillZeroToOneAndStillVerticesStayStill) {
  const TalkingHead head = makeTalkingHead({.ripple_mm = 0.5});
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  ASSERT_GT(shapes.shapeCount(), 0);
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k) {
    EXPECT_EQ(shapes.weights.col(k).maxCoeff(), 1.0F) << "shape " << k;
    EXPECT_EQ(shapes.weights.col(k).minCoeff(), k == 0 ? 1.0F : 0.0F) << "shape " << k;
  }
  const MeshPart& eyes = head.mesh.parts[2];
  for (std::size_t t = eyes.first_triangle; t < eyes.first_triangle + eyes.triangle_count; ++t) {
    for (const std::uint32_t vertex : head.mesh.triangles[t])
      EXPECT_TRUE(shapes.shapes.middleCols<3>(3 * vertex).isZero(0));
  }
}

// One vertex moves in a way of its own, between the vertices that the sample looks at.
TEST(PrincipalShapes, FindsWhatTheSampleMissed) {
  TalkingHead head = makeTalkingHead({.rings = 60, .segments = 64});
  constexpr Eigen::Index kLonely = 1001;
  for (Eigen::Index f = 0; f < head.animation.positions.rows(); ++f) {
    head.animation.positions(f, 3 * kLonely) += f % 7 == 0 ? 2.0F : 0.0F;
    head.animation.positions(f, 3 * kLonely + 1) += f % 11 == 0 ? 3.0F : 0.0F;
  }
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  EXPECT_LE(largestErrorMm(head.animation, shapes), 0.1);
}

TEST(PrincipalShapes, NoiseThatNoShapeSharesIsStillWithinTheTolerance) {
  TalkingHead head = makeTalkingHead({.frames = 40, .rings = 8, .segments = 12});
  std::srand(3);
  head.animation.positions +=
      decltype(head.animation.positions)::Random(head.animation.positions.rows(), head.animation.positions.cols());
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  EXPECT_LE(largestErrorMm(head.animation, shapes), 0.1);
  EXPECT_LE(shapes.shapeCount(), 2 * 40);
}

TEST(PrincipalShapes, AFaceAtRestHasNoShapes) {
  TalkingHead head = makeTalkingHead({.frames = 10});
  head.animation.positions.rowwise() = head.animation.positions.row(0).eval();
  head.mesh.vertices = Eigen::Map<const VertexPositions>(head.animation.positions.data(), head.mesh.vertices.rows(), 3);
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  EXPECT_EQ(shapes.shapeCount(), 0);
  EXPECT_EQ(shapes.frameCount(), 10);
  EXPECT_EQ(shapes.max_error_mm, 0);
}

TEST(PrincipalShapes, OneFrameAndFewVerticesWork) {
  TalkingHead head = makeTalkingHead({.frames = 31, .rings = 2, .segments = 3});
  head.animation.positions = head.animation.positions.middleRows(7, 1).eval();
  const auto shapes = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  EXPECT_EQ(shapes.shapeCount(), 2);
  EXPECT_LE(largestErrorMm(head.animation, shapes), 0.1);
}

TEST(PrincipalShapes, IsDeterministic) {
  const TalkingHead head = makeTalkingHead({.ripple_mm = 0.3});
  const auto first = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  const auto second = principalShapes(head.animation, head.mesh.vertices, kMetresPerMm);
  EXPECT_TRUE(first.shapes == second.shapes);
  EXPECT_TRUE(first.weights == second.weights);
}

/// A line that goes on for minutes: what the head does in its two seconds, a little stronger each time, and once,
/// between two frames that a sample would take, what it does nowhere else.
FrameMaker longLine(const TalkingHead& head, Eigen::Index frame_count, Eigen::Index odd_frame, float odd_mm = 4) {
  FrameMaker frames{head.animation.frame_rate_hz, frame_count, head.animation.positions.cols(), {}, {}};
  frames.make = [&head, odd_frame, odd_mm](Eigen::Index f, std::span<float> out) {
    const Eigen::Index length = head.animation.positions.rows();
    const float strength = 1 + 0.1F * static_cast<float>(f / length);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const float rest = head.mesh.vertices.data()[i];
      out[i] = rest + strength * (head.animation.positions(f % length, static_cast<Eigen::Index>(i)) - rest);
      if (f == odd_frame && i < 300) out[i] += odd_mm;
    }
  };
  return frames;
}

TEST(PrincipalShapes, ALineOfMinutesIsWithinTheToleranceInEveryFrame) {
  const TalkingHead head = makeTalkingHead({.rings = 12, .segments = 16, .ripple_mm = 0.5});
  const Eigen::Index odd_frame = 3001;
  const FrameMaker frames = longLine(head, 4100, odd_frame);
  const PrincipalShapes shapes = principalShapes(frames, head.mesh.vertices, kMetresPerMm);
  ASSERT_EQ(shapes.frameCount(), frames.frame_count);
  EXPECT_LE(shapes.max_error_mm, 0.09);
  EXPECT_NEAR(largestErrorMm(frames.all(), shapes), shapes.max_error_mm, kRoundingMm);
  EXPECT_GE(shapes.weights.minCoeff(), 0);
  for (Eigen::Index k = 0; k < shapes.shapeCount(); ++k) EXPECT_NEAR(shapes.weights.col(k).maxCoeff(), 1, 1e-6) << k;
  // The odd frame has a shape that no other has, or nearly so.
  Eigen::Index own = 0;
  for (Eigen::Index k = 1; k < shapes.shapeCount(); ++k) {
    Eigen::VectorXf weights = (shapes.weights.col(k).array() - shapes.weights(0, k)).abs();
    const float there = weights(odd_frame);
    weights(odd_frame) = 0;
    if (there > 2 * weights.maxCoeff()) ++own;
  }
  EXPECT_EQ(own, 1);
}

/// Further than steps reach: those frames are held as they are, the others as steps.
TEST(PrincipalShapes, AVertexThatGoesFarOnceInALineOfMinutesIsWithinTheTolerance) {
  const TalkingHead head = makeTalkingHead({.rings = 12, .segments = 16, .ripple_mm = 0.5});
  const FrameMaker frames = longLine(head, 2100, 901, 60);
  const PrincipalShapes shapes = principalShapes(frames, head.mesh.vertices, kMetresPerMm);
  EXPECT_LE(shapes.max_error_mm, 0.09);
  EXPECT_LE(largestErrorMm(frames.all(), shapes), shapes.max_error_mm + kRoundingMm);
}

/// One frame in three tells a line's shapes; what happens between them is measured and held all the same.
TEST(PrincipalShapes, WhatNoTellingFrameShowsIsWithinTheTolerance) {
  const TalkingHead head = makeTalkingHead({.rings = 12, .segments = 16, .ripple_mm = 0.5});
  for (const Eigen::Index odd_frame : {301, 302, 303}) {
    const FrameMaker frames = longLine(head, 700, odd_frame);
    const PrincipalShapes shapes = principalShapes(frames, head.mesh.vertices, kMetresPerMm);
    ASSERT_EQ(shapes.frameCount(), frames.frame_count);
    EXPECT_LE(shapes.max_error_mm, 0.09);
    EXPECT_NEAR(largestErrorMm(frames.all(), shapes), shapes.max_error_mm, 0.002) << odd_frame;
  }
}

TEST(PrincipalShapes, AFaceThatRestsForMinutesAndThenMovesOnceMoves) {
  TalkingHead head = makeTalkingHead({.rings = 6, .segments = 8});
  for (Eigen::Index f = 0; f < head.animation.positions.rows(); ++f)
    head.animation.positions.row(f) =
        Eigen::Map<const Eigen::RowVectorXf>(head.mesh.vertices.data(), head.mesh.vertices.size());
  const FrameMaker frames = longLine(head, 1999, 1111);
  const PrincipalShapes shapes = principalShapes(frames, head.mesh.vertices, kMetresPerMm);
  EXPECT_EQ(shapes.shapeCount(), 2);
  EXPECT_LE(largestErrorMm(frames.all(), shapes), 0.09);
}

TEST(PrincipalShapes, RefusesWhatIsNoNumber) {
  TalkingHead head = makeTalkingHead({.frames = 10});
  head.animation.positions(4, 100) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(principalShapes(head.animation, head.mesh.vertices, kMetresPerMm), InternalError);
}

TEST(TrajectoryBasis, IsFoundInTheFramesThatDoNotTellIt) {
  const Eigen::MatrixXf moves = Eigen::MatrixXf::Random(90, 4) * Eigen::MatrixXf::Random(4, 60);
  const Eigen::MatrixXf basis = trajectoryBasis(moves.topRows(30), 1e-4F);
  const Eigen::MatrixXf all = basisInAllFrames(basis, moves);
  ASSERT_EQ(all.rows(), moves.rows());
  EXPECT_TRUE(all.topRows(30) == basis);
  EXPECT_LE((moves - all * (basis.transpose() * moves.topRows(30))).cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_TRUE(basisInAllFrames(basis, moves.topRows(30)) == basis);
}

TEST(LeadingTrajectories, SpanALowRankMatrix) {
  std::srand(11);
  const Eigen::MatrixXf trajectories = Eigen::MatrixXf::Random(90, 5) * Eigen::MatrixXf::Random(5, 300);
  const Eigen::MatrixXf basis = leadingTrajectories(trajectories, 5);
  ASSERT_EQ(basis.cols(), 5);
  EXPECT_TRUE((basis.transpose() * basis).isIdentity(1e-4F));
  EXPECT_LT((trajectories - basis * (basis.transpose() * trajectories)).cwiseAbs().maxCoeff(), 1e-3F);
}

}  // namespace
}  // namespace mouthpiece
