#include "synthesis/context_transfer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "motion/blend.h"
#include "units/context_mean.h"
#include "units/phone_shapes.h"
#include "units/unit_costs.h"

namespace mouthpiece {
namespace {

constexpr Seconds kMeanWithin = 0.030;  ///< contextMean() has a value a few times a phone: smoothed over that

/// Rows smoothed by a Gaussian of that standard deviation; the ends are held.
Eigen::MatrixXd smoothed(const Eigen::MatrixXd& rows, Seconds deviation, Seconds spacing) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * deviation / spacing));
  Eigen::VectorXd kernel(2 * reach + 1);
  for (Eigen::Index i = -reach; i <= reach; ++i) {
    const double u = static_cast<double>(i) * spacing / deviation;
    kernel(i + reach) = std::exp(-0.5 * u * u);
  }
  kernel /= kernel.sum();
  Eigen::MatrixXd held(rows.rows() + 2 * reach, rows.cols());
  held.topRows(reach).rowwise() = rows.row(0);
  held.middleRows(reach, rows.rows()) = rows;
  held.bottomRows(reach).rowwise() = rows.row(rows.rows() - 1);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(rows.rows(), rows.cols());
  for (Eigen::Index i = 0; i < kernel.size(); ++i) result += kernel(i) * held.middleRows(i, rows.rows());
  return result;
}

/// Rows at `known` (rising) read at `times`, straight between them.
Eigen::MatrixXd interpolated(const Eigen::MatrixXd& rows, std::span<const Seconds> known,
                             std::span<const Seconds> times) {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(times.size()), rows.cols());
  std::size_t next = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    while (next < known.size() && known[next] <= times[i]) ++next;
    const auto after = static_cast<Eigen::Index>(std::min(next, known.size() - 1));
    const auto before = static_cast<Eigen::Index>(next == 0 ? 0 : next - 1);
    const Seconds gap = known[static_cast<std::size_t>(after)] - known[static_cast<std::size_t>(before)];
    const double part = gap > 0 ? (times[i] - known[static_cast<std::size_t>(before)]) / gap : 0.0;
    result.row(static_cast<Eigen::Index>(i)) = (1 - part) * rows.row(before) + part * rows.row(after);
  }
  return result;
}

/// times x components.
Eigen::MatrixXd lineComponents(const SpeechLabels& line, const UnitDatabase& database, std::span<const Seconds> times,
                               Seconds spacing, const ContextOptions& options) {
  const TrajectoryModel& model = *database.corpus().trajectory_model;
  Eigen::MatrixXd components = model.predict(line, times);
  if (options.average) {
    const Eigen::MatrixXd mean = contextMean(line, database);
    components.leftCols(mean.cols()) += smoothed(interpolated(mean, shapeTimes(line), times), kMeanWithin, spacing);
  }
  if (options.restore_variance) {
    components.rowwise() -= model.level;
    components *= model.gain;
    components.rowwise() += model.level;
  }
  return components;
}

/// What the fragments keep of their residuals: all that is fast, by component.
Eigen::MatrixXd keptDetail(const Eigen::MatrixXd& residuals, const TrajectoryModel& model, Seconds spacing,
                           const ContextOptions& options) {
  const Eigen::MatrixXd slow = smoothed(residuals, options.detail_within, spacing);
  const Eigen::MatrixXd fast = residuals - slow;
  const Eigen::VectorXd opening = fast * model.analysis.col(0);
  return options.slow_captured * slow + options.other_detail * fast +
         (options.first_detail - options.other_detail) * opening * model.shapes.row(0);
}

double openingOf(const PositionMatrix& positions, Eigen::Index row, Eigen::Index upper, Eigen::Index lower) {
  return (positions.block<1, 3>(row, upper) - positions.block<1, 3>(row, lower)).norm();
}

