#include "motion/cleaning/repairs.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/index.h"
#include "motion/cleaning/rigid.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

MotionClip withNoise(MotionClip clip, double noise_mm) {
  std::mt19937 random(61);
  std::normal_distribution<double> normal(0.0, noise_mm);
  for (double& value : clip.positions_mm.reshaped()) value += normal(random);
  return clip;
}

double rmsDifference(const PositionMatrix& a, const PositionMatrix& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.size()));
}

TEST(SmoothMotion, WhatWasNeverSeenIsNotMoved) {
  MotionClip clip{100, {"A", "B"}, PositionMatrix::Constant(50, 6, std::numeric_limits<double>::quiet_NaN())};
  const SmoothedMotion unseen = smoothMotion(clip);
  EXPECT_EQ(unseen.rms_change_mm, 0);
  EXPECT_EQ(unseen.noise_mm, 0);
  EXPECT_TRUE(unseen.clip.positions_mm.array().isNaN().all());
  EXPECT_EQ(smoothMotion({100, {}, PositionMatrix(50, 0)}).noise_mm, 0) << "no marker at all";
  EXPECT_EQ(smoothMotion(clip, {.noise_mm = 0.05}).noise_mm, 0.05) << "as given";
}

TEST(SmoothMotion, HalvesTheNoise) {
  const MotionClip truth = SyntheticMotion(62, 10, 8.0).clip(120.0, 480);
  for (const double noise_mm : {0.1, 0.3}) {
    const SmoothedMotion result = smoothMotion(withNoise(truth, noise_mm));
    EXPECT_NEAR(result.noise_mm, noise_mm, 0.1 * noise_mm);
    EXPECT_LT(rmsDifference(result.clip.positions_mm, truth.positions_mm), 0.5 * noise_mm);
    EXPECT_LT(result.rms_change_mm, 1.1 * noise_mm);
  }
}

TEST(SmoothMotion, LeavesCleanMotionAsItIs) {
  const MotionClip truth = SyntheticMotion(63, 5, 8.0).clip(120.0, 240);
  EXPECT_LT(rmsDifference(smoothMotion(truth).clip.positions_mm, truth.positions_mm), 0.01);
}

TEST(SmoothMotion, KeepsAQuickClosure) {
  // Lips that close for 60 ms and open again, 10 mm, in 0.1 mm of noise.
  MotionClip truth{120.0, {"LIP_LO_MID"}, PositionMatrix::Zero(240, 3)};
  for (Eigen::Index frame = 0; frame < 240; ++frame) {
    const double t = (static_cast<double>(frame) - 120.0) / 120.0;
    truth.positions_mm(frame, 1) = -10.0 + 10.0 * std::exp(-std::pow(t / 0.03, 2.0));
  }
  const SmoothedMotion result = smoothMotion(withNoise(truth, 0.1), {0.1});
  // Three times the noise: its own part, and what the smoother may take off the tip.
  EXPECT_NEAR(result.clip.positions_mm(120, 1), 0.0, 0.3);
}

TEST(SmoothMotion, DoesNotCarryALipOnWhenItIsStopped) {
  // Slow speech, and once a second a lip that is stopped by the other within a frame and leaves as suddenly.
  MotionClip truth{120.0, {"LIP_LO_MID"}, PositionMatrix::Zero(1200, 3)};
  for (Eigen::Index frame = 0; frame < 1200; ++frame) {
    const double t = static_cast<double>(frame % 120 - 60) / 120.0;
    truth.positions_mm(frame, 1) = -std::max(0.0, 6.0 + std::sin(2 * t) - 9.0 * std::exp(-std::pow(t / 0.08, 2.0)));
  }
  constexpr double kNoise = 0.06;
  const SmoothedMotion result = smoothMotion(withNoise(truth, kNoise), {kNoise});
  double beyond = 0;
  for (Eigen::Index closure = 0; closure < 10; ++closure)
    beyond += result.clip.positions_mm.col(1).segment(120 * closure + 40, 40).maxCoeff() / 10;
  EXPECT_LT(beyond, 1.3 * kNoise) << "mm further than where it was stopped";
}

TEST(SmoothMotion, LeavesGapsOpen) {
  MotionClip clip = withNoise(SyntheticMotion(64, 2).clip(120.0, 200), 0.1);
  clip.positions_mm.block(50, 0, 20, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  clip.positions_mm.middleCols<3>(3).bottomRows(197).setConstant(std::numeric_limits<double>::quiet_NaN());
  const SmoothedMotion result = smoothMotion(clip);
  for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
    ASSERT_EQ(std::isnan(clip.positions_mm.data()[i]), std::isnan(result.clip.positions_mm.data()[i]));
  }
  EXPECT_EQ(result.clip.positions_mm(1, 3), clip.positions_mm(1, 3)) << "three samples are too few to smooth";
}

