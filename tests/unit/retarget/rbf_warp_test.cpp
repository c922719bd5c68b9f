// The volume warp of EDGE 6 (docs/theory/retarget/volume_warp.md).
#include "retarget/warp/rbf_warp.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <random>

#include "base/errors.h"

namespace mouthpiece {
namespace {

constexpr double kExactMm = 1e-6;  ///< the promise at the landmarks
constexpr Eigen::Index kMarkers = 66;

MarkerPositions scattered(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-80, 80);
  MarkerPositions points(kMarkers, 3);
  for (Eigen::Index i = 0; i < points.size(); ++i) points.data()[i] = place(random);
  return points;
}

MarkerPositions bent(const MarkerPositions& points) {
  MarkerPositions result = points;
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const Eigen::RowVector3d p = points.row(i);
    result.row(i) << 1.2 * p.x() + 4 * std::sin(p.y() / 40) + 300, 0.8 * p.y() + 3 * std::cos(p.x() / 50) - 20,
        1.1 * p.z() + 0.001 * p.x() * p.x();
  }
  return result;
}

class WarpKernels : public ::testing::TestWithParam<RbfKernel> {};

TEST_P(WarpKernels, MeetsEveryLandmark) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    const MarkerPositions actor = scattered(seed);
    const MarkerPositions target = bent(actor);
    const RbfWarp warp = RbfWarp::fit(actor, target, {.kernel = GetParam()});
    EXPECT_LT((warp.targetFromActor(actor) - target).cwiseAbs().maxCoeff(), kExactMm);
    EXPECT_LT(warp.summary().landmark_max, kExactMm);
  }
}

