#include "motion/resample.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "base/errors.h"
#include "motion/blend.h"
#include "synthetic_motion.h"

namespace mouthpiece {
namespace {

constexpr double kExactToleranceMm = 1e-9;   // rounding of systems with condition below 1e4
constexpr double kWindowToleranceMm = 0.01;  // the promise: windowed and dense are the same motion

/// Strictly rising times whose spacings vary by `ratio`, in runs as phones have them.
std::vector<Seconds> unevenTimes(unsigned seed, std::size_t count, double ratio) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> exponent(-0.5, 0.5);
  std::uniform_int_distribution<int> run_length(1, 8);
  std::vector<Seconds> times{0.0};
  while (times.size() < count) {
    const double spacing = std::pow(ratio, exponent(random)) / 120.0;
    for (int i = run_length(random); i > 0 && times.size() < count; --i) times.push_back(times.back() + spacing);
  }
  return times;
}

std::vector<Seconds> queriesBetween(const std::vector<Seconds>& times, std::size_t per_spacing) {
  std::vector<Seconds> queries;
  for (std::size_t i = 0; i + 1 < times.size(); ++i) {
    for (std::size_t k = 0; k < per_spacing; ++k) {
      queries.push_back(std::lerp(times[i], times[i + 1], static_cast<double>(k) / static_cast<double>(per_spacing)));
    }
  }
  queries.push_back(times.back());
  return queries;
}

double largestDifference(const PositionMatrix& a, const PositionMatrix& b) { return (a - b).cwiseAbs().maxCoeff(); }

TEST(MotionResampler, MeetsEverySampleAtUnevenTimes) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const double ratio = seed % 2 == 0 ? 10.0 : 1000.0;
    const std::vector<Seconds> times = unevenTimes(seed, 200, ratio);
    const PositionMatrix values = SyntheticMotion(seed, 4).at(times);
    EXPECT_LT(largestDifference(MotionResampler(times, times).apply(values), values), kExactToleranceMm)
        << "seed " << seed;
    EXPECT_LT(largestDifference(resampleDense(times, values, times), values), kExactToleranceMm) << "seed " << seed;
  }
}

TEST(MotionResampler, ReproducesLinearPolynomials) {
  const std::vector<Seconds> times = frameTimes(0, 150, 120.0);
  const std::vector<Seconds> queries = queriesBetween(times, 3);
  const auto line = [](const std::vector<Seconds>& at) {
    PositionMatrix values(static_cast<Eigen::Index>(at.size()), 2);
    for (std::size_t i = 0; i < at.size(); ++i) values.row(static_cast<Eigen::Index>(i)) << 7.0, 3.0 - 40.0 * at[i];
    return values;
  };
  EXPECT_LT(largestDifference(MotionResampler(times, queries).apply(line(times)), line(queries)), 1e-9);
}

TEST(MotionResampler, ItsWeightsSumToOneAtUnevenTimes) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const std::vector<Seconds> times = unevenTimes(seed, 150, 100.0);
    const PositionMatrix ones = PositionMatrix::Ones(150, 1);
    const PositionMatrix result = MotionResampler(times, queriesBetween(times, 3)).apply(ones);
    EXPECT_LT((result.array() - 1.0).abs().maxCoeff(), 1e-11) << "seed " << seed;
  }
}

TEST(MotionResampler, HasNoJumpInVelocity) {
  const std::vector<Seconds> times = unevenTimes(9, 60, 10.0);
  const PositionMatrix values = SyntheticMotion(9, 2).at(times);
  for (std::size_t i = 2; i + 2 < times.size(); ++i) {
    const double step = 1e-4 * std::min(times[i] - times[i - 1], times[i + 1] - times[i]);
    const std::vector<Seconds> around{times[i] - 2 * step, times[i] - step, times[i] + step, times[i] + 2 * step};
    const PositionMatrix p = MotionResampler(times, around).apply(values);
    const double jump = ((p.row(3) - p.row(2)) - (p.row(1) - p.row(0))).cwiseAbs().maxCoeff() / step;
    const double speed = (p.row(3) - p.row(0)).cwiseAbs().maxCoeff() / (4.0 * step);
    EXPECT_LT(jump, 0.01 * (1.0 + speed)) << "at sample " << i;
  }
}

