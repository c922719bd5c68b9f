#include "synthesis/context_transfer.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/index.h"
#include "motion/blend.h"
#include "motion/lip_gauge.h"
#include "units/prediction/phone_shapes.h"

namespace mouthpiece {
namespace {

/// Pairs that nobody said are predicted to move less than they do: this share is added to what they move about the mean
/// within a Gaussian of that standard deviation (docs/theory/units/prediction.md).
constexpr double kUnsaidGain = 0.25;
constexpr Seconds kUnsaidWithin = 0.150;
constexpr Seconds kMeanWithin = 0.030;  ///< contextMean() has a value a few times a phone: smoothed over that

/// Rows smoothed by a Gaussian of that standard deviation; the ends are held.
Eigen::MatrixXd smoothed(const Eigen::MatrixXd& rows, Seconds deviation, Seconds spacing) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * deviation / spacing));
  Eigen::VectorXd kernel(2 * reach + 1);
  for (Eigen::Index i = -reach; i <= reach; ++i) {
    const double u = asReal(i) * spacing / deviation;
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
  Eigen::MatrixXd result(std::ssize(times), rows.cols());
  std::size_t next = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    while (next < known.size() && known[next] <= times[i]) ++next;
    const std::size_t after = std::min(next, known.size() - 1), before = next == 0 ? 0 : next - 1;
    const Seconds gap = known[after] - known[before];
    const double part = gap > 0 ? (times[i] - known[before]) / gap : 0.0;
    result.row(signedIndex(i)) = (1 - part) * rows.row(signedIndex(before)) + part * rows.row(signedIndex(after));
  }
  return result;
}

/// Opening of the lips that a change of the components by (1 x components) brings, mm a unit; and the change that opens
/// them by 1 mm as the speaker does.
struct LipWay {
  Eigen::VectorXd opening;
  Eigen::RowVectorXd opens;
};

LipWay wayOfLips(const TrajectoryModel& model, const LipGauge& lips) {
  LipWay way{Eigen::VectorXd::Zero(model.componentCount()), Eigen::RowVectorXd::Zero(model.componentCount())};
  if (!lips.hasLips() || model.closing.size() != model.columnCount()) return way;
  way.opening = lips.verticalOpenings(model.shapes);
  way.opens = model.closing * model.analysis;
  const double opened = way.opens * way.opening;
  constexpr double kMoves = 1e-3;
  way.opens = opened > kMoves ? Eigen::RowVectorXd(way.opens / opened) : Eigen::RowVectorXd::Zero(way.opens.size());
  return way;
}

/// 1 in the middles of the phones that close the lips, 0 in those of others; straight between.
Eigen::VectorXd closesAt(const SpeechLabels& line, std::span<const Seconds> times) {
  Eigen::MatrixXd closes = Eigen::MatrixXd::Zero(std::ssize(line.phones), 1);
  std::vector<Seconds> middles;
  for (std::size_t i = 0; i < line.phones.size(); ++i) {
    middles.push_back(line.phones[i].span.middle());
    if (isBilabial(line.phones[i].phone)) closes(signedIndex(i), 0) = 1;
  }
  return interpolated(closes, middles, times);
}

/// Where the line says pairs of phones that the corpus lacks, 1, elsewhere 0; straight between the phones' middles.
Eigen::VectorXd unsaidAt(const SpeechLabels& line, const UnitDatabase& database, std::span<const Seconds> times) {
  const std::vector<LabelledPhone>& phones = line.phones;
  Eigen::MatrixXd unsaid = Eigen::MatrixXd::Zero(std::ssize(phones), 1);
  std::vector<Seconds> middles;
  for (std::size_t i = 0; i < phones.size(); ++i) {
    middles.push_back(phones[i].span.middle());
    if (i == 0 || !database.diphones(phones[i - 1].phone, phones[i].phone).empty()) continue;
    for (const std::size_t beside : {i - 1, i}) {
      if (phones[beside].phone != Phone::kSil) unsaid(signedIndex(beside), 0) = 1;
    }
  }
  return interpolated(unsaid, middles, times);
}

/// times x components.
Eigen::MatrixXd lineComponents(const SpeechLabels& line, const UnitDatabase& database, std::span<const Seconds> times,
                               Seconds spacing, const ContextOptions& options, const HeardLine* heard) {
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
  if (options.restore_variance && options.restore_unsaid) {
    const Eigen::VectorXd unsaid = unsaidAt(line, database, times);
    if (!unsaid.isZero()) {
      const Eigen::MatrixXd moving = components - smoothed(components, kUnsaidWithin, spacing);
      Eigen::MatrixXd added = kUnsaidGain * unsaid.asDiagonal() * moving;
      // Lips that are to stay apart are not brought together.
      const LipWay way = wayOfLips(model, database.lips());
      const Eigen::VectorXd closer =
          (-(added * way.opening)).cwiseMax(0).cwiseProduct((1 - closesAt(line, times).array()).matrix());
      components += added + closer * way.opens;
    }
  }
  if (heard != nullptr) components += heard->at(times);
  return components;
}

