// Laws of the repairs and of rigid fits on random motion: what they must undo, and what they must not touch.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "motion/cleaning/repairs.h"
#include "motion/cleaning/rigid.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

constexpr unsigned kSeeds = 15;
constexpr double kRateHz = 120;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kExactMm = 1e-8;

RigidMotion randomMotion(std::mt19937& random) {
  std::normal_distribution<double> any(0, 1);
  const Eigen::Quaterniond turn(any(random), any(random), any(random), any(random));
  return {turn.normalized().toRotationMatrix(), 300 * Eigen::Vector3d(any(random), any(random), any(random))};
}

MotionClip moved(const MotionClip& clip, const RigidMotion& motion) {
  MotionClip result = clip;
  for (Eigen::Index frame = 0; frame < clip.positions_mm.rows(); ++frame) {
    for (Eigen::Index column = 0; column < clip.positions_mm.cols(); column += 3) {
      result.positions_mm.block<1, 3>(frame, column) =
          motion.apply(clip.positions_mm.block<1, 3>(frame, column).transpose()).transpose();
    }
  }
  return result;
}

void hide(MotionClip& clip, Eigen::Index marker, Eigen::Index first, Eigen::Index count) {
  clip.positions_mm.block(first, 3 * marker, count, 3).setConstant(kNan);
}

/// Smooth motion of eight markers with gaps of 1 to 60 frames.
MotionClip gappyClip(unsigned seed) {
  MotionClip clip = SyntheticMotion(seed, 8).clip(kRateHz, 240);
  std::mt19937 random(seed);
  for (int i = 0; i < 12; ++i) {
    const auto length = static_cast<Eigen::Index>(1 + random() % 60);
    hide(clip, static_cast<Eigen::Index>(random() % 8), static_cast<Eigen::Index>(random() % 180), length);
  }
  return clip;
}

double largestDifference(const PositionMatrix& a, const PositionMatrix& b) {
  return (a - b).array().isNaN().select(0.0, (a - b).array().abs()).maxCoeff();
}

TEST(GapLaws, GapsAreTheRunsOfUnseenFrames) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip clip = gappyClip(seed);
    Eigen::MatrixXi covered = Eigen::MatrixXi::Zero(clip.positions_mm.rows(), 8);
    for (const Gap& gap : findGaps(clip)) {
      ASSERT_LT(gap.first, gap.last);
      covered.col(gap.marker.row()).segment(gap.first.row(), (gap.last.row() - gap.first.row())).array() += 1;
      EXPECT_TRUE(gap.first.value == 0 || clip.isSeen(FrameIndex(gap.first.value - 1), gap.marker));
      EXPECT_TRUE(gap.last.value == clip.frameCount() || clip.isSeen(gap.last, gap.marker));
    }
    for (Eigen::Index frame = 0; frame < covered.rows(); ++frame) {
      for (Eigen::Index marker = 0; marker < 8; ++marker)
        EXPECT_EQ(covered(frame, marker), std::isnan(clip.positions_mm(frame, 3 * marker)) ? 1 : 0);
    }
  }
}

TEST(GapLaws, SeenSamplesStayAndAllGapsAreAccountedFor) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip clip = gappyClip(seed);
    const FilledMotion filled = fillShortGaps(clip);
    EXPECT_EQ(filled.report.filled.size() + filled.report.left.size(), findGaps(clip).size());
    EXPECT_EQ(findGaps(filled.clip).size(), filled.report.left.size());
    for (Eigen::Index i = 0; i < clip.positions_mm.size(); ++i) {
      if (std::isnan(clip.positions_mm.data()[i])) continue;
      ASSERT_EQ(filled.clip.positions_mm.data()[i], clip.positions_mm.data()[i]);
    }
    for (const Gap& gap : filled.report.filled)
      EXPECT_LE(static_cast<double>(gap.last.value - gap.first.value), 0.3 * kRateHz + 1e-6);
  }
}

/// Where the room's axes point is nobody's business.
TEST(GapLaws, FillingMovesWithTheRoom) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MotionClip clip = gappyClip(seed);
    const RigidMotion shift{Eigen::Matrix3d::Identity(), randomMotion(random).translation_mm};
    EXPECT_LT(largestDifference(moved(fillShortGaps(clip).clip, shift).positions_mm,
                                fillShortGaps(moved(clip, shift)).clip.positions_mm),
              1e-4);
  }
}