/// Eq. (1) as the paper writes it, for even samples, one a unit of time: inverse multiquadrics at all of them and a
/// line, solved at once. Written apart from the code under test. `values`: samples x channels.
PositionMatrix equation1(const PositionMatrix& values, const std::vector<double>& queries, double c) {
  const Eigen::Index n = values.rows();
  const auto phi = [c](double r) { return 1 / std::sqrt(r * r / (c * c) + 1); };
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 2, n + 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) system(i, j) = phi(static_cast<double>(i - j));
    system(i, n) = system(n, i) = 1;
    system(i, n + 1) = system(n + 1, i) = static_cast<double>(i);
  }
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(n + 2, values.cols());
  right.topRows(n) = values;
  const Eigen::MatrixXd weights = system.fullPivLu().solve(right);
  PositionMatrix result(std::ssize(queries), values.cols());
  for (Eigen::Index q = 0; q < result.rows(); ++q) {
    const double x = queries[static_cast<std::size_t>(q)];
    Eigen::RowVectorXd basis(n + 2);
    for (Eigen::Index i = 0; i < n; ++i) basis[i] = phi(x - static_cast<double>(i));
    basis.tail<2>() << 1, x;
    result.row(q) = basis * weights;
  }
  return result;
}

TEST(MotionResampler, SolvesEquation1) {
  constexpr std::size_t kSamples = 80;
  constexpr Eigen::Index kMirrored = 8;  // ResampleOptions::margin_samples beyond each end
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const std::vector<Seconds> times = frameTimes(0, kSamples, 100.0);
    const PositionMatrix values = SyntheticMotion(seed, 3, 10.0).at(times);
    const Eigen::Index last = values.rows() - 1;
    PositionMatrix mirrored(values.rows() + 2 * kMirrored, values.cols());
    mirrored.middleRows(kMirrored, values.rows()) = values;
    for (Eigen::Index k = 1; k <= kMirrored; ++k) {
      mirrored.row(kMirrored - k) = 2 * values.row(0) - values.row(k);
      mirrored.row(kMirrored + last + k) = 2 * values.row(last) - values.row(last - k);
    }
    const std::vector<Seconds> queries = queriesBetween(times, 4);
    std::vector<double> places;
    for (const Seconds time : queries) places.push_back(time * 100.0 + kMirrored);
    const PositionMatrix wanted = equation1(mirrored, places, ResampleOptions{}.shape);
    EXPECT_LT(largestDifference(resampleDense(times, values, queries), wanted), 1e-8) << "seed " << seed;
    EXPECT_LT(largestDifference(MotionResampler(times, queries).apply(values), wanted), kWindowToleranceMm)
        << "seed " << seed;
  }
}