/// Least lip opening of phone `phone` of the line in the takes that play it; NaN where none was seen.
double capturedTightest(std::size_t phone, const UnitDatabase& database, const std::vector<SelectedUnit>& units) {
  double least = std::numeric_limits<double>::infinity();
  for (const SelectedUnit& unit : units) {
    if (phone < unit.phones.first.value || phone > unit.phones.last.value) continue;
    const PhonePlace place = advance(unit.source, phone - unit.phones.first.value);
    if (!isBilabial(database.phoneAt(place).phone)) continue;  // a stand-in
    const double opening = database.tightestMm(place);
    if (opening < least) least = opening;  // NaN is not
  }
  return least;
}

}  // namespace

PositionMatrix transferContext(const PositionMatrix& residuals, const SpeechLabels& line, const UnitDatabase& database,
                               std::span<const Seconds> times, const ContextOptions& options) {
  const Corpus& corpus = database.corpus();
  const TrajectoryModel& model = *corpus.trajectory_model;
  const Seconds spacing = times.size() > 1 ? times[1] - times[0] : 1.0;
  const Eigen::MatrixXd seen = residuals.unaryExpr([](double mm) { return std::isnan(mm) ? 0.0 : mm; });
  const Eigen::MatrixXd kept = keptDetail(seen, model, spacing, options);
  const Eigen::Map<const Eigen::RowVectorXd> neutral(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  PositionMatrix positions = lineComponents(line, database, times, spacing, options) * model.shapes;
  for (Eigen::Index column = 0; column < positions.cols(); ++column) {
    const bool moves_with_speech = (model.shapes.col(column).array() != 0).any();
    positions.col(column) += moves_with_speech ? kept.col(column) : seen.col(column);
  }
  positions.rowwise() += neutral;
  return positions;
}

void keepClosures(const SpeechLabels& line, const UnitDatabase& database, const std::vector<SelectedUnit>& units,
                  std::span<const Seconds> times, PositionMatrix& positions) {
  constexpr Seconds kAround = 0.020, kHeld = 0.015, kFall = 0.060;
  const Corpus& corpus = database.corpus();
  const TrajectoryModel& model = *corpus.trajectory_model;
  if (!(model.closed_opening_mm > 0) || times.size() < 2) return;
  const auto upper = static_cast<Eigen::Index>(3 * corpus.layout.indexOf("LIP_UP_MID").value);
  const auto lower = static_cast<Eigen::Index>(3 * corpus.layout.indexOf("LIP_LO_MID").value);
  const double rate = 1 / (times[1] - times[0]);
  const auto last = static_cast<double>(times.size() - 1);
  const auto frameAt = [&](Seconds time) { return std::clamp((time - times[0]) * rate, 0.0, last); };
  for (std::size_t phone = 0; phone < line.phones.size(); ++phone) {
    if (!isBilabial(line.phones[phone].phone)) continue;
    const TimeSpan& span = line.phones[phone].span;
    const double wanted = std::min(model.closed_opening_mm, capturedTightest(phone, database, units));
    const auto begin = static_cast<Eigen::Index>(std::ceil(frameAt(span.start - kAround)));
    const auto end = static_cast<Eigen::Index>(std::floor(frameAt(span.end + kAround)));
    Eigen::Index tightest = begin;
    for (Eigen::Index row = begin; row <= end; ++row) {
      if (openingOf(positions, row, upper, lower) < openingOf(positions, tightest, upper, lower)) tightest = row;
    }
    const double left = openingOf(positions, tightest, upper, lower) - wanted;
    if (!(left > 0)) continue;
    const Seconds moment = times[static_cast<std::size_t>(tightest)];
    const auto first = static_cast<Eigen::Index>(std::ceil(frameAt(moment - kHeld - kFall)));
    const auto final = static_cast<Eigen::Index>(std::floor(frameAt(moment + kHeld + kFall)));
    for (Eigen::Index row = first; row <= final; ++row) {
      const Seconds away = std::abs(times[static_cast<std::size_t>(row)] - moment) - kHeld;
      positions.row(row) -= left * blendWeight(BlendKind::kSmooth, away / kFall) * model.closing;
    }
  }
}

}  // namespace mouthpiece
