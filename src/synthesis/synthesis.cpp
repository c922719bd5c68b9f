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
#include "synthesis/motion_facts.h"
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
  if (takeCount(corpus) == 0) throw InputError(fmt::format("the corpus {} has no takes", corpus.name));
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
  placed.take_index = unit.source.take;
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

/// What the method is, by what moves the face.
std::string methodOf(const SynthesisOptions& options, const Corpus& corpus) {
  const Departures& departures = options.departures;
  if (options.curves.alone) return options.curves.layered ? "curves, consonants captured" : "curves";
  if (options.selection.method == SelectionMethod::kGreedy) {
    const bool is_published = options.selection.units == UnitScales::kPaper && !departures.silences_keep_their_pace &&
                              !departures.joins_where_lips_agree && !departures.offsets_led_away;
    return is_published ? "edge" : "greedy";
  }
  return options.context.enabled && corpus.trajectory_model != nullptr ? "guided" : "cheapest fragments";
}

std::vector<SettingUsed> settingsOf(const SynthesisOptions& options, const Corpus& corpus, std::string_view method) {
  std::vector<SettingUsed> used;
  const auto add = [&](std::string_view name, std::string value) {
    used.push_back({std::string(name), std::move(value)});
  };
  const auto addNumber = [&](std::string_view name, double value) { add(name, fmt::format("{:.4g}", value)); };
  if (method == "curves") return used;
  add("units", options.selection.units == UnitScales::kPaper ? "paper" : "any");
  add("blend", std::string(blendKindName(options.blend)));
  addNumber("overlap ms", options.overlap_ms);
  const bool by_pairs = method == "guided" && options.selection.units == UnitScales::kAny;
  const LatticeWeights lattice = options.selection.lattice.value_or(corpus.lattice_weights);
  const CostWeights& weights = by_pairs ? static_cast<const CostWeights&>(lattice) : options.selection.weights;
  for (std::size_t i = 0; i < weights.terms().size(); ++i)
    addNumber(fmt::format("cost of {}", weights.terms()[i].name), weights.values()[i]);
  if (method != "guided") return used;
  const MotionSettings motion = options.context.settings.value_or(corpus.motion_settings);
  for (const MotionSetting& setting : kMotionSettings) {
    addNumber(fmt::format("{}{}{}", setting.name, setting.unit.empty() ? "" : " ", setting.unit),
              motion.*setting.value);
  }
  addNumber("gain of the prediction", options.context.restore_variance ? corpus.trajectory_model->gain : 1);
  addNumber("networks in the prediction", asReal(corpus.trajectory_model->networks.size()));
  return used;
}

void addDials(const SpeechDials& dials, std::vector<SettingUsed>& settings) {
  for (const DialRow& dial : kSpeechDials) {
    if (isUsual(dial, dials)) continue;
    const StyleSignal& signal = dials.*dial.signal;
    settings.push_back({fmt::format("{}{}{}", dial.name, dial.unit.empty() ? "" : " ", dial.unit),
                        signal.isConstant() ? fmt::format("{:.4g}", signal.at(0)) : "over time"});
  }
}

/// Lids, brows and forehead, eyes and head as `options` have them; what was drawn at random is told in `made`.
void addExpression(const ExpressionOptions& options, const LineToRender& line, bool is_joined, std::string_view text,
                   UtteranceAnimation& made) {
  LineExpression expression = expressionOf(line.labels, isQuestion(text), line.times, line.database, options);
  made.gaze = std::move(expression.gaze);
  made.head = std::move(expression.head);
  made.warnings.insert(made.warnings.end(), expression.warnings.begin(), expression.warnings.end());
  if (expression.upper_face.empty()) {
    if (is_joined && line.options.departures.lids_rest) restLids(line, made.motion.positions_mm);
    return;
  }
  const std::vector<bool> upper = upperFaceColumns(line.database.corpus().layout);
  for (std::size_t i = 0; i < upper.size(); ++i) {
    if (upper[i]) made.motion.positions_mm.col(signedIndex(i)) = expression.upper_mm.col(signedIndex(i));
  }
  made.settings.push_back({"upper face", expression.upper_face});
  if (expression.stretches > 0) made.settings.push_back({"its stretches", std::to_string(expression.stretches)});
  if (expression.upper_face == "rules") made.settings.push_back({"blinks", std::to_string(expression.blinks.size())});
}

}  // namespace