/// docs/theory/motion/resampling.md: windows of so many samples, the next so much further on, each solved by itself and
/// blended with its neighbour where both know enough of what is around.
TEST(MotionResampler, WindowsAreSolvedByThemselvesAndBlended) {
  const ResampleOptions options{.shape = 1.3, .window_samples = 40, .margin_samples = 6, .overlap_samples = 5};
  const Eigen::Index margin = 6, overlap = 5, length = 40, step = length - 2 * margin - overlap;
  for (const std::size_t samples : {20U, 28U, 29U, 51U, 52U, 97U, 140U}) {
    SCOPED_TRACE(samples);
    const std::vector<Seconds> times = frameTimes(0, samples, 1.0);
    const PositionMatrix values = SyntheticMotion(9, 2, 10.0).at(frameTimes(0, samples, 100.0));
    const Eigen::Index last = values.rows() - 1, total = values.rows() + 2 * margin;
    PositionMatrix mirrored(total, values.cols());
    mirrored.middleRows(margin, values.rows()) = values;
    for (Eigen::Index k = 1; k <= margin; ++k) {
      mirrored.row(margin - k) = 2 * values.row(0) - values.row(k);
      mirrored.row(margin + last + k) = 2 * values.row(last) - values.row(last - k);
    }
    const std::vector<Seconds> queries = queriesBetween(times, 5);
    PositionMatrix wanted = PositionMatrix::Zero(std::ssize(queries), values.cols());
    std::vector<double> weight(queries.size(), 1);  // what earlier windows have left to this one
    for (Eigen::Index first = 0;; first += step) {
      const Eigen::Index count = std::min(length, total - first);
      const bool is_last = first + count == total;
      std::vector<double> places;
      for (const Seconds time : queries) places.push_back(time + static_cast<double>(margin - first));
      const PositionMatrix own = equation1(mirrored.middleRows(first, count), places, options.shape);
      for (std::size_t q = 0; q < queries.size(); ++q) {
        const double fades = is_last ? 0 : (places[q] - static_cast<double>(length - margin - overlap)) / overlap;
        const double stays = is_last ? 1 : blendWeight(BlendKind::kSmooth, fades);
        wanted.row(static_cast<Eigen::Index>(q)) += weight[q] * stays * own.row(static_cast<Eigen::Index>(q));
        weight[q] *= 1 - stays;
      }
      if (is_last) break;
    }
    EXPECT_LT(largestDifference(MotionResampler(times, queries, options).apply(values), wanted), 1e-7);
  }
}

TEST(MotionResampler, IsLinearInTheValuesAndBlindToTheClock) {
  const std::vector<Seconds> times = unevenTimes(3, 120, 10.0);
  const std::vector<Seconds> queries = queriesBetween(times, 3);
  const PositionMatrix a = SyntheticMotion(3, 2).at(times), b = SyntheticMotion(4, 2).at(times);
  const MotionResampler resampler(times, queries);
  EXPECT_LT(largestDifference(resampler.apply(2 * a - b), 2 * resampler.apply(a) - resampler.apply(b)), 1e-9);
  std::vector<Seconds> later = times, later_queries = queries;
  for (Seconds& time : later) time = 8 + 2 * time;  // exact: powers of two
  for (Seconds& time : later_queries) time = 8 + 2 * time;
  EXPECT_LT(largestDifference(MotionResampler(later, later_queries).apply(a), resampler.apply(a)), 1e-6)
      << "another clock, the same samples";
}

TEST(MotionResampler, BackwardsIsTheSame) {
  const std::vector<Seconds> times = unevenTimes(5, 30, 10.0);  // one window: windows are laid from the front
  const std::vector<Seconds> queries = queriesBetween(times, 3);
  const PositionMatrix values = SyntheticMotion(5, 2).at(times);
  const auto mirrored = [&](const std::vector<Seconds>& forwards) {
    std::vector<Seconds> back;
    for (auto time = forwards.rbegin(); time != forwards.rend(); ++time) back.push_back(times.back() - *time);
    return back;
  };
  const PositionMatrix back = resampleDense(mirrored(times), values.colwise().reverse(), mirrored(queries));
  EXPECT_LT(largestDifference(back.colwise().reverse(), resampleDense(times, values, queries)), 1e-8);
}

TEST(MotionResampler, WindowedAgreesWithDenseOnSyntheticMotion) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const double ratio : {1.0, 10.0}) {
      const std::vector<Seconds> times = unevenTimes(seed, 360, ratio);
      const std::vector<Seconds> queries = queriesBetween(times, 2);
      const PositionMatrix values = SyntheticMotion(seed, 4, 10.0).at(times);
      EXPECT_LT(largestDifference(MotionResampler(times, queries).apply(values), resampleDense(times, values, queries)),
                kWindowToleranceMm)
          << "seed " << seed << " ratio " << ratio;
    }
  }
}

