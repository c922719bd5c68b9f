#include "corpus_tools/takes/lip_fidelity.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace mouthpiece {
namespace {

/// Lips may be tightest a little outside of their label.
constexpr Seconds kAround = 0.020;

struct LipPaths {
  PositionMatrix mm;  ///< frames x 6
  double rate_hz = 0;
};

LipPaths lipPaths(const MotionClip& clip, const LipGauge& gauge) {
  LipPaths lips{PositionMatrix(clip.positions_mm.rows(), 6), clip.frame_rate_hz};
  lips.mm.leftCols<3>() = clip.positions_mm.middleCols<3>(gauge.column(MarkerRole::kUpperLip));
  lips.mm.rightCols<3>() = clip.positions_mm.middleCols<3>(gauge.column(MarkerRole::kLowerLip));
  return lips;
}

/// nullopt where a frame is missing.
std::optional<double> tightest(const LipPaths& lips, const TimeSpan& span) {
  const auto first = static_cast<Eigen::Index>(std::ceil((span.start - kAround) * lips.rate_hz));
  const auto last = static_cast<Eigen::Index>(std::floor((span.end + kAround) * lips.rate_hz));
  if (first < 0 || last >= lips.mm.rows() || last < first) return std::nullopt;
  const auto frames = lips.mm.middleRows(first, last - first + 1);
  if (!frames.allFinite()) return std::nullopt;
  return (frames.leftCols<3>() - frames.rightCols<3>()).rowwise().norm().minCoeff();
}

/// Third differences under a Hann window, taken apart by frequency.
LipFidelity::Bands jerkOf(const LipPaths& lips) {
  LipFidelity::Bands bands{};
  const Eigen::Index count = lips.mm.rows() - 3;
  if (count < 8 || !lips.mm.allFinite()) return bands;
  constexpr double kMetres = 0.001;
  const PositionMatrix& x = lips.mm;
  PositionMatrix jerk =
      kMetres * std::pow(lips.rate_hz, 3.0) *
      (x.bottomRows(count) - 3 * x.middleRows(2, count) + 3 * x.middleRows(1, count) - x.topRows(count));
  double power = 0;
  for (Eigen::Index t = 0; t < count; ++t) {
    const double window =
        0.5 - 0.5 * std::cos(2 * std::numbers::pi * static_cast<double>(t) / static_cast<double>(count));
    jerk.row(t) *= window;
    power += window * window;
  }
  for (Eigen::Index k = 0; 2 * k <= count; ++k) {
    const double hz = static_cast<double>(k) * lips.rate_hz / static_cast<double>(count);
    if (hz >= LipFidelity::kEdgesHz.back()) break;
    const double step = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(count);
    const Eigen::RowVectorXd phases = step * Eigen::RowVectorXd::LinSpaced(count, 0, static_cast<double>(count - 1));
    const double energy =
        (phases.array().cos().matrix() * jerk).squaredNorm() + (phases.array().sin().matrix() * jerk).squaredNorm();
    const double sides = k == 0 || 2 * k == count ? 1 : 2;
    const auto edge = std::upper_bound(LipFidelity::kEdgesHz.begin(), LipFidelity::kEdgesHz.end(), hz);
    bands[static_cast<std::size_t>(edge - LipFidelity::kEdgesHz.begin()) - 1] += sides * energy;
  }
  const double all = power * static_cast<double>(count) * static_cast<double>(jerk.cols());
  for (double& band : bands) band = std::sqrt(band / all);
  return bands;
}

}  // namespace

LipFidelity lipFidelity(const MotionClip& before, const MotionClip& after, const SpeechLabels& labels,
                        const LipGauge& gauge) {
  LipFidelity fidelity;
  if (!gauge.hasLips()) return fidelity;
  const LipPaths raw = lipPaths(before, gauge), clean = lipPaths(after, gauge);
  for (const LabelledPhone& phone : labels.phones) {
    if (!isBilabial(phone.phone)) continue;
    const auto was = tightest(raw, phone.span), is = tightest(clean, phone.span);
    if (was && is) fidelity.closure_changes_mm.push_back(*is - *was);
  }
  fidelity.jerk_before = jerkOf(raw);
  fidelity.jerk_after = jerkOf(clean);
  return fidelity;
}

}  // namespace mouthpiece