TEST_P(WarpKernels, AffineMapsAreReproducedEverywhere) {
  const MarkerPositions actor = scattered(4);
  Eigen::Matrix3d linear;
  linear << 0.9, 0.1, -0.2, 0.05, 1.3, 0.1, 0.2, -0.1, 1.1;
  const Eigen::RowVector3d shift(10, -40, 700);
  const auto map = [&](const MarkerPositions& points) {
    return MarkerPositions((points * linear.transpose()).rowwise() + shift);
  };
  const RbfWarp warp = RbfWarp::fit(actor, map(actor), {.kernel = GetParam()});
  const MarkerPositions elsewhere = 1.5 * scattered(5);
  EXPECT_LT((warp.targetFromActor(elsewhere) - map(elsewhere)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_P(WarpKernels, JacobianIsTheDerivative) {
  const MarkerPositions actor = scattered(6);
  const RbfWarp warp = RbfWarp::fit(actor, bent(actor), {.kernel = GetParam()});
  const Eigen::Vector3d point(3, -12, 25);
  constexpr double kStep = 1e-4;
  for (int axis = 0; axis < 3; ++axis) {
    MarkerPositions around(2, 3);
    around.rowwise() = point.transpose();
    around(0, axis) += kStep;
    around(1, axis) -= kStep;
    const MarkerPositions mapped = warp.targetFromActor(around);
    const Eigen::Vector3d difference = ((mapped.row(0) - mapped.row(1)) / (2 * kStep)).transpose();
    EXPECT_LT((difference - warp.jacobian(point).col(axis)).norm(), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(All, WarpKernels,
                         ::testing::Values(RbfKernel::kInverseMultiquadric, RbfKernel::kBiharmonic,
                                           RbfKernel::kTriharmonic));

TEST(RbfWarp, TheNeutralPoseLandsOnTheTargetEvenWhenSmoothed) {
  const MarkerPositions actor = scattered(7);
  const MarkerPositions target = bent(actor);
  const RbfWarp warp = RbfWarp::fit(actor, target, {.regularization = 0.1});
  EXPECT_GT(warp.summary().landmark_max, 1e-3) << "regularisation has no effect";
  const double total = (warp.targetFromActor(actor) - target).norm();
  EXPECT_NEAR(warp.summary().landmark_rms, total / std::sqrt(static_cast<double>(kMarkers)), 1e-9);
  PositionMatrix frames(1, 3 * kMarkers);
  frames.row(0) = Eigen::Map<const Eigen::RowVectorXd>(actor.data(), actor.size());
  const PositionMatrix mapped = warp.targetFromActorRelative(frames, actor);
  EXPECT_LT((mapped.row(0) - Eigen::Map<const Eigen::RowVectorXd>(target.data(), target.size())).cwiseAbs().maxCoeff(),
            kExactMm);
}

TEST(RbfWarp, FramesAreRelativeToTheNeutralGiven) {
  const MarkerPositions actor = scattered(8);
  const RbfWarp warp = RbfWarp::fit(actor, bent(actor), {});
  // Another actor whose neutral markers lie elsewhere still rests on the target.
  const MarkerPositions other = actor.array() + 2.5;
  PositionMatrix frames(2, 3 * kMarkers);
  frames.row(0) = Eigen::Map<const Eigen::RowVectorXd>(other.data(), other.size());
  frames.row(1) = frames.row(0);
  frames(1, 4) += 3.0;
  const PositionMatrix mapped = warp.targetFromActorRelative(frames, other);
  const MarkerPositions target = bent(actor);
  EXPECT_LT((mapped.row(0) - Eigen::Map<const Eigen::RowVectorXd>(target.data(), target.size())).cwiseAbs().maxCoeff(),
            kExactMm);
  // Only the marker that moved does; along the Jacobian, to first order.
  const Eigen::RowVectorXd step = mapped.row(1) - mapped.row(0);
  EXPECT_LT(step.head<3>().norm() + step.tail(3 * kMarkers - 6).norm(), 1e-9);
  EXPECT_GT(step.segment<3>(3).norm(), 1.0);
}

TEST(RbfWarp, TheChosenShapeIsNotWorseThanAnyOther) {
  const MarkerPositions actor = scattered(9);
  const MarkerPositions target = bent(actor);
  WarpOptions options = RbfWarp::fit(actor, target, {}).options();
  const double chosen = leaveOneOutRms(actor, target, options);
  for (const double factor : {0.5, 1.0, 2.0, 4.0}) {
    options.shape_factor = factor;
    EXPECT_LE(chosen, leaveOneOutRms(actor, target, options) + 1e-12) << factor;
  }
}

/// What the kernel's width is told by, computed by another route.
TEST(RbfWarp, TheShapeIsAMultipleOfTheMarkersSpacing) {
  const MarkerPositions actor = scattered(14), target = bent(actor), elsewhere = scattered(15);
  double spacing = 0;
  for (Eigen::Index i = 0; i < kMarkers; ++i) {
    Eigen::VectorXd others = (actor.rowwise() - actor.row(i)).rowwise().norm();
    others(i) = 1000;
    spacing += others.minCoeff() / static_cast<double>(kMarkers);
  }
  const RbfWarp warp = RbfWarp::fit(actor, target, {.shape_factor = 1.5});
  const RbfInterpolant same = RbfInterpolant::fit(actor, target, {.shape = 1.5 * spacing});
  EXPECT_LT((warp.targetFromActor(elsewhere) - same.evaluate(elsewhere)).cwiseAbs().maxCoeff(), 1e-9);
}

/// A smooth map is the triharmonic kernel's; places that are off leave little to choose: the paper's stays.
TEST(RbfWarp, TakesAnotherKernelWhereItErrsClearlyLess) {
  for (const unsigned seed : {51U, 52U, 53U, 54U}) {
    SCOPED_TRACE(seed);
    const MarkerPositions actor = scattered(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    const auto kernelFor = [&](const MarkerPositions& target) {
      return RbfWarp::fit(actor, target, {.any_kernel = true}).options().kernel;
    };
    EXPECT_EQ(kernelFor(bent(actor)), RbfKernel::kTriharmonic);
    MarkerPositions off = bent(actor);
    for (Eigen::Index i = 0; i < off.size(); ++i) off.data()[i] += 1.5 * normal(random);
    EXPECT_EQ(kernelFor(off), RbfKernel::kInverseMultiquadric);
  }
}

/// A smooth map whose places were read off by hand, 1.5 mm beside where they are: markers that move alike shall land
/// alike. (A warp that meets each place exactly takes what is wrong with one for a stretch of what lies between.)
TEST(RbfWarp, PlacesThatAreOffDoNotStretchWhatLiesBetween) {
  for (const unsigned seed : {21U, 22U, 23U}) {
    SCOPED_TRACE(seed);
    const MarkerPositions actor = scattered(seed);
    MarkerPositions target = bent(actor);
    std::mt19937 random(seed);
    std::normal_distribution<double> off(0, 1.5);
    for (Eigen::Index i = 0; i < target.size(); ++i) target.data()[i] += off(random);
    const RbfWarp chosen = RbfWarp::fit(actor, target, {.any_kernel = true});
    WarpOptions exact = chosen.options();
    exact.regularization = 0;
    const RbfWarp meeting = RbfWarp::fit(actor, target, exact);
    const MarkerPositions moved = actor.rowwise() + Eigen::RowVector3d(0, -12, 0);
    const auto missesBy = [&](const RbfWarp& warp) {
      const MarkerPositions ways = warp.targetFromActor(moved) - warp.targetFromActor(actor);
      return (ways - (bent(moved) - bent(actor))).norm() / std::sqrt(static_cast<double>(kMarkers));
    };
    EXPECT_GT(chosen.options().regularization, 0);
    EXPECT_LT(missesBy(chosen), 0.85 * missesBy(meeting));
  }
}

/// Of places on a face, which is thin, some millimetres beside where they are, the warp that errs least may turn space
/// inside out before or behind them; another does not.
TEST(RbfWarp, FoldsAtNoMarkerWhereItNeedNot) {
  for (const unsigned seed : {37U, 38U, 46U, 47U, 49U}) {
    MarkerPositions actor = scattered(seed);
    for (Eigen::Index i = 0; i < actor.rows(); ++i)
      actor(i, 2) = 40 - 0.006 * actor.row(i).head<2>().squaredNorm() + 0.02 * actor(i, 2);
    MarkerPositions target = actor;
    std::mt19937 random(seed);
    std::normal_distribution<double> off(0, 4);
    for (Eigen::Index i = 0; i < target.size(); ++i) target.data()[i] += off(random);
    const RbfWarp warp = RbfWarp::fit(actor, target, {.any_kernel = true});
    double least = 1;
    for (Eigen::Index i = 0; i < actor.rows(); ++i)
      least = std::min(least, warp.jacobian(actor.row(i).transpose()).determinant());
    EXPECT_GT(least, 0) << seed;
  }
}

TEST(RbfWarp, AFoldShowsInTheJacobian) {
  MarkerPositions actor = scattered(10);
  MarkerPositions target = actor;
  EXPECT_GT(RbfWarp::fit(actor, target, {}).jacobian(actor.row(0).transpose()).determinant(), 0);
  // Two markers far apart change places: somewhere between them space turns over.
  actor.row(0) << -30, 0, 0;
  actor.row(1) << 30, 0, 0;
  target = actor;
  target.row(0).swap(target.row(1));
  const RbfWarp warp = RbfWarp::fit(actor, target, {});
  double smallest = 1;
  for (double x = -35; x <= 35; x += 1) smallest = std::min(smallest, warp.jacobian({x, 0, 0}).determinant());
  EXPECT_LT(smallest, 0);
}

TEST(RbfWarp, RefusesMarkersThatMakeNoVolume) {
  MarkerPositions flat = scattered(11);
  flat.col(2).setZero();
  EXPECT_THROW(RbfWarp::fit(flat, bent(flat), {}), InputError);
  MarkerPositions doubled = scattered(12);
  doubled.row(3) = doubled.row(4);
  EXPECT_THROW(RbfWarp::fit(doubled, bent(doubled), {}), InputError);
  MarkerPositions unseen = scattered(13);
  unseen(0, 0) = std::nan("");
  EXPECT_THROW(RbfWarp::fit(unseen, bent(scattered(13)), {}), InputError);
}

}  // namespace
}  // namespace mouthpiece