std::vector<Seconds> frameTimesOf(const SynthesisRequest& request) {
  constexpr double kRounding = 1e-6;  // frames
  const double rate = request.options.frame_rate_hz;
  const Seconds duration = std::max({request.labels.duration(), request.audio.duration(), request.sound_lasts});
  return frameTimes(0, static_cast<std::size_t>(std::max(1.0, std::ceil(duration * rate - kRounding))), rate);
}

std::optional<HeardLine> heardIn(const SynthesisRequest& request, const Corpus& corpus) {
  if (!hearsSound(request.options, corpus)) return std::nullopt;
  const SoundModel& sound = corpus.trajectory_model->sound;
  if (request.measures) return HeardLine(sound, *request.measures, request.labels);
  if (request.audio.samples.empty()) return std::nullopt;
  return HeardLine(sound, request.audio, request.labels);
}

std::vector<SettingUsed> heardSettings(const HeardLine& heard, double lips_moved_mm) {
  return {{"sound believed", fmt::format("{:.3g}", heard.believed())},
          {"sound's departure, of the corpus' widest", fmt::format("{:.3g}", heard.strangeness())},
          {"lips moved by the sound mm", fmt::format("{:.3g}", lips_moved_mm)}};
}

double movedBySound(const HeardLine& heard, const UnitDatabase& database, std::span<const Seconds> times) {
  const Eigen::MatrixXd moved = heard.at(times) * database.corpus().trajectory_model->shapes;
  double squares = 0;
  for (const Eigen::Index column : database.lipColumns()) squares += moved.col(column).squaredNorm();
  return squares;
}

void restLids(const LineToRender& line, PositionMatrix& positions) {
  const Corpus& corpus = line.database.corpus();
  for (std::size_t marker = 0; marker < corpus.layout.markers.size(); ++marker) {
    if (corpus.layout.markers[marker].region != "lid") continue;
    for (std::size_t i = 3 * marker; i < 3 * marker + 3; ++i)
      positions.col(signedIndex(i)).setConstant(corpus.neutral_pose_mm.data()[i]);
  }
}

UtteranceAnimation describedLine(const SynthesisPlan& plan, const SynthesisRequest& request, const LineToRender& line) {
  const Corpus& corpus = line.database.corpus();
  UtteranceAnimation made;
  made.method = methodOf(request.options, corpus);
  made.settings = settingsOf(request.options, corpus, made.method);
  made.text = request.text;
  made.voice = request.voice;
  made.corpus = corpus.name;
  made.labels = request.labels;
  made.audio = request.audio;
  made.motion = {request.options.frame_rate_hz, corpus.layout.markerNames(), PositionMatrix(std::ssize(line.times), 0)};
  made.tongue = tongueFromPhones(request.labels, line.times);
  made.lips = lipsFromPhones(request.labels, line.times);
  for (const Segment& segment : plan.segments) made.units.push_back(placedUnit(segment, line));
  made.curves = line.curves;
  made.style = styleName(request.options.curves.alone);
  return made;
}

bool hearsSound(const SynthesisOptions& options, const Corpus& corpus) {
  return options.context.hear && corpus.trajectory_model != nullptr && !corpus.trajectory_model->sound.isEmpty();
}

SynthesisOptions edgeAsPublished() {
  SynthesisOptions options;
  options.selection.method = SelectionMethod::kGreedy;
  options.selection.units = UnitScales::kPaper;
  for (const char* unpublished : {"word position", "stress", "closure", "join position", "join velocity"})
    options.selection.weights[unpublished] = 0;
  options.context.enabled = false;
  options.departures = {false, false, false, false};
  return options;
}

namespace {

/// All of a line but what is heard; `own_model` where the request has none.
LineToRender lineOf(const SynthesisRequest& request, const UnitDatabase& database, const CurveModel& own_model) {
  const CurveOptions& wish = request.options.curves;
  LineToRender line{request.labels,
                    request.options,
                    database,
                    wish.model != nullptr ? *wish.model : own_model,
                    frameTimesOf(request),
                    withDials(styleFor(wish, request.labels, request.tags), request.options.edits.dials),
                    {},
                    {}};
  line.curves = vocalCurves(request.labels, request.tags, line.style);
  return line;
}

}  // namespace