TEST(SmoothMotion, MovesTheRealSpeakerByNoMoreThanHisNoise) {
  const std::vector<MotionClip> takes = realTakes(10);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  for (const MotionClip& take : takes) {
    const SmoothedMotion result = smoothMotion(take);
    EXPECT_LT(result.rms_change_mm, 1.2 * result.noise_mm);
    EXPECT_LT(result.noise_mm, 0.5);
  }
}

/// The report counts what was done: the root of the mean square over all coordinates that were seen, and no coordinate
/// goes further than it says.
TEST(SmoothMotion, ReportsHowFarItMovedWhatWasSeen) {
  for (const double noise_mm : {0.0, 0.2}) {
    MotionClip clip = withNoise(SyntheticMotion(65, 4).clip(120.0, 200), 0.15);
    clip.positions_mm.block(20, 3, 30, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
    clip.positions_mm(100, 7) += 5;  // no noise: it is not followed so far
    const SmoothedMotion result = smoothMotion(clip, {noise_mm});
    const PositionMatrix change = result.clip.positions_mm - clip.positions_mm;
    double sum = 0, samples = 0;
    for (Eigen::Index i = 0; i < change.size(); ++i) {
      if (std::isnan(change.data()[i])) continue;
      sum += change.data()[i] * change.data()[i];
      samples += 1;
      const auto marker = static_cast<std::size_t>(i % change.cols() / 3);
      EXPECT_LE(std::abs(change.data()[i]), 2.5 * result.marker_noise_mm[marker] + 1e-12);
    }
    EXPECT_EQ(samples, 200 * 12 - 30 * 3);
    EXPECT_NEAR(result.rms_change_mm, std::sqrt(sum / samples), 1e-12);
    EXPECT_GT(std::abs(change(100, 7)), 0.2) << "as far as it may";
    EXPECT_EQ(result.noise_mm == noise_mm, noise_mm > 0);
  }
}

/// It knows no direction of time but at its start, and no place: backwards, mirrored and elsewhere it does the same.
TEST(SmoothMotion, DoesTheSameElsewhereAndMirrored) {
  const MotionClip clip = withNoise(SyntheticMotion(66, 2).clip(120.0, 150), 0.1);
  const PositionMatrix here = smoothMotion(clip, {0.1}).clip.positions_mm;
  MotionClip other = clip;
  other.positions_mm = -clip.positions_mm.array() + 300;
  EXPECT_LT((smoothMotion(other, {0.1}).clip.positions_mm.array() - 300 + here.array()).abs().maxCoeff(), 1e-6);
  MotionClip larger = clip;
  larger.positions_mm *= 10;
  EXPECT_LT((smoothMotion(larger, {1.0}).clip.positions_mm - 10 * here).cwiseAbs().maxCoeff(), 1e-6)
      << "ten times the movement in ten times the noise";
}

/// A marker that moves fast passes some of its motion for noise: none counts as more than twice the median.
TEST(SmoothMotion, NoMarkerIsTwiceAsNoisyAsTheOthers) {
  MotionClip clip = withNoise(SyntheticMotion(67, 5, 0.1).clip(120.0, 300), 0.1);
  for (Eigen::Index frame = 0; frame < 300; ++frame)
    clip.positions_mm.block<1, 3>(frame, 3).array() += frame % 2 == 0 ? 3 : -3;
  std::vector<double> noise = smoothMotion(clip).marker_noise_mm;
  const double shaken = noise[1];
  std::sort(noise.begin(), noise.end());
  EXPECT_NEAR(shaken, 2 * noise[2], 1e-12);
  EXPECT_EQ(shaken, noise.back());
}

using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

/// A marker's path as one Gaussian over all frames, written down whole: what the filter goes through frame by frame.
class GaussianPath {
 public:
  /// `places`: of the frames that were seen, in noises; `strengths`: of the jerk before each frame.
  GaussianPath(const std::vector<int>& seen, const Exact& places, double restlessness,
               const std::vector<double>& strengths)
      : places_(places) {
    // Position after k frames from a start's position, velocity and acceleration, and from white jerk in one frame.
    const auto fromStart = [](int k) { return Eigen::Matrix<long double, 3, 1>(1, k, 0.5L * k * k); };
    const Eigen::Matrix<long double, 3, 3> jerk{
        {1.0L / 20, 1.0L / 8, 1.0L / 6}, {1.0L / 8, 1.0L / 3, 0.5L}, {1.0L / 6, 0.5L, 1}};
    const auto count = signedIndex(seen.size());
    covariance_.resize(count, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      for (Eigen::Index k = 0; k <= i; ++k) {
        const int a = seen[unsignedIndex(i)], b = seen[unsignedIndex(k)];
        long double sum = 1e8L * fromStart(a).dot(fromStart(b));
        for (int s = 1; s <= b; ++s) {
          const long double strength = restlessness * strengths[unsignedIndex(s)];
          sum += strength * strength * fromStart(a - s).dot(jerk * fromStart(b - s));
        }
        covariance_(i, k) = covariance_(k, i) = sum;
      }
    }
    solver_.compute(covariance_ + Exact::Identity(count, count));
    innovations_ = solver_.matrixL().solve(places_);
  }

  /// -2 log-likelihood of all places behind the first three.
  [[nodiscard]] long double cost() const {
    long double sum = 0;
    for (Eigen::Index i = 3; i < places_.rows(); ++i)
      sum += innovations_.row(i).squaredNorm() + 6 * std::log(Exact(solver_.matrixL())(i, i));
    return sum;
  }
  [[nodiscard]] double surpriseAt(std::size_t i) const {
    return i < 3 ? 1 : static_cast<double>(innovations_.row(signedIndex(i)).squaredNorm() / 3);
  }
  [[nodiscard]] Exact mean() const { return covariance_ * solver_.solve(places_); }

 private:
  Exact places_, covariance_, innovations_;
  Eigen::LLT<Exact> solver_;
};

/// Filter and smoother against one dense solve: restlessness by likelihood, jerk as strong as the path surprises.
TEST(SmoothMotion, IsTheMeanOfTheWholeGaussian) {
  constexpr int kFrames = 34;
  constexpr double kNoise = 0.1;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    MotionClip clip = withNoise(SyntheticMotion(seed, 2, 2.0 * seed).clip(120.0, kFrames), kNoise * (0.5 + 0.3 * seed));
    for (Eigen::Index frame = 20; frame < kFrames && seed % 2 == 0; ++frame)
      clip.positions_mm.row(frame) = clip.positions_mm.row(20).eval();  // it stops
    for (const int frame : {0, 9, 10, 25}) {
      if (random() % 2 == 0) clip.positions_mm.block(frame, 3, 1, 3).setConstant(std::nan(""));
    }
    const SmoothedMotion smoothed = smoothMotion(clip, {kNoise});
    for (Eigen::Index column = 0; column < 6; column += 3) {
      std::vector<int> seen;
      for (int frame = 0; frame < kFrames; ++frame) {
        if (!std::isnan(clip.positions_mm(frame, column))) seen.push_back(frame);
      }
      const PositionMatrix path = clip.positions_mm(seen, Eigen::seqN(column, 3));
      const Exact places = ((path.rowwise() - path.row(0)) / kNoise).cast<long double>();
      const std::vector<double> even(kFrames, 1.0);
      double likeliest = 0;
      long double least = std::numeric_limits<long double>::infinity();
      for (int i = 0; i < 13; ++i) {  // 0.001 to 100
        const double restlessness = std::pow(10.0, -3 + 5 * i / 12.0);
        const long double cost = GaussianPath(seen, places, restlessness, even).cost();
        if (cost >= least) continue;
        least = cost;
        likeliest = restlessness;
      }
      const GaussianPath first(seen, places, likeliest, even);
      std::vector<double> surprise(kFrames, 1.0), strengths(kFrames, 1.0);
      for (std::size_t i = 0; i < seen.size(); ++i) surprise[unsignedIndex(seen[i])] = first.surpriseAt(i);
      for (int frame = 0; frame < kFrames; ++frame) {
        double sum = 0, count = 0;
        for (int near = std::max(0, frame - 2); near <= std::min(kFrames - 1, frame + 2); ++near, ++count)
          sum += surprise[unsignedIndex(near)];
        strengths[unsignedIndex(frame)] = std::clamp(sum / count, 1.0, 100.0);
      }
      const PositionMatrix mean =
          (kNoise * GaussianPath(seen, places, likeliest, strengths).mean().cast<double>()).rowwise() + path.row(0);
      const PositionMatrix expected = path + (mean - path).cwiseMin(2.5 * kNoise).cwiseMax(-2.5 * kNoise);
      const PositionMatrix found = smoothed.clip.positions_mm(seen, Eigen::seqN(column, 3));
      EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-4 * kNoise) << "column " << column;
    }
  }
}

}  // namespace
}  // namespace mouthpiece
