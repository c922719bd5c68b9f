// What holds for any take: random heads, worlds and mouths, the seed in the trace.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/index.h"
#include "corpus_tools/takes/cleaning.h"
#include "corpus_tools/takes/lip_measures.h"
#include "corpus_tools/takes/pose_fit.h"
#include "corpus_tools/takes/take_poses.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeeds = 8;
constexpr double kExactMm = 1e-6;
constexpr double kMedianMm = 0.1;  ///< the neutral pose is a median along each axis, which turns with the axes

RigidMotion randomMotion(std::mt19937& random, double reach_mm = 500) {
  std::normal_distribution<double> any(0, 1);
  const Eigen::Quaterniond turn(any(random), any(random), any(random), any(random));
  return {turn.normalized().toRotationMatrix(), reach_mm * Eigen::Vector3d(any(random), any(random), any(random))};
}

SyntheticTake randomTake(unsigned seed) {
  std::mt19937 random(seed);
  SyntheticTake take;
  take.name = "take" + std::to_string(seed);
  take.seed = seed;
  take.head_swing = 0.2 * asReal(random() % 8);
  const std::vector<std::string> sounds{"B", "IH", "N", "AA", "M", "IY", "P"};
  take.phones = {"sil", "AA"};
  for (std::size_t n = 2 + random() % 6; n > 0; --n) take.phones.push_back(sounds[random() % sounds.size()]);
  take.phones.emplace_back("sil");
  return take;
}

double largest(const Eigen::MatrixXd& difference) { return difference.cwiseAbs().maxCoeff(); }

TEST(PoseFitLaws, SizeTurnAndPlaceAreRecovered) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MarkerPositions source = syntheticNeutral();
    const double scale = std::uniform_real_distribution<double>(0.5, 2)(random);
    const RigidMotion motion = randomMotion(random);
    MarkerPositions target = scale * source;
    transform(target, motion);
    const std::optional<PoseFit> fit = fitPose(source, target, PoseScale::kFree);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->scale, scale, 1e-9);
    EXPECT_LT((fit->target_from_source.rotation - motion.rotation).norm(), 1e-9);
    EXPECT_LT(fit->squared_residuals_mm2, kExactMm);
    EXPECT_EQ(fit->shared_markers, unsignedIndex(source.rows()));
  }
}

/// However the shapes lie in the world, their mean has the distances of the one shape that they all are.
TEST(PoseFitLaws, TheMeanOfOneShapeIsThatShape) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<MarkerPositions> shapes(6, syntheticNeutral());
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      transform(shapes[i], randomMotion(random));
      if (i > 0) shapes[i].row(static_cast<Eigen::Index>(random() % 60)).setConstant(std::nan(""));
    }
    const MarkerPositions mean = meanShape(shapes, 10, PoseScale::kFixed);
    const std::optional<PoseFit> fit = fitPose(mean, syntheticNeutral(), PoseScale::kFixed);
    ASSERT_TRUE(fit.has_value());
    EXPECT_LT(std::sqrt(fit->squared_residuals_mm2), 1e-4);
    EXPECT_EQ(fit->shared_markers, unsignedIndex(mean.rows())) << "what one shape hides another shows";
  }
}

/// The room's axes, and where the actor sits in it, are no part of the face.
TEST(HeadLaws, TheWorldDoesNotShowInTheCleanedFace) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    RawTake take = randomTake(seed).raw(), elsewhere = take;
    const RigidMotion room = randomMotion(random, 1000);
    transform(elsewhere.face, room);
    transform(elsewhere.jig, room);
    const MarkerLayout& layout = defaultLayout();
    const auto cleaned = [&](const RawTake& raw) {
      const HeadReference reference = estimateHeadReference({raw}, layout);
      MotionClip face = withoutHeadMotion(raw.face, trackHead(raw, reference, layout));
      const NeutralPose neutral = neutralPose({{raw.name, "", raw.labels, face, {}}}, layout);
      transform(face, faceFromHead(neutral.pose_mm, layout));
      return face.positions_mm;
    };
    EXPECT_LT(largest(cleaned(take) - cleaned(elsewhere)), kMedianMm);
  }
}

TEST(HeadLaws, TheFacesAxesMoveWithTheFace) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    MarkerPositions plain = syntheticNeutral(), moved = plain;
    transform(moved, randomMotion(random));
    for (MarkerPositions* pose : {&plain, &moved}) transform(*pose, faceFromHead(*pose, defaultLayout()));
    EXPECT_LT(largest(plain - moved), kExactMm);
  }
}

/// Cleaning what is clean changes nothing: no swap, no spike, no gap, and the motion of the truth.
TEST(CleaningLaws, ACleanTakeStaysAsItIs) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const SyntheticTake take = randomTake(seed);
    const RawTake raw = take.raw();
    CleaningOptions options;
    options.smooth = false;
    const CleanedFace cleaned = cleanFace(raw, estimateHeadReference({raw}, defaultLayout()), defaultLayout(), options);
    EXPECT_EQ(cleaned.report.swaps + cleaned.report.spikes + cleaned.report.gap_samples, 0U);
    EXPECT_EQ(cleaned.report.jig_frames, raw.face.frameCount());
    // The reference lies where one of the frames did: up to a rigid motion.
    MarkerPositions first = cleaned.motion.pose(FrameIndex(0));
    const std::optional<PoseFit> fit = fitPose(first, take.truth().pose(FrameIndex(0)), PoseScale::kFixed);
    ASSERT_TRUE(fit.has_value());
    MotionClip placed = cleaned.motion;
    transform(placed, fit->target_from_source);
    EXPECT_LT(largest(placed.positions_mm - take.truth().positions_mm), 0.5) << "what smoothing the poses costs";
  }
}

