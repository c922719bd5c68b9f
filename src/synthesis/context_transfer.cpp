#include "synthesis/context_transfer.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
#include "base/index.h"
#include "motion/blend.h"
#include "motion/lip_gauge.h"

namespace mouthpiece {
namespace {

/// Pairs that nobody said are predicted to move less than they do: this share is added to what they move about the mean
/// within a Gaussian of that standard deviation (docs/theory/units/context_transfer.md).
constexpr double kUnsaidGain = 0.25;
constexpr Seconds kUnsaidWithin = 0.150;
constexpr double kSmoothedDeviations = 3;  ///< that a Gaussian is followed for
constexpr Seconds kMeanWithin = 0.030;     ///< contextMean() has a value a few times a phone: smoothed over that

/// Rows smoothed by a Gaussian of that standard deviation; the ends are held.
Eigen::MatrixXd smoothed(const Eigen::MatrixXd& rows, Seconds deviation, Seconds spacing) {
  const auto reach = static_cast<Eigen::Index>(std::ceil(kSmoothedDeviations * deviation / spacing));
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

/// A row a phone: 1 where the line says a pair that the corpus lacks.
Eigen::MatrixXd unsaidPhones(const std::vector<LabelledPhone>& phones, const UnitDatabase& database) {
  Eigen::MatrixXd unsaid = Eigen::MatrixXd::Zero(std::ssize(phones), 1);
  for (std::size_t i = 1; i < phones.size(); ++i) {
    if (!database.diphones(phones[i - 1].phone, phones[i].phone).empty()) continue;
    for (const std::size_t beside : {i - 1, i}) {
      if (phones[beside].phone != Phone::kSil) unsaid(signedIndex(beside), 0) = 1;
    }
  }
  return unsaid;
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

/// Those of `units`, which are in the line's order, that play a phone of the line.
std::span<const SelectedUnit> unitsPlaying(std::size_t phone, const std::vector<SelectedUnit>& units) {
  const auto first = std::partition_point(units.begin(), units.end(),
                                          [&](const SelectedUnit& unit) { return unit.phones.last.value < phone; });
  const auto end = std::partition_point(first, units.end(),
                                        [&](const SelectedUnit& unit) { return unit.phones.first.value <= phone; });
  return std::span(units).subspan(unsignedIndex(first - units.begin()), unsignedIndex(end - first));
}

/// Least opening of phone `phone` of the line in the takes that play it; infinite where none was seen.
double capturedTightest(std::size_t phone, const UnitDatabase& database, const std::vector<SelectedUnit>& units) {
  double least = std::numeric_limits<double>::infinity();
  for (const SelectedUnit& unit : unitsPlaying(phone, units)) {
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
  for (const SelectedUnit& unit : unitsPlaying(phone, units)) {
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

/// Of `positions`, rows of the line from `first_row` on, the tightest frame in `span` brought down to `wanted` where it
/// is above, and the frames around it with it.
void tighten(const TimeSpan& span, const Contact& contact, double wanted, std::span<const Seconds> times,
             Eigen::Index first_row, PositionMatrix& positions) {
  const double rate = 1 / (times[1] - times[0]), last = asReal(times.size() - 1);
  const auto framesIn = [&](const TimeSpan& own) {
    const auto frameAt = [&](Seconds time) { return std::clamp((time - times[0]) * rate, 0.0, last); };
    return std::pair(static_cast<Eigen::Index>(std::ceil(frameAt(own.start))),
                     static_cast<Eigen::Index>(std::floor(frameAt(own.end))));
  };
  const auto pose = [&](Eigen::Index row) { return positions.row(row - first_row); };
  const auto [begin, end] = framesIn({span.start - kAroundContact, span.end + kAroundContact});
  Eigen::Index tightest = begin;
  for (Eigen::Index row = begin; row <= end; ++row) {
    if (contact.gapOf(pose(row)) < contact.gapOf(pose(tightest))) tightest = row;
  }
  const double left = contact.gapOf(pose(tightest)) - wanted;
  if (!(left > 0) || !std::isfinite(left)) return;
  const Seconds moment = times[unsignedIndex(tightest)], reach = contact.held + contact.fall;
  const auto [first, final] = framesIn({moment - reach, moment + reach});
  for (Eigen::Index row = first; row <= final; ++row) {
    const Seconds away = std::abs(times[unsignedIndex(row)] - moment) - contact.held;
    pose(row) -= contact.share * left * blendWeight(BlendKind::kSmooth, away / contact.fall) * contact.way;
  }
}

}  // namespace

LineTransfer::LineTransfer(const SpeechLabels& line, const UnitDatabase& database, std::span<const Seconds> times,
                           const ContextOptions& options, const HeardLine* heard)
    : database_(database),
      times_(times),
      options_(options),
      heard_(heard),
      settings_(options.settings.value_or(database.corpus().motion_settings)),
      spacing_(times.size() > 1 ? times[1] - times[0] : 1.0),
      predicted_(options.predicted ? options.predicted
                                   : std::make_shared<PredictedLine>(*database.corpus().trajectory_model, line,
                                                                     LinePrediction::Keeps::kNothing)),
      unsaid_(unsaidPhones(line.phones, database)),
      closes_(Eigen::MatrixXd::Zero(std::ssize(line.phones), 1)) {
  constexpr std::size_t kRounding = 2;
  const Seconds smoothed_within = std::max(kUnsaidWithin + kMeanWithin, settings_.detail_within_ms / 1000);
  reach_ = static_cast<std::size_t>(std::ceil(kSmoothedDeviations * smoothed_within / spacing_)) + kRounding;
  if (options.average) {
    mean_ = contextMean(line, database, predicted_->shapes);
    mean_times_ = shapeTimes(line);
  }
  for (std::size_t i = 0; i < line.phones.size(); ++i) {
    middles_.push_back(line.phones[i].span.middle());
    if (isBilabial(line.phones[i].phone)) closes_(signedIndex(i), 0) = 1;
  }
}

/// Where the line says pairs of phones that the corpus lacks, it moves more.
void LineTransfer::moveUnsaid(std::span<const Seconds> times, Eigen::MatrixXd& components) const {
  const Eigen::VectorXd unsaid = interpolated(unsaid_, middles_, times);
  if (unsaid.isZero()) return;
  const Eigen::MatrixXd moving = components - smoothed(components, kUnsaidWithin, spacing_);
  Eigen::MatrixXd added = kUnsaidGain * unsaid.asDiagonal() * moving;
  // Lips that are to stay apart are not brought together.
  const LipWay way = wayOfLips(*database_.corpus().trajectory_model, database_.lips());
  const Eigen::VectorXd closes = interpolated(closes_, middles_, times);
  const Eigen::VectorXd closer = (-(added * way.opening)).cwiseMax(0).cwiseProduct((1 - closes.array()).matrix());
  components += added + closer * way.opens;
}

/// times x components.
Eigen::MatrixXd LineTransfer::componentsAt(std::span<const Seconds> times) const {
  const TrajectoryModel& model = *database_.corpus().trajectory_model;
  Eigen::MatrixXd components = predicted_->at_times.at(times);
  if (options_.average)
    components.leftCols(mean_.cols()) += smoothed(interpolated(mean_, mean_times_, times), kMeanWithin, spacing_);
  if (options_.restore_variance) {
    components.rowwise() -= model.level;
    components *= model.gain;
    components.rowwise() += model.level;
    if (options_.restore_unsaid) moveUnsaid(times, components);
  }
  if (heard_ != nullptr) components += heard_->at(times);
  return components;
}

TransferredMotion LineTransfer::rows(PositionMatrix residuals, std::size_t first, std::size_t end) const {
  const Corpus& corpus = database_.corpus();
  const TrajectoryModel& model = *corpus.trajectory_model;
  const std::size_t before = std::min(first, reach_);
  const std::span<const Seconds> wide =
      times_.subspan(first - before, std::min(times_.size(), end + reach_) - (first - before));
  MOUTHPIECE_EXPECT(residuals.rows() == std::ssize(wide));
  const auto own = [&](const auto& rows) { return rows.middleRows(signedIndex(before), signedIndex(end - first)); };
  TransferredMotion motion;
  motion.predicted_mm = own(componentsAt(wide)) * model.shapes;
  if (options_.fragments) {
    motion.captured_mm = keptDetail(std::move(residuals), model, spacing_, settings_);
    if (wide.size() > end - first) motion.captured_mm = own(motion.captured_mm).eval();
  } else {
    motion.captured_mm = PositionMatrix::Zero(motion.predicted_mm.rows(), residuals.cols());
  }
  motion.positions_mm = motion.predicted_mm + motion.captured_mm;
  motion.positions_mm.rowwise() +=
      Eigen::Map<const Eigen::RowVectorXd>(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  return motion;
}

TransferredMotion transferContext(PositionMatrix residuals, const SpeechLabels& line, const UnitDatabase& database,
                                  const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                                  const ContextOptions& options, const HeardLine* heard) {
  TransferredMotion motion =
      LineTransfer(line, database, times, options, heard).rows(std::move(residuals), 0, times.size());
  if (options.keep_contacts)
    motion.positions_mm = keepContacts(std::move(motion.positions_mm), line, database, units, times,
                                       options.settings.value_or(database.corpus().motion_settings));
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

ContactKeeper::ContactKeeper(const SpeechLabels& line, const UnitDatabase& database,
                             const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                             const MotionSettings& settings)
    : line_(line), database_(database), units_(units), times_(times), settings_(settings) {
  const TrajectoryModel& model = *database.corpus().trajectory_model;
  if (!(model.closed_opening_mm > 0) || times.size() < 2) {
    next_ = line.phones.size();
  } else {
    way_of_lower_lip_ = wayOfLowerLip(model, database.lips());
  }
}

std::size_t ContactKeeper::keep(std::size_t first, PositionMatrix& positions) {
  const TrajectoryModel& model = *database_.corpus().trajectory_model;
  const LipGauge& gauge = database_.lips();
  const auto seconds = [](double ms) { return ms / 1000; };
  const Contact lips{
      gauge, &LipGauge::opening, model.closing, 1, seconds(settings_.lips_held_ms), seconds(settings_.lips_fall_ms)};
  // All of it, or for longer, would shut the mouth in vowels beside F and V that stay open in the capture.
  constexpr Seconds kTeethHeld = 0.005;
  const Contact teeth{gauge,      &LipGauge::lowerLipDrop,         way_of_lower_lip_, settings_.teeth_contact,
                      kTeethHeld, seconds(settings_.teeth_fall_ms)};
  const Seconds reach = kAroundContact + std::max(lips.held + lips.fall, teeth.held + teeth.fall);
  const std::size_t end = first + unsignedIndex(positions.rows());
  for (; next_ < line_.phones.size(); ++next_) {
    const LabelledPhone& own = line_.phones[next_];
    const bool closes = isBilabial(own.phone);
    if (!closes && !isLabiodental(own.phone)) continue;
    if (end < times_.size() && own.span.end + reach >= times_[end - 1]) {
      const auto moved = std::lower_bound(times_.begin(), times_.end(), own.span.start - reach) - times_.begin();
      return std::clamp(unsignedIndex(std::max<std::ptrdiff_t>(0, moved - 1)), first, end);
    }
    const double wanted = closes ? std::min(model.closed_opening_mm, capturedTightest(next_, database_, units_))
                                 : capturedLeastDrop(next_, teeth, database_, units_);
    tighten(own.span, closes ? lips : teeth, wanted, times_, signedIndex(first), positions);
  }
  return end;
}

PositionMatrix keepContacts(PositionMatrix positions, const SpeechLabels& line, const UnitDatabase& database,
                            const std::vector<SelectedUnit>& units, std::span<const Seconds> times,
                            const MotionSettings& settings) {
  ContactKeeper(line, database, units, times, settings).keep(0, positions);
  return positions;
}

}  // namespace mouthpiece