UtteranceAnimation describedLongLine(const SynthesisPlan& plan, const SynthesisRequest& request,
                                     const UnitDatabase& database) {
  const CurveModel own_model(database);
  const LineToRender line = lineOf(request, database, own_model);
  UtteranceAnimation made = describedLine(plan, request, line);
  addExpression(request.options.expression, line, false, request.text, made);
  return made;
}

PlannedLine planRequest(const SynthesisRequest& request, const UnitDatabase& database) {
  expectUsable(request, database.corpus());
  const Stopwatch planning;
  PlannedLine planned;
  planned.plan = withUnits(planLine(request.labels, database, request.options, request.units), request.labels, database,
                           request.options.edits.units, planned.warnings);
  planned.took_ms = planning.elapsedMs();
  return planned;
}

void tellPlanning(const PlannedLine& planned, UtteranceAnimation& made) {
  made.warnings.insert(made.warnings.begin(), planned.warnings.begin(), planned.warnings.end());
  made.timing_ms.selection = planned.took_ms;
}

UtteranceAnimation synthesise(const SynthesisRequest& request, const UnitDatabase& database) {
  const PlannedLine planned = planRequest(request, database);
  UtteranceAnimation made = renderPlan(planned.plan, request, database);
  tellPlanning(planned, made);
  return made;
}

UtteranceAnimation renderPlan(const SynthesisPlan& plan, const SynthesisRequest& request,
                              const UnitDatabase& database) {
  const Corpus& corpus = database.corpus();
  const CurveOptions& wish = request.options.curves;
  const LineEdits& edits = request.options.edits;
  expectUsable(request, corpus);
  const Stopwatch moving;
  const CurveModel own_model(database);
  LineToRender line = lineOf(request, database, own_model);
  line.heard = heardIn(request, corpus);

  const std::vector<Stretch> stretches = stretchesOf(plan, line);
  StretchMotion whole = fillWithCurves(stretches, renderCaptured(stretches, line), line);
  if (wish.alone && wish.layered) whole = layerConsonants(std::move(whole), line);
  std::vector<std::string> warnings;
  const Seconds duration = line.times.back() + 1 / request.options.frame_rate_hz;
  const SpeechDials dials = withDials(request.options.dials, edits.dials, duration, warnings);
  std::size_t held = turnDials(dials, line, whole.positions_mm);
  CurveSet edited = withEdits(line.curves, usableEdits(edits.curves, duration, warnings));
  edited = withinLimits(std::move(edited), line.curves, warnings);
  if (edited != line.curves) {
    const PositionMatrix before = whole.positions_mm;
    whole.positions_mm = withCurveEdits(std::move(whole.positions_mm), edited, line);
    held += keepWithinReach(before, line, whole.positions_mm);
  }
  if (held > 0)
    warnings.push_back(fmt::format("the dials or edits ask for more than a face can do in {} of {} frames: held there",
                                   std::min(held, line.times.size()), line.times.size()));

  UtteranceAnimation made = describedLine(plan, request, line);
  made.shares = sharesOf(whole, line);
  if (made.method == "guided" && line.heard) {
    const double squares = movedBySound(*line.heard, database, line.times);
    const double marker_frames = asReal(line.times.size() * database.lipColumns().size()) / 3;
    for (SettingUsed& heard : heardSettings(*line.heard, std::sqrt(squares / marker_frames)))
      made.settings.push_back(std::move(heard));
  }
  made.motion.positions_mm = std::move(whole.positions_mm);
  addExpression(request.options.expression, line, !whole.joins.empty(), request.text, made);
  if (request.options.expression.hasMood()) addMood(request.options.expression.mood, line, made.motion.positions_mm);
  MotionFacts facts(std::move(whole.joins), line, line.times.size());
  facts.add(made.motion.positions_mm);
  made.joins = facts.joins();
  made.mouth = facts.mouth();
  made.curves = std::move(edited);
  made.warnings.insert(made.warnings.begin(), warnings.begin(), warnings.end());
  addDials(dials, made.settings);
  made.timing_ms.motion = moving.elapsedMs();
  return made;
}

UtteranceAnimation synthesise(const SynthesisRequest& request, const Corpus& corpus) {
  return synthesise(request, UnitDatabase(corpus));
}

}  // namespace mouthpiece
