#include "corpus_tools/takes/head_tracking.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "base/errors.h"
#include "corpus_tools/takes/pose_fit.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

/// Vicon's noise on a face, about.
constexpr double kOpticalNoiseMm = 0.1;
constexpr double kRotationLeftDegrees = 0.1;

struct Left {
  double largest_degrees = 0, rms_degrees = 0;  ///< turn of the head that is left, against the mean over the take
};

/// `head_from_world` times the true world-from-head motion should be one constant rotation.
Left headMotionLeft(const SyntheticTake& take, const HeadTrack& track) {
  std::vector<Eigen::Matrix3d> turns;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t frame = 0; frame < track.head_from_world.size(); ++frame) {
    const Seconds time = static_cast<double>(frame) / take.frame_rate_hz;
    turns.push_back(track.head_from_world[frame].rotation * take.worldFromHead(time).rotation);
    sum += turns.back();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d mean = svd.matrixU() * svd.matrixV().transpose();
  Left left;
  for (const Eigen::Matrix3d& turn : turns) {
    const double degrees = angleBetween(mean, turn);
    left.largest_degrees = std::max(left.largest_degrees, degrees);
    left.rms_degrees += degrees * degrees / static_cast<double>(turns.size());
  }
  left.rms_degrees = std::sqrt(left.rms_degrees);
  return left;
}

double distanceFromTruth(const SyntheticTake& take, MotionClip still) {
  const MotionClip truth = take.truth();
  const auto fit = fitRigidMotion(still.pose(FrameIndex(0)), truth.pose(FrameIndex(0)), {0});
  transform(still, *fit);
  return (still.positions_mm - truth.positions_mm).array().abs().maxCoeff();
}

/// Every frame by itself: then a clear capture leaves nothing.
HeadTrackingOptions unsmoothed() {
  HeadTrackingOptions options;
  options.jig_pose_smoothing = options.skin_pose_smoothing = 0;
  return options;
}

HeadTrack tracked(const RawTake& raw, const HeadTrackingOptions& options) {
  return trackHead(raw, estimateHeadReference({raw}, defaultLayout(), options), defaultLayout(), options);
}

TEST(HeadTracking, TheJigTakesTheHeadsMotionOff) {
  const SyntheticTake take;
  const RawTake raw = take.raw();
  const HeadTrack track = tracked(raw, unsmoothed());
  EXPECT_EQ(track.jig_frames, raw.face.frameCount());
  EXPECT_LT(headMotionLeft(take, track).largest_degrees, 1e-6);
  EXPECT_LT(distanceFromTruth(take, withoutHeadMotion(raw.face, track)), 1e-6);
}

TEST(HeadTracking, RotationLeftByANoisyJigIsUnderATenthOfADegree) {
  SyntheticTake take;
  take.noise_mm = kOpticalNoiseMm;
  const RawTake raw = take.raw();
  EXPECT_LT(headMotionLeft(take, tracked(raw, {})).rms_degrees, kRotationLeftDegrees);
  // The pose's own noise, were it not smoothed: 0.1 mm on a jig some 60 mm wide.
  EXPECT_GT(headMotionLeft(take, tracked(raw, unsmoothed())).rms_degrees,
            1.5 * headMotionLeft(take, tracked(raw, {})).rms_degrees);
}

TEST(HeadTracking, AMarkerOfTheJigThatSlipsOffHardlyMatters) {
  SyntheticTake take;
  RawTake raw = take.raw();
  raw.jig.positions_mm.block(50, 0, 20, 3).array() += 30;
  EXPECT_LT(headMotionLeft(take, tracked(raw, {})).rms_degrees, 1.0);
}

TEST(HeadTracking, WithoutAJigTheStableMarkersDecide) {
  SyntheticTake take;
  take.has_jig = false;
  const RawTake raw = take.raw();
  const HeadTrack track = tracked(raw, unsmoothed());
  EXPECT_EQ(track.skin_frames, raw.face.frameCount());
  EXPECT_EQ(track.jig_frames, 0U);
  EXPECT_LT(distanceFromTruth(take, withoutHeadMotion(raw.face, track)), 1e-6);
}

TEST(HeadTracking, SmoothingTheSkinPoseTakesNoiseOffTheLips) {
  SyntheticTake take;
  take.has_jig = false;
  take.noise_mm = 0.15;
  take.head_swing = 0.2;
  const RawTake raw = take.raw();
  const auto lip_noise = [&](Seconds smoothing) {
    HeadTrackingOptions options;
    options.skin_pose_smoothing = smoothing;
    const HeadReference reference = estimateHeadReference({raw}, defaultLayout(), options);
    const MotionClip still = withoutHeadMotion(raw.face, trackHead(raw, reference, defaultLayout(), options));
    const auto column = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("LIP_UP_MID").value);
    const auto lip = still.positions_mm.middleCols(column, 3);
    const Eigen::Index frames = lip.rows();
    return (lip.bottomRows(frames - 2) - 2 * lip.middleRows(1, frames - 2) + lip.topRows(frames - 2)).norm();
  };
  EXPECT_LT(lip_noise(0.06), 0.95 * lip_noise(0));
}

