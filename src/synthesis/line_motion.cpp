#include "synthesis/line_motion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/index.h"
#include "synthesis/context_transfer.h"
#include "synthesis/motion_facts.h"
#include "synthesis/stages.h"

namespace mouthpiece {
namespace {

std::vector<SelectedUnit> unitsOf(const SynthesisPlan& plan) {
  std::vector<SelectedUnit> units;
  for (const Segment& segment : plan.segments) units.push_back(*segment.unit);
  return units;
}

/// Rows of the line, from the first that contacts may still move on.
struct UnsettledRows {
  std::size_t first = 0;
  TransferredMotion motion;

  void append(TransferredMotion more) {
    const auto put = [](PositionMatrix& rows, PositionMatrix added) {
      if (rows.rows() == 0) {
        rows = std::move(added);
        return;
      }
      rows.conservativeResize(rows.rows() + added.rows(), Eigen::NoChange);
      rows.bottomRows(added.rows()) = added;
    };
    put(motion.positions_mm, std::move(more.positions_mm));
    put(motion.predicted_mm, std::move(more.predicted_mm));
    put(motion.captured_mm, std::move(more.captured_mm));
  }

  /// Those before row `end` of the line.
  TransferredMotion take(std::size_t end) {
    const Eigen::Index count = signedIndex(end - first);
    TransferredMotion taken;
    for (auto rows :
         {&TransferredMotion::positions_mm, &TransferredMotion::predicted_mm, &TransferredMotion::captured_mm}) {
      taken.*rows = (motion.*rows).topRows(count);
      motion.*rows = (motion.*rows).bottomRows((motion.*rows).rows() - count).eval();
    }
    first = end;
    return taken;
  }
};

}  // namespace

struct LineMotion::State {
  State(SynthesisPlan given_plan, SynthesisRequest given, const UnitDatabase& captured, const AudioClip& its_sound,
        Seconds at_once)
      : plan(std::move(given_plan)),
        request(std::move(given)),
        database(captured),
        sound(its_sound),
        piece(at_once),
        own_model(captured),
        line{request.labels,
             request.options,
             database,
             request.options.curves.model != nullptr ? *request.options.curves.model : own_model,
             frameTimesOf(request),
             {},
             {},
             {}},
        units(unitsOf(plan)) {}

  SynthesisPlan plan;
  SynthesisRequest request;
  const UnitDatabase& database;
  const AudioClip& sound;
  Seconds piece;
  CurveModel own_model;
  LineToRender line;
  std::vector<SelectedUnit> units;
  // Made when motion is asked for first:
  std::optional<JoinedUnits> joined;
  std::optional<LineTransfer> transfer;