TEST(GapLaws, AStillMarkerIsFilledWhereItStands) {
  MotionClip clip = SyntheticMotion(1, 4).clip(kRateHz, 100);
  clip.positions_mm.middleCols<3>(6).rowwise() = Eigen::RowVector3d(10, -20, 30);
  hide(clip, 2, 40, 12);
  const FilledMotion filled = fillShortGaps(clip);
  EXPECT_LT(
      (filled.clip.positions_mm.middleCols<3>(6).rowwise() - Eigen::RowVector3d(10, -20, 30)).cwiseAbs().maxCoeff(),
      0.01);
}

/// Swaps of far-apart markers, one after another, are all undone.
/// docs/theory/motion/cleaning.md once more, over frames in place of cosines: a ridge regression on the other markers,
/// then the mean of a Gaussian process in the gap, given what it deviates by within five memories around it.
PositionMatrix likeliestPlaces(const MotionClip& clip, const Gap& gap, Seconds memory, double noise_mm) {
  constexpr double kReach = 5;
  const auto reach = static_cast<Eigen::Index>(std::ceil(kReach * memory * clip.frame_rate_hz));
  const Eigen::Index first = std::max<Eigen::Index>(0, gap.first.row() - reach);
  const Eigen::Index last = std::min(clip.positions_mm.rows(), gap.last.row() + reach), length = last - first;
  const Eigen::Index marker = gap.marker.row(), gap_length = gap.last.row() - gap.first.row();
  const Eigen::Index others = clip.positions_mm.cols() - 3;
  PositionMatrix inputs(clip.positions_mm.rows(), others);
  inputs << clip.positions_mm.leftCols(3 * marker), clip.positions_mm.rightCols(others - 3 * marker);
  const PositionMatrix own = clip.positions_mm.middleCols(3 * marker, 3);
  std::vector<Eigen::Index> seen, near;
  for (Eigen::Index frame = 0; frame < own.rows(); ++frame) {
    if (!own.row(frame).allFinite()) continue;
    seen.push_back(frame);
    if (frame >= first && frame < last) near.push_back(frame);
  }
  PositionMatrix told = PositionMatrix::Zero(own.rows(), 3);
  if (others > 0) {
    const PositionMatrix x = inputs(seen, Eigen::all), y = own(seen, Eigen::all);
    const Eigen::RowVectorXd x_mean = x.colwise().mean(), y_mean = y.colwise().mean();
    const Eigen::MatrixXd xc = x.rowwise() - x_mean, yc = y.rowwise() - y_mean;
    const Eigen::MatrixXd ridge =
        static_cast<double>(seen.size()) * noise_mm * noise_mm * Eigen::MatrixXd::Identity(others, others);
    const Eigen::MatrixXd weights = (xc.transpose() * xc + ridge).fullPivLu().solve(xc.transpose() * yc);
    told = ((inputs.rowwise() - x_mean) * weights).rowwise() + y_mean;
  }
  PositionMatrix deviations = own(near, Eigen::all) - told(near, Eigen::all);
  const Eigen::RowVector3d mean = deviations.colwise().mean();
  deviations.rowwise() -= mean;
  const double variance =
      std::max(deviations.squaredNorm() / static_cast<double>(deviations.size()), noise_mm * noise_mm);
  // The covariance of frames i and j: sum over cosines k of s_k c_k(i) c_k(j).
  Eigen::VectorXd strengths(length);
  for (Eigen::Index k = 0; k < length; ++k) {
    const double w = std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
    strengths(k) = std::pow(1 + std::pow(w * clip.frame_rate_hz * memory, 2) / 5, -3);
  }
  strengths *= variance * static_cast<double>(length) / strengths.sum();
  const auto covariance = [&](Eigen::Index i, Eigen::Index j) {
    double sum = 0;
    for (Eigen::Index k = 0; k < length; ++k) {
      const double unit = (k == 0 ? 1.0 : 2.0) / static_cast<double>(length);
      const double step = std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
      sum += strengths(k) * unit * std::cos(step * (static_cast<double>(i - first) + 0.5)) *
             std::cos(step * (static_cast<double>(j - first) + 0.5));
    }
    return sum;
  };
  const auto count = static_cast<Eigen::Index>(near.size());
  Eigen::MatrixXd among(count, count), across(gap_length, count);
  for (Eigen::Index j = 0; j < count; ++j) {
    for (Eigen::Index i = 0; i < count; ++i)
      among(i, j) = covariance(near[static_cast<std::size_t>(i)], near[static_cast<std::size_t>(j)]);
    for (Eigen::Index i = 0; i < gap_length; ++i)
      across(i, j) = covariance(gap.first.row() + i, near[static_cast<std::size_t>(j)]);
  }
  among.diagonal().array() += noise_mm * noise_mm;
  return (across * among.fullPivLu().solve(deviations) + told.middleRows(gap.first.row(), gap_length)).rowwise() + mean;
}