/// What the fragments keep of their `residuals`: all that is fast, by component. Columns that do not move with speech
/// keep all. What was not seen counts as nothing.
PositionMatrix keptDetail(PositionMatrix residuals, const TrajectoryModel& model, Seconds spacing,
                          const MotionSettings& settings) {
  const auto moves_with_speech = [&](Eigen::Index column) { return (model.shapes.col(column).array() != 0).any(); };
  Eigen::VectorXd opening = Eigen::VectorXd::Zero(residuals.rows());
  for (Eigen::Index column = 0; column < residuals.cols(); ++column) {
    auto kept = residuals.col(column);
    kept = kept.unaryExpr([](double mm) { return std::isnan(mm) ? 0.0 : mm; }).eval();
    if (!moves_with_speech(column)) continue;
    const Eigen::VectorXd slow = smoothed(kept, settings.detail_within_ms / 1000, spacing);
    const Eigen::VectorXd fast = kept - slow;
    opening += fast * model.analysis(column, 0);
    kept = settings.slow_captured * slow + settings.other_detail * fast;
  }
  for (Eigen::Index column = 0; column < residuals.cols(); ++column) {
    if (moves_with_speech(column))
      residuals.col(column) += (settings.first_detail - settings.other_detail) * model.shapes(0, column) * opening;
  }
  return residuals;
}

/// What a contact of the lips brings down to a known least: of M B P the opening, of F V how far the lower lip hangs
/// below the place that it reaches the upper teeth at, which stand still in a head that does.
struct Contact {
  const LipGauge& lips;
  LipGauge::Measure gap;
  Eigen::RowVectorXd way;  ///< what the markers do when it grows by 1 mm
  double share;            ///< of what is left, that is taken away
  Seconds held, fall;      ///< how long it stays, and takes to come and go

  [[nodiscard]] double gapOf(const LipGauge::Pose& pose) const { return (lips.*gap)(pose); }
};

/// The least movement of the speaking face that lowers the lower lip by 1 mm and, as far as it can, leaves the upper
/// one.
Eigen::RowVectorXd wayOfLowerLip(const TrajectoryModel& model, const LipGauge& lips) {
  const Eigen::Index upper = lips.column(MarkerRole::kUpperLip), lower = lips.column(MarkerRole::kLowerLip);
  Eigen::MatrixXd heights(2, model.componentCount());
  heights << model.shapes.col(lower + 1).transpose(), model.shapes.col(upper + 1).transpose();
  const Eigen::VectorXd components = heights.completeOrthogonalDecomposition().solve(Eigen::Vector2d(-1, 0));
  const Eigen::RowVectorXd way = components.transpose() * model.shapes;
  constexpr double kMoves = 1e-3;
  return -way(lower + 1) > kMoves ? Eigen::RowVectorXd(way / -way(lower + 1)) : Eigen::RowVectorXd::Zero(way.size());
}

/// Least opening of phone `phone` of the line in the takes that play it; infinite where none was seen.
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

constexpr Seconds kAroundContact = 0.020;  ///< labels are that exact

/// The same of the lower lip's drop in an F V.
double capturedLeastDrop(std::size_t phone, const Contact& contact, const UnitDatabase& database,
                         const std::vector<SelectedUnit>& units) {
  double least = std::numeric_limits<double>::infinity();
  for (const SelectedUnit& unit : units) {
    if (phone < unit.phones.first.value || phone > unit.phones.last.value) continue;
    const PhonePlace place = advance(unit.source, phone - unit.phones.first.value);
    const LabelledPhone& source = database.phoneAt(place);
    if (!isLabiodental(source.phone)) continue;  // a stand-in
    const std::shared_ptr<const MotionClip> kept = database.motionOf(place.take);
    const MotionClip& motion = *kept;
    const double last = asReal(motion.frameCount() - 1);
    const auto frameAt = [&](Seconds time) {
      return static_cast<Eigen::Index>(std::lround(std::clamp(time * motion.frame_rate_hz, 0.0, last)));
    };
    const Eigen::Index end = frameAt(source.span.end + kAroundContact);
    for (Eigen::Index row = frameAt(source.span.start - kAroundContact); row <= end; ++row) {
      const double drop = contact.gapOf(motion.positions_mm.row(row));
      if (drop < least) least = drop;  // NaN is not
    }
  }
  return least;
}

