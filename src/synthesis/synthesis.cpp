#include "synthesis/synthesis.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "base/errors.h"
#include "motion/position_limits.h"
#include "motion/resample.h"
#include "synthesis/blender.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "synthesis/join_offset.h"
#include "synthesis/tongue.h"

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

/// Joins lie in the order of the line, so that each blend begins where the one before has begun.
std::vector<JoinSpans> placeJoins(const SynthesisRequest& request, const std::vector<UnitFragment>& fragments) {
  std::vector<JoinSpans> joins;
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    JoinSpans join = placeJoin(request.labels, fragments[i].fragment, fragments[i + 1].fragment,
                               request.options.overlap_ms / 1000, request.options.frame_rate_hz);
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
  return placed;
}

MotionClip restingMotion(const Corpus& corpus, std::size_t frames, double frame_rate_hz) {
  const Eigen::Map<const Eigen::RowVectorXd> rest(corpus.neutral_pose_mm.data(), corpus.neutral_pose_mm.size());
  return {frame_rate_hz, corpus.layout.markerNames(), rest.replicate(static_cast<Eigen::Index>(frames), 1)};
}

/// A take's own sentence in its own time: nothing makes it better than it was captured.
bool isTakeAsItWas(const SpeechLabels& line, const UnitDatabase& database, const std::vector<SelectedUnit>& units) {
  constexpr Seconds kSame = 0.005;
  if (units.size() != 1) return false;
  const std::vector<LabelledPhone>& take = database.takeOf(units[0].source).labels.phones;
  if (take.size() != line.phones.size()) return false;
  for (std::size_t i = 0; i + 1 < take.size(); ++i) {
    if (std::abs(take[i].span.end - line.phones[i].span.end) > kSame) return false;
  }
  return true;
}

bool movesIntoContext(const SynthesisRequest& request, const UnitDatabase& database,
                      const std::vector<SelectedUnit>& units) {
  return request.options.context.enabled && request.options.selection.method == SelectionMethod::kViterbi &&
         database.corpus().trajectory_model != nullptr && !isTakeAsItWas(request.labels, database, units);
}

void animateUnits(const SynthesisRequest& request, const UnitDatabase& database, const std::vector<SelectedUnit>& units,
                  std::span<const Seconds> times, UtteranceAnimation& animation) {
  const bool into_context = movesIntoContext(request, database, units);
  const std::vector<UnitFragment> fragments = cutIntoFragments(request.labels, database, units, into_context);
  const std::vector<JoinSpans> joins = placeJoins(request, fragments);
  MotionClip& motion = animation.motion;
  std::vector<JoinOffset> offsets;  // a bare cut, when no blend is wanted
  if (request.options.overlap_ms > 0) offsets = findJoinOffsets(request.labels, fragments, joins);
  motion.positions_mm =
      blendFragments(fragments, joins, offsets, times, request.options.blend, database.corpus().layout);
  if (into_context) {
    const ContextOptions& context = request.options.context;
    motion.positions_mm = transferContext(motion.positions_mm, request.labels, database, times, context);
    if (context.keep_closures) keepClosures(request.labels, database, units, times, motion.positions_mm);
  }
  fillUnseen(motion.positions_mm, database.corpus().neutral_pose_mm);
  for (std::size_t i = 0; i < joins.size(); ++i) {
    // Between two fragments of one unit lies a pause of the take itself.
    if (fragments[i].unit != fragments[i + 1].unit)
      animation.joins.push_back(measureJoin(motion, joins[i].lips.middle()));
  }
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

  const Stopwatch selecting;
  const std::vector<SelectedUnit> units =
      request.units.empty() ? selectUnits(request.labels, database, request.options.selection) : request.units;
  for (const SelectedUnit& unit : units) animation.units.push_back(describe(unit, request.labels, database));
  animation.timing_ms.selection = selecting.elapsedMs();

  const Stopwatch moving;
  const double rate = request.options.frame_rate_hz;
  constexpr double kRounding = 1e-6;  // frames
  const Seconds duration = std::max(request.labels.duration(), request.audio.duration());
  const auto frames = static_cast<std::size_t>(std::max(1.0, std::ceil(duration * rate - kRounding)));
  const std::vector<Seconds> times = frameTimes(0, frames, rate);
  animation.motion = restingMotion(corpus, frames, rate);
  if (!units.empty()) animateUnits(request, database, units, times, animation);
  animation.tongue = tongueFromPhones(request.labels, times);
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