  void prepare();
  [[nodiscard]] TransferredMotion rows(std::size_t first, std::size_t end) const;
  MotionPiece finished(std::size_t first, const TransferredMotion& rows, std::vector<MovementShares>& shares) const;
};

void LineMotion::State::prepare() {
  if (joined) return;
  if (hearsSound(request.options, database.corpus()) && !request.measures && !sound.samples.empty())
    request.measures = soundMeasures(sound);
  line.heard = heardIn(request, database.corpus());
  request.measures = {};
  transfer.emplace(request.labels, database, line.times, request.options.context, line.heard ? &*line.heard : nullptr);
  joined.emplace(units, line, true);
}

TransferredMotion LineMotion::State::rows(std::size_t first, std::size_t end) const {
  const std::size_t wide_first = first - std::min(first, transfer->reach());
  const std::size_t wide_end = std::min(line.times.size(), end + transfer->reach());
  return transfer->rows(joined->rows(line.times, wide_first, wide_end), first, end);
}

MotionPiece LineMotion::State::finished(std::size_t first, const TransferredMotion& rows,
                                        std::vector<MovementShares>& shares) const {
  const std::vector<Eigen::Index>& lips = database.lipColumns();
  const auto begin = line.times.begin() + signedIndex(first);
  const LineToRender own{line.labels, line.options, database, line.model, {begin, begin + rows.positions_mm.rows()},
                         {},          {},           {}};
  StretchMotion motion{rows.positions_mm,
                       {},
                       {columnsOf(rows.predicted_mm, lips), columnsOf(rows.captured_mm, lips),
                        rows.contactMm(database.corpus().neutral_pose_mm, lips)}};
  const std::vector<MovementShares> told = sharesOf(motion, own);
  shares.insert(shares.end(), told.begin(), told.end());
  MotionPiece made{first, std::move(motion.positions_mm)};
  if (!joined->middles().empty() && line.options.departures.lids_rest) restLids(own, made.positions_mm);
  if (line.options.expression.hasMood()) addMood(line.options.expression.mood, own, made.positions_mm);
  return made;
}

bool LineMotion::canMake(const SynthesisPlan& plan, const SynthesisRequest& request, const UnitDatabase& database) {
  const SynthesisOptions& options = request.options;
  if (plan.segments.empty() || options.curves.alone || !areUsual(options.dials) || !options.edits.dials.empty() ||
      !options.edits.curves.empty() || options.expression.upper_face != UpperFaceSource::kMouth)
    return false;
  for (const Segment& segment : plan.segments) {
    if (!segment.unit || segment.unit->sound.duration() > 0) return false;
  }
  const CurveModel model(database);
  return movesIntoContext(unitsOf(plan), {request.labels, options, database, model, {}, {}, {}, {}});
}

LineMotion::LineMotion(SynthesisPlan plan, SynthesisRequest request, const UnitDatabase& database,
                       const AudioClip& sound, Seconds piece)
    : state_(std::make_unique<State>(std::move(plan), std::move(request), database, sound, piece)) {}
LineMotion::~LineMotion() = default;

MotionTold LineMotion::forEachPiece(const std::function<void(const MotionPiece&)>& take) {
  State& state = *state_;
  state.prepare();
  const LineToRender& line = state.line;
  const std::size_t frames = line.times.size();
  // Shares are told a second.
  const auto second = static_cast<std::size_t>(std::max(1.0, std::round(line.options.frame_rate_hz)));
  const std::size_t at_once = second * static_cast<std::size_t>(std::max(1.0, std::round(state.piece)));
  ContactKeeper contacts(line.labels, state.database, state.units, line.times,
                         line.options.context.settings.value_or(state.database.corpus().motion_settings));
  MotionFacts facts(state.joined->middles(), line, frames);
  MotionTold told;
  UnsettledRows unsettled;
  double heard_squares = 0;
  for (std::size_t first = 0; first < frames; first += at_once) {
    const std::size_t end = std::min(frames, first + at_once);
    unsettled.append(state.rows(first, end));
    std::size_t settled = end;
    if (line.options.context.keep_contacts) settled = contacts.keep(unsettled.first, unsettled.motion.positions_mm);
    if (end < frames) settled = settled / second * second;
    if (line.heard)
      heard_squares += movedBySound(*line.heard, state.database, std::span(line.times).subspan(first, end - first));
    if (settled <= unsettled.first) continue;
    const std::size_t from = unsettled.first;
    const MotionPiece piece = state.finished(from, unsettled.take(settled), told.shares);
    facts.add(piece.positions_mm);
    take(piece);
  }
  told.joins = facts.joins();
  told.mouth = facts.mouth();
  if (line.heard) {
    const double marker_frames = asReal(frames * state.database.lipColumns().size()) / 3;
    told.settings = heardSettings(*line.heard, std::sqrt(heard_squares / marker_frames));
  }
  return told;
}

void LineMotion::release() {
  if (state_->line.heard && state_->sound.samples.empty()) return;  // what was measured of it is not to be had again
  state_->joined.reset();
  state_->transfer.reset();
  state_->line.heard.reset();
}

SynthesisedLine synthesiseForPieces(SynthesisRequest request, const UnitDatabase& database, const AudioClip& sound) {
  request.sound_lasts = std::max(request.sound_lasts, sound.duration());
  const PlannedLine planned = planRequest(request, database);
  SynthesisedLine made;
  const bool is_long = std::max(request.labels.duration(), request.sound_lasts) > LineMotion::kPiece;
  if (!is_long || !LineMotion::canMake(planned.plan, request, database)) {
    if (hearsSound(request.options, database.corpus()) && !request.measures && !sound.samples.empty())
      request.measures = soundMeasures(sound);
    made.animation = renderPlan(planned.plan, request, database);
  } else {
    made.animation = describedLongLine(planned.plan, request, database);
    made.motion = std::make_unique<LineMotion>(planned.plan, std::move(request), database, sound);
  }
  tellPlanning(planned, made.animation);
  return made;
}

}  // namespace mouthpiece