/// `positions` with the tightest frame in `span` brought down to `wanted` where it is above, and the frames around it
/// with it.
PositionMatrix tightened(PositionMatrix positions, const TimeSpan& span, const Contact& contact, double wanted,
                         std::span<const Seconds> times) {
  const double rate = 1 / (times[1] - times[0]), last = asReal(times.size() - 1);
  const auto framesIn = [&](const TimeSpan& own) {
    const auto frameAt = [&](Seconds time) { return std::clamp((time - times[0]) * rate, 0.0, last); };
    return std::pair(static_cast<Eigen::Index>(std::ceil(frameAt(own.start))),
                     static_cast<Eigen::Index>(std::floor(frameAt(own.end))));
  };
  const auto [begin, end] = framesIn({span.start - kAroundContact, span.end + kAroundContact});
  Eigen::Index tightest = begin;
  for (Eigen::Index row = begin; row <= end; ++row) {
    if (contact.gapOf(positions.row(row)) < contact.gapOf(positions.row(tightest))) tightest = row;
  }
  const double left = contact.gapOf(positions.row(tightest)) - wanted;
  if (!(left > 0) || !std::isfinite(left)) return positions;
  const Seconds moment = times[unsignedIndex(tightest)], reach = contact.held + contact.fall;
  const auto [first, final] = framesIn({moment - reach, moment + reach});
  for (Eigen::Index row = first; row <= final; ++row) {
    const Seconds away = std::abs(times[unsignedIndex(row)] - moment) - contact.held;
    positions.row(row) -= contact.share * left * blendWeight(BlendKind::kSmooth, away / contact.fall) * contact.way;
  }
  return positions;
}

}  // namespace

TransferredMotion transferContext(PositionMatrix residuals, const SpeechLabels& line, const UnitDatabase& database,
                                  const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                                  const ContextOptions& options, const HeardLine* heard) {
  const Corpus& corpus = database.corpus();
  const TrajectoryModel& model = *corpus.trajectory_model;
  const Seconds spacing = times.size() > 1 ? times[1] - times[0] : 1.0;
  const MotionSettings settings = options.settings.value_or(corpus.motion_settings);
  TransferredMotion motion;
  motion.predicted_mm = lineComponents(line, database, times, spacing, options, heard) * model.shapes;
  motion.captured_mm = options.fragments ? keptDetail(std::move(residuals), model, spacing, settings)
                                         : PositionMatrix::Zero(residuals.rows(), residuals.cols());
  motion.positions_mm = motion.predicted_mm + motion.captured_mm;
  motion.positions_mm.rowwise() +=
      Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  if (options.keep_contacts)
    motion.positions_mm = keepContacts(std::move(motion.positions_mm), line, database, units, times, settings);
  return motion;
}

PositionMatrix TransferredMotion::contactMm(const MarkerPositions& neutral_mm,
                                            const std::vector<Eigen::Index>& columns) const {
  PositionMatrix contact(positions_mm.rows(), std::ssize(columns));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Eigen::Index column = columns[i];
    contact.col(signedIndex(i)) = positions_mm.col(column) - predicted_mm.col(column) - captured_mm.col(column);
    contact.col(signedIndex(i)).array() -= neutral_mm.data()[column];
  }
  return contact;
}

PositionMatrix keepContacts(PositionMatrix positions, const SpeechLabels& line, const UnitDatabase& database,
                            const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                            const MotionSettings& settings) {
  const TrajectoryModel& model = *database.corpus().trajectory_model;
  if (!(model.closed_opening_mm > 0) || times.size() < 2) return positions;
  const LipGauge& gauge = database.lips();
  const auto seconds = [](double ms) { return ms / 1000; };
  const Contact lips{
      gauge, &LipGauge::opening, model.closing, 1, seconds(settings.lips_held_ms), seconds(settings.lips_fall_ms)};
  // All of it, or for longer, would shut the mouth in vowels beside F and V that stay open in the capture.
  constexpr Seconds kTeethHeld = 0.005;
  const Contact teeth{gauge,      &LipGauge::lowerLipDrop,        wayOfLowerLip(model, gauge), settings.teeth_contact,
                      kTeethHeld, seconds(settings.teeth_fall_ms)};
  for (std::size_t phone = 0; phone < line.phones.size(); ++phone) {
    const LabelledPhone& own = line.phones[phone];
    if (isBilabial(own.phone)) {
      const double wanted = std::min(model.closed_opening_mm, capturedTightest(phone, database, units));
      positions = tightened(std::move(positions), own.span, lips, wanted, times);
    } else if (isLabiodental(own.phone)) {
      const double wanted = capturedLeastDrop(phone, teeth, database, units);
      positions = tightened(std::move(positions), own.span, teeth, wanted, times);
    }
  }
  return positions;
}

}  // namespace mouthpiece
