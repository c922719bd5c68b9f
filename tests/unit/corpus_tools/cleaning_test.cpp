// The whole cleaning against the sample capture's clean truth (docs/theory/motion/cleaning.md).
#include "corpus_tools/takes/cleaning.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "corpus_tools/building/corpus_builder.h"
#include "synthetic_takes.h"

namespace mouthpiece {
namespace {

/// Distance of the cleaned face from the truth, rms in 3-D over all markers and frames, mm.
double errorMm(const MotionClip& cleaned, const MotionClip& truth) {
  const PositionMatrix error = cleaned.positions_mm - truth.positions_mm;
  double squared = 0, count = 0;
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    if (!std::isfinite(error.data()[i])) continue;
    squared += error.data()[i] * error.data()[i];
    count += 1.0 / 3;
  }
  return std::sqrt(squared / count);
}

HeadReference referenceOf(const SyntheticTake& take) { return estimateHeadReference({take.raw()}, defaultLayout()); }

CleanedFace cleaned(const RawTake& raw, const HeadReference& reference, const CleaningOptions& options = {}) {
  return cleanFace(raw, reference, defaultLayout(), options);
}

void exchange(MotionClip& clip, std::size_t a, std::size_t b, Eigen::Index first) {
  const Eigen::Index rows = clip.positions_mm.rows() - first;
  const auto column = [](std::size_t marker) { return static_cast<Eigen::Index>(3 * marker); };
  const PositionMatrix kept = clip.positions_mm.block(first, column(a), rows, 3);
  clip.positions_mm.block(first, column(a), rows, 3) = clip.positions_mm.block(first, column(b), rows, 3).eval();
  clip.positions_mm.block(first, column(b), rows, 3) = kept;
}

TEST(CleanFace, RepairsASwapAndASpikeAndSaysSo) {
  SyntheticTake take;
  take.noise_mm = 0.05;
  RawTake raw = take.raw();
  const CleanedFace sound = cleaned(raw, referenceOf(take));
  EXPECT_EQ(sound.report.swaps + sound.report.spikes, 0U);
  const std::size_t left = defaultLayout().indexOf("LIP_CORNER_L").value;
  const std::size_t right = defaultLayout().indexOf("LIP_CORNER_R").value;
  exchange(raw.face, left, right, 50);
  const auto brow = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("FOREHEAD_TOP").value);
  raw.face.positions_mm(30, brow) += 15;
  const CleanedFace repaired = cleaned(raw, referenceOf(take));
  EXPECT_EQ(repaired.report.swaps, 1U);
  EXPECT_EQ(repaired.report.spikes, 1U);
  EXPECT_EQ(repaired.report.filled_samples, 1U);
  EXPECT_LT((repaired.motion.positions_mm - sound.motion.positions_mm).cwiseAbs().maxCoeff(), 0.5);
  CleaningOptions off;
  off.repair_swaps = off.hide_spikes = false;
  const CleanedFace left_alone = cleaned(raw, referenceOf(take), off);
  EXPECT_EQ(left_alone.report.swaps + left_alone.report.spikes, 0U);
  EXPECT_GT((left_alone.motion.positions_mm - sound.motion.positions_mm).cwiseAbs().maxCoeff(), 10);
}

TEST(CleanFace, HalvesTheNoiseAtLeast) {
  SyntheticTake take;
  take.noise_mm = 0.1;
  take.frame_rate_hz = 120;
  take.has_jig = true;
  const SyntheticTake quiet = [&] {
    SyntheticTake same = take;
    same.noise_mm = 0;
    return same;
  }();
  CleaningOptions rough;
  rough.smooth = false;
  const HeadReference reference = referenceOf(quiet);
  const MotionClip truth = cleaned(quiet.raw(), reference, rough).motion;
  const double before = errorMm(cleaned(take.raw(), reference, rough).motion, truth);
  const double after = errorMm(cleaned(take.raw(), reference).motion, truth);
  EXPECT_LT(after, 0.5 * before) << before << " mm before";
}

TEST(CleanFace, AGapTooLongStaysMissing) {
  SyntheticTake take;
  RawTake raw = take.raw();
  const auto chin = static_cast<Eigen::Index>(3 * defaultLayout().indexOf("CHIN_MID").value);
  raw.face.positions_mm.block(40, chin, 50, 3).setConstant(std::nan(""));  // 0.5 s at 100 Hz
  const CleanedFace face = cleaned(raw, referenceOf(take));
  EXPECT_EQ(face.report.gap_samples, 50U);
  EXPECT_EQ(face.report.missing_samples, 50U);
  EXPECT_TRUE(std::isnan(face.motion.positions_mm(60, chin)));
}

TEST(LipFidelity, TellsJerkByFrequencyAndClosuresByDepth) {
  constexpr double kRate = 120, kHz = 8, kAmplitudeMm = 2;
  MotionClip before{kRate, {"LIP_UP_MID", "LIP_LO_MID"}, PositionMatrix::Zero(483, 6)};
  for (Eigen::Index frame = 0; frame < 483; ++frame)
    before.positions_mm(frame, 4) =
        -5 + kAmplitudeMm * std::sin(2 * std::numbers::pi * kHz * static_cast<double>(frame) / kRate);
  MotionClip after = before;
  after.positions_mm.col(4).array() -= 0.25;
  SpeechLabels labels;
  using enum Phone;
  for (const auto& [phone, start] : std::vector<std::pair<Phone, Seconds>>{{kSil, 0}, {kB, 1}, {kIY, 1.25}, {kM, 2}})
    labels.phones.push_back({phone, {start, start + 0.25}, {}, {}});
  labels.phones.push_back({kP, {3.95, 4.2}, {}, {}});  // past the end
  const LipFidelity lips = lipFidelity(before, after, labels, LipGauge(before.marker_names));
  ASSERT_EQ(lips.closure_changes_mm.size(), 2U);
  for (const double change : lips.closure_changes_mm) EXPECT_NEAR(change, 0.25, 1e-9);
  // A third difference multiplies a sine by (2 f sin(pi hz / f))^3; one of six coordinates moves.
  const double jerk = 0.001 * kAmplitudeMm * std::pow(2 * kRate * std::sin(std::numbers::pi * kHz / kRate), 3);
  EXPECT_NEAR(lips.jerk_before[2], jerk / std::sqrt(12.0), 0.01 * jerk) << "6 to 10 Hz";
  EXPECT_LT(lips.jerk_before[0] + lips.jerk_before[1] + lips.jerk_before[4], 0.01 * jerk);
  EXPECT_NEAR(lips.jerk_after[2], lips.jerk_before[2], 1e-6 * jerk);
  before.marker_names[0] = "OTHER";
  EXPECT_TRUE(lipFidelity(before, after, labels, LipGauge(before.marker_names)).closure_changes_mm.empty());
}

}  // namespace
}  // namespace mouthpiece