TEST(MotionResampler, WindowedAgreesWithDenseOnRealSpeech) {
  const std::vector<MotionClip> takes = realTakes(20);
  if (takes.empty()) GTEST_SKIP() << "no real capture at " << realTakesFolder();
  double worst = 0.0;
  for (std::size_t i = 0; i < takes.size(); ++i) {
    if (!takes[i].positions_mm.allFinite()) continue;
    std::vector<Seconds> times = frameTimes(0, takes[i].frameCount(), takes[i].frame_rate_hz);
    if (i % 2 == 1) {
      times = unevenTimes(static_cast<unsigned>(i), times.size(), 10.0);
    }
    const std::vector<Seconds> queries = queriesBetween(times, 3);
    worst = std::max(worst, largestDifference(MotionResampler(times, queries).apply(takes[i].positions_mm),
                                              resampleDense(times, takes[i].positions_mm, queries)));
  }
  EXPECT_LT(worst, kWindowToleranceMm);
  RecordProperty("worst_mm", std::to_string(worst));
}

TEST(MotionResampler, StaysStableWhenSpacingVariesAThousandfold) {
  // The sum of the weights' sizes bounds how much noise or a step can grow; that of even samples is 1.62.
  constexpr double kLargestAmplification = 2.0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const std::vector<Seconds> times = unevenTimes(seed, 60, seed % 2 == 0 ? 10.0 : 1000.0);
    const std::vector<Seconds> queries = queriesBetween(times, 5);
    const PositionMatrix weights = MotionResampler(times, queries).apply(PositionMatrix::Identity(60, 60));
    EXPECT_LT(weights.cwiseAbs().rowwise().sum().maxCoeff(), kLargestAmplification) << "seed " << seed;
  }
}

TEST(MotionResampler, RecoversSmoothMotionBetweenItsSamples) {
  const SyntheticMotion motion(3, 4, 10.0);
  const std::vector<Seconds> times = frameTimes(0, 240, 120.0);
  std::vector<Seconds> queries = frameTimes(20, 200, 120.0);
  for (Seconds& time : queries) time += 0.41 / 120.0;
  const PositionMatrix back = MotionResampler(times, queries).apply(motion.at(times));
  EXPECT_LT(largestDifference(back, motion.at(queries)), 0.01);
}

TEST(MotionResampler, HoldsTheEndsOutside) {
  const std::vector<Seconds> times{0.0, 0.1, 0.2, 0.3};
  const std::vector<Seconds> queries{-5.0, 0.0, 0.3, 9.0};
  const PositionMatrix values = SyntheticMotion(1, 1).at(times);
  const PositionMatrix result = MotionResampler(times, queries).apply(values);
  EXPECT_LT((result.row(0) - values.row(0)).norm(), 1e-9);
  EXPECT_LT((result.row(3) - values.row(3)).norm(), 1e-9);
}

TEST(MotionResampler, TakesOneOrTwoSamples) {
  const std::vector<Seconds> queries{-1.0, 0.25, 2.0};
  const PositionMatrix one = PositionMatrix::Constant(1, 3, 5.0);
  EXPECT_LT((MotionResampler(std::vector<Seconds>{0.0}, queries).apply(one).array() - 5.0).abs().maxCoeff(), 1e-12);
  PositionMatrix two(2, 1);
  two << 1.0, 3.0;
  const PositionMatrix line = MotionResampler(std::vector<Seconds>{0.0, 1.0}, queries).apply(two);
  EXPECT_NEAR(line(1, 0), 1.5, 1e-12);
  EXPECT_NEAR(line(2, 0), 3.0, 1e-12);
}

