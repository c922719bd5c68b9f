#include "synthesis/synthesis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "motion/position_limits.h"
#include "motion/resample.h"
#include "synthesis/blender.h"
#include "synthesis/curve_backoff.h"
#include "synthesis/curve_model.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "synthesis/join_offset.h"
#include "synthesis/lips.h"
#include "synthesis/tongue.h"
#include "vocal/viseme_curves.h"
#include "vocal/viseme_poses.h"

namespace mouthpiece {
namespace {

/// Milliseconds since it was made.
class Stopwatch {
 public:
  [[nodiscard]] double elapsedMs() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What is still NaN at a fragment's edge takes the nearest frame's value, and the neutral pose where there is none.
void fillUnseen(PositionMatrix& positions, const MarkerPositions& neutral) {
  if (positions.allFinite()) return;
  for (Eigen::Index column = 0; column < positions.cols(); ++column) {
    double last = neutral.data()[column];
    for (Eigen::Index row = 0; row < positions.rows(); ++row) {
      if (!std::isnan(positions(row, column))) {
        last = positions(row, column);
        break;
      }
    }
    for (Eigen::Index row = 0; row < positions.rows(); ++row) {
      if (std::isnan(positions(row, column))) positions(row, column) = last;
      last = positions(row, column);
    }
  }
}

TimeSpan notBefore(const TimeSpan& span, const TimeSpan& earlier) {
  return {std::max(span.start, earlier.start), std::max(span.end, earlier.end)};
}

/// Where the sound goes over from one unit to the next; none where another voice speaks.
std::optional<Seconds> soundCut(const SelectedUnit& before, const SelectedUnit& after) {
  constexpr Seconds kRounding = 1e-6;
  const bool both_sound = before.sound.duration() > 0 && after.sound.duration() > 0;
  if (!both_sound || std::abs(before.sound.end - after.sound.start) > kRounding) return std::nullopt;
  return before.sound.end;
}

/// Joins lie in the order of the line, so that each blend begins where the one before has begun.
std::vector<JoinSpans> placeJoins(const SynthesisRequest& request, const std::vector<UnitFragment>& fragments,
                                  const std::vector<SelectedUnit>& units, bool search_coupling) {
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    JoinSpans join = placeJoin(request.labels, fragments[i].fragment, fragments[i + 1].fragment,
                               request.options.overlap_ms / 1000, request.options.frame_rate_hz, search_coupling,
                               soundCut(units[fragments[i].unit], units[fragments[i + 1].unit]));
    if (!joins.empty()) {
      join.lips = notBefore(join.lips, joins.back().lips);
      join.upper_face = notBefore(join.upper_face, joins.back().upper_face);
    }
    joins.push_back(join);
  }
  return joins;
}

PlacedUnit describe(const SelectedUnit& unit, const SpeechLabels& line, const UnitDatabase& database) {
  const CorpusTake& take = database.takeOf(unit.source);
  const std::size_t count = unit.phones.last.value - unit.phones.first.value + 1;
  PlacedUnit placed;
  placed.phones = unit.phones;
  placed.take = take.name;
  placed.source_first = unit.source.phone;
  placed.source_span = take.labels.spanOf({unit.source.phone, PhoneIndex(unit.source.phone.value + count - 1)});
  placed.span = line.spanOf(unit.phones);
  placed.scale = scaleOf(take.labels, unit.source.phone, count);
  placed.cost = unit.target_cost + unit.join_cost;
  placed.is_backoff = unit.is_backoff;
  placed.sound = unit.sound;
  return placed;
}

MotionClip restingMotion(const Corpus& corpus, std::size_t frames, double frame_rate_hz) {
  const Eigen::Map<const Eigen::RowVectorXd> rest(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  return {frame_rate_hz, corpus.layout.markerNames(), rest.replicate(static_cast<Eigen::Index>(frames), 1)};
}

/// A take's own sentence in its own time: nothing makes it better than it was captured.
bool isTakeAsItWas(const SpeechLabels& line, const UnitDatabase& database, const std::vector<SelectedUnit>& units) {
  return units.size() == 1 && isSaidAlike(line, database.takeOf(units[0].source).labels);
}

bool movesIntoContext(const SynthesisRequest& request, const UnitDatabase& database,
                      const std::vector<SelectedUnit>& units) {
  return request.options.context.enabled && request.options.selection.method == SelectionMethod::kViterbi &&
         database.corpus().trajectory_model != nullptr && !isTakeAsItWas(request.labels, database, units);
}

/// Units' motion, and the middles of their joins.
PositionMatrix renderUnits(const SynthesisRequest& request, const UnitDatabase& database,
                           const std::vector<SelectedUnit>& units, const std::vector<Seconds>& times,
                           std::vector<Seconds>& join_times) {
  const bool into_context = movesIntoContext(request, database, units);
  const std::vector<UnitFragment> fragments = cutIntoFragments(request.labels, database, units, into_context);
  const std::vector<JoinSpans> joins =
      placeJoins(request, fragments, units, into_context && request.options.search_coupling);
  std::vector<JoinOffset> offsets;  // a bare cut, when no blend is wanted
  if (request.options.overlap_ms > 0) offsets = findJoinOffsets(request.labels, fragments, joins);
  PositionMatrix positions =
      blendFragments(fragments, joins, offsets, times, request.options.blend, database.corpus().layout);
  if (into_context) {
    const ContextOptions& context = request.options.context;
    positions = transferContext(positions, request.labels, database, times, context);
    if (context.keep_contacts) keepContacts(request.labels, database, units, times, positions);
  }
  fillUnseen(positions, database.corpus().neutral_pose_mm);
  for (std::size_t i = 0; i < joins.size(); ++i) {
    // Between two fragments of one unit lies a pause of the take itself.
    if (fragments[i].unit != fragments[i + 1].unit) join_times.push_back(joins[i].lips.middle());
  }
  return positions;
}

PlacedUnit describeCurves(const PhoneRange& gap, const SynthesisRequest& request) {
  PlacedUnit placed;
  placed.phones = gap;
  placed.span = request.labels.spanOf(gap);
  placed.scale = "curves";
  placed.cost = request.options.selection.weights["stand-in"];
  placed.is_backoff = true;
  return placed;
}

/// All that the line is made of, in time order.
std::vector<PlacedUnit> describeAll(const std::vector<CapturedRun>& runs, const SynthesisRequest& request,
                                    const UnitDatabase& database) {
  std::vector<PlacedUnit> placed;
  for (const CapturedRun& run : runs) {
    for (const SelectedUnit& unit : run.units) placed.push_back(describe(unit, request.labels, database));
  }
  for (const PhoneRange& gap : gapsBetween(runs, request.labels.phones.size()))
    placed.push_back(describeCurves(gap, request));
  std::stable_sort(placed.begin(), placed.end(), [](const PlacedUnit& a, const PlacedUnit& b) {
    return a.phones.first.value < b.phones.first.value;
  });
  return placed;
}

/// Where the corpus knows how its speaker moves, a stand-in brings detail only: the lips go where they are predicted
/// to.
bool predictsGaps(const SynthesisRequest& request, const UnitDatabase& database) {
  const SelectionOptions& selection = request.options.selection;
  return request.options.context.enabled && selection.method == SelectionMethod::kViterbi &&
         selection.units == UnitScales::kAny && database.corpus().trajectory_model != nullptr &&
         request.labels.phones.size() > 1;
}

/// The captured part of the line; with curves alone, none.
std::vector<CapturedRun> chooseRuns(const SynthesisRequest& request, const UnitDatabase& database,
                                    const CurveModel& model) {
  const CurveOptions& curves = request.options.curves;
  if (curves.alone && !curves.layered) return {};
  const bool fill_gaps = (curves.fill_gaps || curves.layered) && model.isPossible();
  if (fill_gaps && request.units.empty() && predictsGaps(request, database)) {
    try {
      return {CapturedRun{selectUnits(request.labels, database, request.options.selection)}};
    } catch (const MissingPairError&) {  // nothing looks alike: the curves fill in
    }
  }
  if (fill_gaps && request.units.empty()) return selectAroundGaps(request.labels, database, request.options.selection);
  if (fill_gaps) return runsOf(request.units);
  std::vector<SelectedUnit> units =
      request.units.empty() ? selectUnits(request.labels, database, request.options.selection) : request.units;
  if (units.empty()) return {};
  return {CapturedRun{std::move(units)}};
}

/// How much of a consonant's captured motion shows at each time: (1 - Ma) over the phone, coming and going in 60 ms.
std::vector<double> consonantWeights(const SpeechLabels& labels, const StyleSignal& ma,
                                     const std::vector<Seconds>& times) {
  constexpr Seconds kFade = 0.060;
  std::vector<double> weights(times.size(), 0.0);
  for (const LabelledPhone& phone : labels.phones) {
    if (phone.phone == Phone::kSil || isVowel(phone.phone)) continue;
    const auto first = std::lower_bound(times.begin(), times.end(), phone.span.start - kFade) - times.begin();
    for (auto k = static_cast<std::size_t>(first); k < times.size() && times[k] < phone.span.end + kFade; ++k) {
      const Seconds outside = std::max({0.0, phone.span.start - times[k], times[k] - phone.span.end});
      const double shown = (1 - ma.at(times[k])) * blendWeight(BlendKind::kSmooth, outside / kFade);
      weights[k] = std::max(weights[k], shown);
    }
  }
  return weights;
}

/// Draws the curves and makes the motion of runs, curves and edits.
void animate(const SynthesisRequest& request, const UnitDatabase& database, const CurveModel& model,
             const std::vector<CapturedRun>& runs, const std::vector<Seconds>& times, UtteranceAnimation& animation) {
  const SynthesisOptions& options = request.options;
  const MarkerPositions& neutral = database.corpus().neutral_pose_mm;
  const VocalStyle style = styleFor(options.curves, request.labels, request.tags);
  const CurveSet curves = vocalCurves(request.labels, request.tags, style);
  std::vector<Seconds> join_times;
  const RenderUnits render = [&](const std::vector<SelectedUnit>& units, const std::vector<Seconds>& own_times) {
    return renderUnits(request, database, units, own_times, join_times);
  };
  PositionMatrix& positions = animation.motion.positions_mm;
  const bool has_gaps = !gapsBetween(runs, request.labels.phones.size()).empty();
  const auto compose = [&](const std::vector<CapturedRun>& captured) {
    return composeRuns(request.labels, captured, render, curves, style, model.poses(), neutral, times,
                       options.overlap_ms / 1000, options.blend);
  };
  const bool curves_move = options.curves.alone || (has_gaps && options.curves.fill_gaps);
  if (curves_move) {
    ComposedMotion composed = compose(runs);
    positions = std::move(composed.positions_mm);
    join_times.insert(join_times.end(), composed.joins.begin(), composed.joins.end());
  } else if (!runs.empty()) {
    positions = render(runs.front().units, times);
  }
  if (options.curves.alone && !runs.empty()) {
    // Consonants of the capture over vowels of the curves (VOCAL 3.3).
    const PositionMatrix vowels = compose({}).positions_mm;
    const std::vector<double> weights = consonantWeights(request.labels, style.ma, times);
    const Eigen::Map<const Eigen::VectorXd> captured(weights.data(), positions.rows());
    positions = vowels + captured.asDiagonal() * (positions - vowels);
  }
  animation.curves = withEdits(curves, options.curves.edits);
  if (animation.curves != curves && model.isPossible()) {
    // What an animator changed is added to whatever moves the face.
    positions += displacementsFromCurves(animation.curves, model.poses(), style.ja, style.li, times) -
                 displacementsFromCurves(curves, model.poses(), style.ja, style.li, times);
  }
  std::sort(join_times.begin(), join_times.end());
  for (const Seconds time : join_times) animation.joins.push_back(measureJoin(animation.motion, time));
}

void expectUsable(const SynthesisRequest& request, const Corpus& corpus) {
  expectFrameRate(request.options.frame_rate_hz, "synthesis", "frame rate");
  if (!(request.options.overlap_ms >= 0 && request.options.overlap_ms <= 1000)) {
    throw InputError(fmt::format("found a blend of {} ms; expected 0 to 1000 ms", request.options.overlap_ms));
  }
  if (request.labels.phones.empty()) throw InputError("found no phone to speak; expected at least silence");
  if (corpus.takes.empty()) throw InputError(fmt::format("the corpus {} has no takes", corpus.name));
}

}  // namespace

UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database) {
  const Corpus& corpus = database.corpus();
  expectUsable(request, corpus);
  UtteranceAnimation animation;
  animation.text = request.text;
  animation.voice = request.voice;
  animation.corpus = corpus.name;
  animation.labels = request.labels;
  animation.audio = request.audio;

  std::optional<CurveModel> own_model;
  if (request.options.curves.model == nullptr) own_model.emplace(database);
  const CurveModel& model = own_model ? *own_model : *request.options.curves.model;

  const Stopwatch selecting;
  const std::vector<CapturedRun> runs = chooseRuns(request, database, model);
  const std::optional<CurveStyle> alone = request.options.curves.alone;
  if (alone) animation.style = *alone == CurveStyle::kSing ? "sing" : "speech";
  if (alone || !runs.empty() || request.options.curves.fill_gaps)
    animation.units = describeAll(runs, request, database);
  animation.timing_ms.selection = selecting.elapsedMs();

  const Stopwatch moving;
  const double rate = request.options.frame_rate_hz;
  constexpr double kRounding = 1e-6;  // frames
  const Seconds duration = std::max(request.labels.duration(), request.audio.duration());
  const auto frames = static_cast<std::size_t>(std::max(1.0, std::ceil(duration * rate - kRounding)));
  const std::vector<Seconds> times = frameTimes(0, frames, rate);
  animation.motion = restingMotion(corpus, frames, rate);
  animate(request, database, model, runs, times, animation);
  animation.tongue = tongueFromPhones(request.labels, times);
  animation.lips = lipsFromPhones(request.labels, times);
  animation.timing_ms.motion = moving.elapsedMs();
  return animation;
}

UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus) {
  const Stopwatch indexing;
  const UnitDatabase database(corpus);
  const double index_ms = indexing.elapsedMs();
  UtteranceAnimation animation = synthesise(request, database);
  animation.timing_ms.selection += index_ms;
  return animation;
}

}  // namespace mouthpiece