TEST(GapLaws, FilledPlacesAreTheLikeliestOnes) {
  constexpr double kAgreeMm = 1e-6, kLeastNoiseMm = 0.02;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const bool has_noise = seed % 2 == 0;
    MotionClip clip = SyntheticMotion(seed, seed % 3 == 0 ? 1 : 4).clip(kRateHz, 150);
    std::normal_distribution<double> noise(0, 0.1);
    if (has_noise) clip.positions_mm = clip.positions_mm.unaryExpr([&](double mm) { return mm + noise(random); });
    const auto first = static_cast<Eigen::Index>(5 + random() % 100);
    hide(clip, 0, first, static_cast<Eigen::Index>(1 + random() % 36));
    const GapFillOptions options{.memory = 0.05 + 0.01 * (seed % 5)};
    const std::vector<Gap> gaps = findGaps(clip);
    ASSERT_EQ(gaps.size(), 1U);
    const FilledMotion filled = fillShortGaps(clip, options);
    ASSERT_EQ(filled.report.filled.size(), 1U);
    const double noise_mm = std::max(filled.report.noise_mm, kLeastNoiseMm);
    if (!has_noise) {
      EXPECT_EQ(noise_mm, kLeastNoiseMm) << "or the floor is not tried";
    }
    const PositionMatrix expected = likeliestPlaces(clip, gaps[0], options.memory, noise_mm);
    const PositionMatrix found = filled.clip.positions_mm.block(first, 0, expected.rows(), 3);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), kAgreeMm);
  }
}

/// Other markers tell where a marker is once all were seen in twelve frames; before, the frames around it alone do.
TEST(GapLaws, ARegressionWantsTwelveFrames) {
  for (const Eigen::Index seen : {11, 12}) {
    MotionClip clip = SyntheticMotion(8, 4).clip(kRateHz, static_cast<std::size_t>(seen + 4));
    hide(clip, 0, 5, 4);
    MotionClip alone = clip;
    alone.marker_names.resize(1);
    alone.positions_mm = clip.positions_mm.leftCols(3).eval();
    const FilledMotion filled = fillShortGaps(clip);
    const std::vector<Gap> gaps = findGaps(clip);
    ASSERT_EQ(filled.report.filled.size(), 1U);
    const double noise_mm = std::max(filled.report.noise_mm, 0.02);
    const PositionMatrix found = filled.clip.positions_mm.block(5, 0, 4, 3);
    const GapFillOptions options;
    const PositionMatrix with_others = likeliestPlaces(clip, gaps[0], options.memory, noise_mm);
    const PositionMatrix by_itself = likeliestPlaces(alone, gaps[0], options.memory, noise_mm);
    EXPECT_GT((with_others - by_itself).cwiseAbs().maxCoeff(), 1e-3) << "or nothing is told apart";
    EXPECT_LT((found - (seen < 12 ? by_itself : with_others)).cwiseAbs().maxCoeff(), 1e-6) << seen;
  }
}

/// A gap is filled up to its longest, at any rate, and not at a clip's ends.
TEST(GapLaws, TheLongestGapIsFilledAndNoLongerOne) {
  for (const double rate_hz : {25.0, 60.0, 100.0, 120.0}) {
    const GapFillOptions options{.longest = 0.2};
    const auto longest = static_cast<Eigen::Index>(std::lround(options.longest * rate_hz));
    for (const Eigen::Index length : {longest, longest + 1}) {
      MotionClip clip = SyntheticMotion(3, 4).clip(rate_hz, 90);
      hide(clip, 1, 30, length);
      EXPECT_EQ(fillShortGaps(clip, options).report.filled.size(), length == longest ? 1U : 0U) << rate_hz;
      MotionClip begin = SyntheticMotion(3, 4).clip(rate_hz, 90), end = begin;
      hide(begin, 1, 0, 2);
      hide(end, 1, 88, 2);
      EXPECT_EQ(fillShortGaps(begin, options).report.left.size(), 1U);
      EXPECT_EQ(fillShortGaps(end, options).report.left.size(), 1U);
    }
  }
}