TEST(HeadTracking, FramesWithoutAnyMarkerAreBridged) {
  SyntheticTake take;
  RawTake raw = take.raw();
  raw.jig.positions_mm.middleRows(20, 6).setConstant(std::nan(""));
  raw.face.positions_mm.middleRows(20, 6).setConstant(std::nan(""));
  const HeadTrack track = tracked(raw, unsmoothed());
  EXPECT_EQ(track.bridged_frames, 6U);
  // 60 ms at up to 0.7 rad/s, curved: far from a still head, near to a straight line.
  EXPECT_LT(headMotionLeft(take, track).largest_degrees, 0.2);
}

TEST(HeadTracking, FramesWithoutTheJigFallBackOnTheFace) {
  SyntheticTake take;
  RawTake raw = take.raw();
  raw.jig.positions_mm.bottomRows(30).leftCols(12).setConstant(std::nan(""));  // three of seven stay
  const HeadTrack track = tracked(raw, unsmoothed());
  EXPECT_EQ(track.skin_frames, 30U);
  EXPECT_LT(headMotionLeft(take, track).largest_degrees, 1e-6);
}

TEST(HeadTracking, TakesOfDifferentSizeAreBroughtToOne) {
  SyntheticTake small, large;
  small.has_jig = large.has_jig = false;
  small.scale = 0.97;
  large.scale = 1.03;
  large.seed = 2;
  const std::vector<RawTake> takes = {small.raw(), large.raw()};
  const HeadReference reference = estimateHeadReference(takes, defaultLayout());
  const double small_scale = trackHead(takes[0], reference, defaultLayout()).scale;
  const double large_scale = trackHead(takes[1], reference, defaultLayout()).scale;
  EXPECT_NEAR(small_scale * 0.97, large_scale * 1.03, 1e-6);
  EXPECT_NEAR(small_scale * 0.97, 1.0, 0.01);
  SyntheticTake with_jig;
  const RawTake raw = with_jig.raw();
  EXPECT_EQ(trackHead(raw, estimateHeadReference({raw}, defaultLayout()), defaultLayout()).scale, 1.0);
}

TEST(HeadTracking, ATakeThatHidesTheHeadIsRefused) {
  SyntheticTake take;
  take.has_jig = false;
  RawTake raw = take.raw();
  const HeadReference reference = estimateHeadReference({raw}, defaultLayout());
  raw.face.positions_mm.setConstant(std::nan(""));
  EXPECT_THROW(trackHead(raw, reference, defaultLayout()), InputError);
  EXPECT_THROW(estimateHeadReference({raw}, defaultLayout()), InputError);
}

TEST(FaceAxes, AreThoseOfTheFace) {
  const MarkerPositions face = syntheticNeutral();
  MarkerPositions world = face;
  SyntheticTake take;
  transform(world, take.worldFromHead(0.3));
  transform(world, faceFromHead(world, defaultLayout()));
  const auto row = [&](const char* name) {
    return Eigen::RowVector3d(world.row(static_cast<Eigen::Index>(defaultLayout().indexOf(name).value)));
  };
  const Eigen::RowVector3d left = row("CANTHUS_OUT_L"), right = row("CANTHUS_OUT_R");
  EXPECT_NEAR((left + right).norm(), 0, 1e-9);
  EXPECT_GT(left[0], 0);
  EXPECT_NEAR(left[1], 0, 1e-9);
  EXPECT_NEAR(left[2], 0, 1e-9);
  EXPECT_GT(row("FOREHEAD_MID")[1], 0);
  EXPECT_LT(row("CHIN_MID")[1], 0);
  EXPECT_GT(row("NOSE_TIP")[2], 0);
  EXPECT_NEAR(row("NOSE_TIP")[0], 0, 1e-9);
}

TEST(FaceAxes, AMirroredFaceIsRefused) {
  MarkerPositions face = syntheticNeutral();
  face.col(2) *= -1;
  EXPECT_THROW(faceFromHead(face, defaultLayout()), InputError);
}

TEST(FaceAxes, ALayoutWithoutCanthiIsRefused) {
  MarkerLayout layout = defaultLayout();
  for (LayoutMarker& marker : layout.markers) {
    if (marker.region == "canthus") marker.region = "lid";
  }
  EXPECT_THROW(faceFromHead(syntheticNeutral(), layout), InputError);
}

}  // namespace
}  // namespace mouthpiece