TEST(CleaningLaws, StepsThatAreOffLeaveTheirTrace) {
  RawTake raw = randomTake(3).raw();
  raw.face.positions_mm.block(20, 30, 5, 3).setConstant(std::nan(""));
  const HeadReference reference = estimateHeadReference({raw}, defaultLayout());
  CleaningOptions options;
  EXPECT_EQ(cleanFace(raw, reference, defaultLayout(), options).report.missing_samples, 0U);
  options.fill_gaps = false;
  const CleanedFace open = cleanFace(raw, reference, defaultLayout(), options);
  EXPECT_EQ(open.report.missing_samples, 5U);
  EXPECT_EQ(open.report.filled_samples, 0U);
  options.remove_head = false;
  EXPECT_EQ(cleanFace(raw, {}, defaultLayout(), options).report.jig_frames, 0U);
}

/// Takes that were moved, each somewhere else, lie in one place again: all pairs of mouth shapes agree.
TEST(TakeAlignmentLaws, MovedTakesComeTogetherAgain) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::vector<CorpusTake> takes;
    for (int i = 0; i < 5; ++i) {
      SyntheticTake take = randomTake(20);  // all say the same
      takes.push_back(take.clean());
      const RigidMotion slip{Eigen::AngleAxisd(0.01 * asReal(random() % 5), Eigen::Vector3d::UnitY()).matrix(),
                             Eigen::Vector3d::Random()};
      transform(takes.back().motion, slip);
    }
    alignTakesByPhones(takes);
    for (std::size_t i = 1; i < takes.size(); ++i)
      EXPECT_LT(largest(takes[i].motion.positions_mm - takes[0].motion.positions_mm), 0.05);
  }
}

TEST(NeutralPoseLaws, TheOrderOfTakesDoesNotMatterAndPlacesShift) {
  std::vector<CorpusTake> takes;
  for (unsigned seed = 1; seed <= 4; ++seed) takes.push_back(randomTake(seed).clean());
  const NeutralPose plain = neutralPose(takes, defaultLayout());
  std::reverse(takes.begin(), takes.end());
  EXPECT_EQ(neutralPose(takes, defaultLayout()).pose_mm, plain.pose_mm);
  EXPECT_EQ(neutralPose(takes, defaultLayout()).frames, plain.frames);
  const Eigen::RowVector3d shift(10, -20, 30);
  for (CorpusTake& take : takes) transform(take.motion, {Eigen::Matrix3d::Identity(), shift.transpose()});
  EXPECT_LT(largest((neutralPose(takes, defaultLayout()).pose_mm.rowwise() - shift) - plain.pose_mm), 1e-4);
}

TEST(LipMeasuresLaws, AgainstItselfAllIsKept) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const SyntheticTake take = randomTake(seed);
    const MotionClip truth = take.truth();
    MotionClip shifted = truth;
    shifted.positions_mm.array() += 7;  // a constant offset is taken off
    for (const MotionClip* clip : {&truth, static_cast<const MotionClip*>(&shifted)}) {
      const LipMeasures lips = measureLips(truth, *clip, take.labels(), defaultLayout());
      EXPECT_NEAR(lips.lipRms(), 0, 1e-9);
      EXPECT_NEAR(lips.openingCorrelation(), 1, 1e-9);
      EXPECT_EQ(lips.closures_kept, lips.closures);
      EXPECT_EQ(lips.false_closures, 0U);
      EXPECT_NEAR(lips.varianceRatio(), 1, 1e-9);
      EXPECT_NEAR(lips.jerkRatio(), 1, 1e-9);
      EXPECT_EQ(lips.vowels_shut, lips.captured_vowels_shut);
    }
  }
}

/// A mouth that moves k times as far has k^2 times the variance and k times the jerk; its curves go on together.
TEST(LipMeasuresLaws, LargerMovementsScaleTheMeasures) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const SyntheticTake take = randomTake(seed);
    const MotionClip truth = take.truth();
    const double k = 0.5 + 0.25 * seed;
    MotionClip larger = truth;
    const Eigen::RowVectorXd rest = truth.positions_mm.row(0);
    larger.positions_mm = (k * (truth.positions_mm.rowwise() - rest)).rowwise() + rest;
    const LipMeasures lips = measureLips(truth, larger, take.labels(), defaultLayout());
    EXPECT_NEAR(lips.varianceRatio(), k * k, 1e-6);
    EXPECT_NEAR(lips.jerkRatio(), k, 1e-6);
    EXPECT_GT(lips.openingCorrelation(), 0.999);
  }
}

TEST(LipMeasuresLaws, TakesAddUp) {
  std::vector<LipMeasures> each;
  LipMeasures sum;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const SyntheticTake take = randomTake(seed);
    MotionClip off = take.truth();
    off.positions_mm += PositionMatrix::Random(off.positions_mm.rows(), off.positions_mm.cols());
    each.push_back(measureLips(take.truth(), off, take.labels(), defaultLayout()));
    sum += each.back();
  }
  EXPECT_EQ(sum.frames, each[0].frames + each[1].frames + each[2].frames);
  EXPECT_EQ(sum.closures, each[0].closures + each[1].closures + each[2].closures);
  EXPECT_EQ(sum.opening_r.size(), 3U);
  double squared = 0, count = 0;
  for (const LipMeasures& lips : each) {
    squared += lips.lipRms() * lips.lipRms() * asReal(lips.squared_errors);
    count += asReal(lips.squared_errors);
  }
  EXPECT_NEAR(sum.lipRms(), std::sqrt(squared / count), 1e-9);
}

}  // namespace
}  // namespace mouthpiece