TEST(SwapLaws, AnySequenceOfSwapsIsUndone) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    MotionClip truth = SyntheticMotion(seed, 6).clip(kRateHz, 200);
    for (Eigen::Index marker = 0; marker < 6; ++marker)  // 40 mm apart at least
      truth.positions_mm.middleCols<3>(3 * marker).col(0).array() += 250.0 * asReal(marker);
    MotionClip swapped = truth;
    const std::size_t count = 1 + random() % 4;
    for (std::size_t i = 0; i < count; ++i) {
      const auto from = static_cast<Eigen::Index>(10 + 40 * i + random() % 30);
      const auto a = static_cast<Eigen::Index>(random() % 6), b = (a + 1 + static_cast<Eigen::Index>(random() % 5)) % 6;
      const Eigen::Index rows = swapped.positions_mm.rows() - from;
      const PositionMatrix kept = swapped.positions_mm.block(from, 3 * a, rows, 3);
      swapped.positions_mm.block(from, 3 * a, rows, 3) = swapped.positions_mm.block(from, 3 * b, rows, 3).eval();
      swapped.positions_mm.block(from, 3 * b, rows, 3) = kept;
    }
    const RepairedSwaps repaired = repairSwaps(swapped);
    EXPECT_EQ(repaired.swaps.size(), count);
    EXPECT_EQ(repaired.clip.positions_mm, truth.positions_mm);
    EXPECT_TRUE(repairSwaps(truth).swaps.empty()) << "what is right stays";
    EXPECT_TRUE(repairSwaps(repaired.clip).swaps.empty());
  }
}

TEST(SpikeLaws, SpikesAreHiddenAndNothingElse) {
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    MotionClip clip = SyntheticMotion(seed, 5).clip(kRateHz, 200);
    EXPECT_TRUE(hideSpikes(clip).spikes.empty());
    PositionMatrix expected = clip.positions_mm;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto marker = static_cast<Eigen::Index>(random() % 5);
      const auto frame = 10 + 45 * i + static_cast<Eigen::Index>(random() % 30);
      const auto length = static_cast<Eigen::Index>(1 + random() % 3);
      const Eigen::RowVector3d away = 60 * Eigen::RowVector3d(1, -1, 0.5);
      clip.positions_mm.block(frame, 3 * marker, length, 3).rowwise() += away;
      expected.block(frame, 3 * marker, length, 3).setConstant(kNan);
    }
    const HiddenSpikes hidden = hideSpikes(clip);
    EXPECT_EQ(hidden.spikes.size(), 4U);
    ASSERT_EQ(hidden.clip.positions_mm.array().isNaN().count(), expected.array().isNaN().count());
    EXPECT_EQ(largestDifference(hidden.clip.positions_mm, expected), 0);
  }
}

TEST(SmoothingLaws, NoSampleMovesFurtherThanNoiseExplains) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const MotionClip clip = gappyClip(seed);
    const SmoothedMotion smoothed = smoothMotion(clip, {0.2});
    EXPECT_LE(largestDifference(smoothed.clip.positions_mm, clip.positions_mm), 2.5 * 0.2 + 1e-12);
    EXPECT_EQ(findGaps(smoothed.clip).size(), findGaps(clip).size()) << "gaps stay gaps";
    EXPECT_GE(smoothed.rms_change_mm, 0);
  }
}

TEST(SmoothingLaws, MovesWithTheRoomAndScalesWithTheNoise) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    MotionClip clip = gappyClip(seed);
    const PositionMatrix plain = smoothMotion(clip, {0.2}).clip.positions_mm;
    MotionClip large = clip;
    large.positions_mm *= 4;
    EXPECT_LT(largestDifference(smoothMotion(large, {0.8}).clip.positions_mm, 4 * plain), 1e-6);
    clip.positions_mm.array() += 100;
    EXPECT_LT(largestDifference(smoothMotion(clip, {0.2}).clip.positions_mm, (plain.array() + 100).matrix()), 1e-6);
  }
}