TEST(MotionResampler, RefusesTimesThatDoNotRise) {
  const std::vector<Seconds> queries{0.0};
  EXPECT_THROW(MotionResampler(std::vector<Seconds>{}, queries), InternalError);
  EXPECT_THROW(MotionResampler(std::vector<Seconds>{0.0, 0.0}, queries), InternalError);
  EXPECT_THROW(MotionResampler(std::vector<Seconds>{0.0, 1.0}, std::vector<Seconds>{1.0, 0.5}), InternalError);
}

TEST(ResampleWarped, TheIdentityChangesNothing) {
  const MotionClip clip = SyntheticMotion(4, 6).clip(120.0, 333);
  const PositionMatrix same = resampleWarped(clip, TimeWarp({{0.0, 0.0}, {2.0, 2.0}}), frameTimes(0, 333, 120.0));
  EXPECT_LT(largestDifference(same, clip.positions_mm), kExactToleranceMm);
}

TEST(ResampleWarped, MovesEachFrameToItsWarpedTime) {
  const MotionClip clip = SyntheticMotion(5, 2).clip(120.0, 240);
  const TimeWarp warp({{0.2, 1.0}, {0.5, 1.9}, {0.8, 2.0}, {1.5, 2.3}});
  std::vector<Seconds> targets;
  for (std::size_t frame = 20; frame < 190; ++frame)
    targets.push_back(warp.targetFromSource(clip.timeOf(FrameIndex(frame))));
  EXPECT_LT(largestDifference(resampleWarped(clip, warp, targets), clip.positions_mm.middleRows(20, 170)),
            kExactToleranceMm);
}

TEST(ResampleWarped, UsesOnlyFramesNearTheQueries) {
  const MotionClip clip = SyntheticMotion(6, 2).clip(120.0, 2000);
  const TimeWarp warp({{0.0, 0.0}});
  const std::vector<Seconds> queries{8.001, 8.013, 8.02};
  const PositionMatrix all = MotionResampler(frameTimes(0, 2000, 120.0), queries).apply(clip.positions_mm);
  EXPECT_LT(largestDifference(resampleWarped(clip, warp, queries), all), kWindowToleranceMm);
}

TEST(ResampleWarped, AGapStaysAGapAndDoesNotSpread) {
  MotionClip clip = SyntheticMotion(7, 3).clip(100.0, 100);
  const PositionMatrix truth = resampleClip(clip, 250.0).positions_mm;
  clip.positions_mm.block(40, 3, 5, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  const MotionClip resampled = resampleClip(clip, 250.0);
  ASSERT_EQ(resampled.frameCount(), 250U);
  for (std::size_t frame = 0; frame < 250; ++frame) {
    const Seconds time = resampled.timeOf(FrameIndex(frame));
    const bool in_gap = time > 0.39 + 1e-9 && time < 0.45 - 1e-9;
    EXPECT_EQ(resampled.isSeen(FrameIndex(frame), MarkerIndex(1)), !in_gap) << "at " << time;
    EXPECT_TRUE(resampled.isSeen(FrameIndex(frame), MarkerIndex(0)));
    if (!in_gap) {
      EXPECT_LT((resampled.position(FrameIndex(frame), MarkerIndex(1)) -
                 truth.block<1, 3>(static_cast<Eigen::Index>(frame), 3).transpose())
                    .norm(),
                0.1)
          << "at " << time;
    }
  }
  clip.positions_mm.middleCols(0, 3).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(resampleClip(clip, 50.0).positions_mm.middleCols(0, 3).array().isNaN().all());
}

TEST(ResampleClip, KeepsTheDuration) {
  const MotionClip clip = SyntheticMotion(8, 1).clip(25.0, 75);
  EXPECT_EQ(resampleClip(clip, 60.0).frameCount(), 180U);
  EXPECT_EQ(resampleClip(clip, 24.0).frameCount(), 72U);
  EXPECT_LT(largestDifference(resampleClip(clip, 25.0).positions_mm, clip.positions_mm), kExactToleranceMm);
}

}  // namespace
}  // namespace mouthpiece
