#include "synthesis/synthesis.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/errors.h"
#include "base/index.h"
#include "motion/position_limits.h"
#include "motion/resample.h"
#include "synthesis/join.h"
#include "synthesis/lips.h"
#include "synthesis/stages.h"
#include "synthesis/tongue.h"
#include "vocal/viseme_curves.h"

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

void expectUsable(const SynthesisRequest& request, const Corpus& corpus) {
  expectFrameRate(request.options.frame_rate_hz, "synthesis", "frame rate");
  if (!(request.options.overlap_ms >= 0 && request.options.overlap_ms <= 1000)) {
    throw InputError(fmt::format("found a blend of {} ms; expected 0 to 1000 ms", request.options.overlap_ms));
  }
  if (request.labels.phones.empty()) throw InputError("found no phone to speak; expected at least silence");
  if (corpus.takes.empty()) throw InputError(fmt::format("the corpus {} has no takes", corpus.name));
}

std::vector<Seconds> frameTimesOf(const SynthesisRequest& request) {
  constexpr double kRounding = 1e-6;  // frames
  const double rate = request.options.frame_rate_hz;
  const Seconds duration = std::max(request.labels.duration(), request.audio.duration());
  return frameTimes(0, static_cast<std::size_t>(std::max(1.0, std::ceil(duration * rate - kRounding))), rate);
}

PlacedUnit placedUnit(const Segment& segment, const LineToRender& line) {
  PlacedUnit placed;
  placed.phones = segment.phones;
  placed.span = line.labels.spanOf(segment.phones);
  placed.is_backoff = segment.kind() != Segment::Kind::kCaptured;
  if (!segment.unit) {
    placed.scale = "curves";
    placed.cost = line.options.selection.weights["stand-in"];
    return placed;
  }
  const SelectedUnit& unit = *segment.unit;
  const CorpusTake& take = line.database.takeOf(unit.source);
  const std::size_t more = segment.phones.last.value - segment.phones.first.value;
  placed.take = take.name;
  placed.source_first = unit.source.phone;
  placed.source_span = take.labels.spanOf({unit.source.phone, advance(unit.source, more).phone});
  placed.scale = scaleOf(take.labels, unit.source.phone, more + 1);
  placed.cost = unit.target_cost + unit.join_cost;
  placed.sound = unit.sound;
  return placed;
}

std::string_view styleName(const std::optional<CurveStyle>& alone) {
  if (!alone) return "";
  return *alone == CurveStyle::kSing ? "sing" : "speech";
}

std::vector<Join> measureJoins(std::vector<Seconds> times, const MotionClip& motion) {
  std::sort(times.begin(), times.end());
  std::vector<Join> joins;
  for (const Seconds time : times) joins.push_back(measureJoin(motion, time));
  return joins;
}

}  // namespace

UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database) {
  expectUsable(request, database.corpus());
  const Stopwatch planning;
  const SynthesisPlan plan = planLine(request.labels, database, request.options, request.units);
  const double planning_ms = planning.elapsedMs();
  UtteranceAnimation made = renderPlan(plan, request, database);
  made.timing_ms.selection = planning_ms;
  return made;
}

UtteranceAnimation renderPlan(const SynthesisPlan& plan, const SynthesisRequest& request,
                              const UnitDatabase& database) {
  const Corpus& corpus = database.corpus();
  const CurveOptions& wish = request.options.curves;
  expectUsable(request, corpus);
  const Stopwatch moving;
  const CurveModel own_model(database);
  LineToRender line{request.labels, request.options,       database, wish.model != nullptr ? *wish.model : own_model,
                    frameTimesOf(request), styleFor(wish, request.labels, request.tags), {}};
  line.curves = vocalCurves(request.labels, request.tags, line.style);

  const std::vector<Stretch> stretches = stretchesOf(plan, line);
  const std::vector<StretchMotion> captured = renderCaptured(stretches, line);
  StretchMotion whole = fillWithCurves(stretches, captured, line);
  if (wish.alone && wish.layered) whole.positions_mm = layerConsonants(whole.positions_mm, line);
  CurveSet edited = withEdits(line.curves, wish.edits);
  whole.positions_mm = withCurveEdits(std::move(whole.positions_mm), edited, line);

  UtteranceAnimation made;
  made.text = request.text;
  made.voice = request.voice;
  made.corpus = corpus.name;
  made.labels = request.labels;
  made.audio = request.audio;
  made.motion = {request.options.frame_rate_hz, corpus.layout.markerNames(), std::move(whole.positions_mm)};
  made.tongue = tongueFromPhones(request.labels, line.times);
  made.lips = lipsFromPhones(request.labels, line.times);
  for (const Segment& segment : plan.segments) made.units.push_back(placedUnit(segment, line));
  made.joins = measureJoins(std::move(whole.joins), made.motion);
  made.curves = std::move(edited);
  made.style = styleName(wish.alone);
  made.timing_ms.motion = moving.elapsedMs();
  return made;
}

UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus) {
  return synthesise(request, UnitDatabase(corpus));
}

}  // namespace mouthpiece