MarkerPositions randomShape(std::mt19937& random, Eigen::Index markers) {
  std::normal_distribution<double> any(0, 60);
  return MarkerPositions::NullaryExpr(markers, 3, [&] { return any(random); });
}

MarkerPositions applied(const RigidMotion& motion, const MarkerPositions& shape) {
  return (shape * motion.rotation.transpose()).rowwise() + motion.translation_mm.transpose();
}

TEST(RigidLaws, AnyRigidMotionIsRecovered) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MarkerPositions shape = randomShape(random, 3 + static_cast<Eigen::Index>(random() % 20));
    const RigidMotion motion = randomMotion(random);
    for (const int rounds : {0, 5}) {
      const std::optional<RigidMotion> found = fitRigidMotion(shape, applied(motion, shape), {rounds});
      ASSERT_TRUE(found.has_value());
      EXPECT_LT((found->rotation - motion.rotation).norm(), 1e-9);
      EXPECT_LT((found->translation_mm - motion.translation_mm).norm(), 1e-6);
      EXPECT_NEAR(found->rotation.determinant(), 1, 1e-12);
    }
  }
}

/// A fifth of the markers slips off; the others decide.
TEST(RigidLaws, AMinorityThatSlippedDoesNotDecide) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MarkerPositions shape = randomShape(random, 20);
    const RigidMotion motion = randomMotion(random);
    MarkerPositions target = applied(motion, shape);
    for (Eigen::Index i = 0; i < 4; ++i) target.row(5 * i) += Eigen::RowVector3d(40, -25, 10 + 5.0 * asReal(i));
    const std::optional<RigidMotion> found = fitRigidMotion(shape, target, {20});
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((applied(*found, shape) - applied(motion, shape)).rowwise().norm().maxCoeff(), 1.0);
  }
}

/// No rigid motion near the fitted one does better, in the sense in which it is the best.
TEST(RigidLaws, TheFitIsTheLeastSquaresOne) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const MarkerPositions shape = randomShape(random, 10);
    const MarkerPositions target = applied(randomMotion(random), shape) + 0.05 * randomShape(random, 10);
    const RigidMotion best = *fitRigidMotion(shape, target, {0});
    const double least = (applied(best, shape) - target).squaredNorm();
    for (int i = 0; i < 50; ++i) {
      std::normal_distribution<double> any(0, 1);
      const Eigen::AngleAxisd turn(0.01 * any(random), Eigen::Vector3d(any(random), any(random), 1).normalized());
      const RigidMotion other{turn * best.rotation, best.translation_mm + 0.5 * Eigen::Vector3d::Random()};
      EXPECT_GE((applied(other, shape) - target).squaredNorm(), least - kExactMm);
    }
  }
}

/// Around the line that they lie on they may have turned by anything.
TEST(RigidLaws, MarkersOnOneLineTellNoTurn) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> any(0, 60);
    const Eigen::RowVector3d direction = Eigen::RowVector3d(any(random), any(random), any(random)).normalized();
    MarkerPositions line(6, 3);
    for (Eigen::Index i = 0; i < 6; ++i) line.row(i) = Eigen::RowVector3d(5, -7, 11) + any(random) * direction;
    EXPECT_FALSE(fitRigidMotion(line, applied(randomMotion(random), line)).has_value());
    line.row(0) += 2 * direction.cross(Eigen::RowVector3d::UnitX()).normalized();
    EXPECT_TRUE(fitRigidMotion(line, applied(randomMotion(random), line)).has_value()) << "2 mm off it are enough";
  }
}

TEST(RigidLaws, MotionsFormAGroup) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const RigidMotion a = randomMotion(random), b = randomMotion(random), c = randomMotion(random);
    const Eigen::Vector3d point = 100 * Eigen::Vector3d::Random();
    EXPECT_LT((a.after(b).apply(point) - a.apply(b.apply(point))).norm(), kExactMm);
    EXPECT_LT((a.after(b).after(c).apply(point) - a.after(b.after(c)).apply(point)).norm(), kExactMm);
    EXPECT_LT((a.after(a.inverse()).apply(point) - point).norm(), kExactMm);
    EXPECT_LT((a.after(b).inverse().apply(point) - b.inverse().after(a.inverse()).apply(point)).norm(), kExactMm);
  }
}

}  // namespace
}  // namespace mouthpiece
