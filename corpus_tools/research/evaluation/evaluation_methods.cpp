#include "corpus_tools/research/evaluation/evaluation_methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <set>

#include "base/errors.h"
#include "motion/resample.h"
#include "synthesis/curve_model.h"
#include "synthesis/fragment.h"
#include "synthesis/join.h"
#include "units/costs/cost_terms.h"

namespace mouthpiece {
namespace {

MotionClip meanPose(const Corpus& corpus, double frame_rate_hz, std::size_t frames) {
  const auto width = signedIndex(3 * corpus.layout.markers.size());
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(width), counts = Eigen::RowVectorXd::Zero(width);
  for (const CorpusTake& take : corpus.takes) {
    const auto seen = take.motion.positions_mm.array().isFinite();
    sum += seen.select(take.motion.positions_mm.array(), 0.0).matrix().colwise().sum();
    counts += seen.cast<double>().matrix().colwise().sum();
  }
  MotionClip clip{frame_rate_hz, corpus.layout.markerNames(), {}};
  clip.positions_mm = (sum.array() / counts.array()).matrix().replicate(signedIndex(frames), 1);
  return clip;
}

/// The 95th percentiles of the corpus' own frame changes, by frame rate, each found once.
class UsualChanges {
 public:
  explicit UsualChanges(const Corpus& corpus) : corpus_(corpus) {}
  FrameChange at(double frame_rate_hz) {
    const std::scoped_lock lock(mutex_);
    const auto known = changes_.find(frame_rate_hz);
    if (known != changes_.end()) return known->second;
    return changes_[frame_rate_hz] = frameChangePercentile(corpus_, frame_rate_hz);
  }

 private:
  const Corpus& corpus_;
  std::mutex mutex_;
  std::map<double, FrameChange> changes_;
};

void countUnits(const UtteranceAnimation& made, UsualChanges& usual, EvaluationRow& row) {
  row.phones += made.labels.phones.size();
  row.pairs += made.labels.phones.size() - 1;
  row.units += made.units.size();
  for (const PlacedUnit& unit : made.units) {
    if (unit.is_backoff) row.backoff_pairs += unit.phones.last.value - unit.phones.first.value;
  }
  for (const Join& join : made.joins) {
    const FrameChange limit = usual.at(made.motion.frame_rate_hz);
    row.join_times.push_back(join.time);
    row.join_jumps_mm.push_back(join.position_jump_mm);
    row.join_limits_mm.push_back(limit.step_mm);
    row.velocity_jumps_mm_s.push_back(join.velocity_jump_mm_s);
    row.velocity_limits_mm_s.push_back(limit.velocity_change_mm_s);
  }
}

/// Largest difference, over lip and chin markers, between the velocities that two fragments bring to a join, mm/s.
double velocityMismatch(const Fragment& before, const Fragment& after, Seconds time) {
  constexpr Seconds kReach = 0.020;
  const auto velocity = [&](const Fragment& fragment) -> Eigen::RowVectorXd {
    return (fragment.lipsAt(time + kReach) - fragment.lipsAt(time - kReach)) / (2 * kReach);
  };
  const Eigen::RowVectorXd difference = velocity(after) - velocity(before);
  return Eigen::Map<const MarkerPositions>(difference.data(), difference.size() / 3, 3).rowwise().norm().maxCoeff();
}

/// Of the fragments as they were captured, in every row: what a method takes off them first is its own affair.
void compareFragments(const SynthesisRequest& request, const UtteranceAnimation& made, const UnitDatabase& database,
                      EvaluationRow& row) {
  const bool stretch_silences = !request.options.departures.silences_keep_their_pace;
  const std::vector<UnitFragment> fragments =
      cutIntoFragments(request.labels, database, request.units, false, stretch_silences);
  std::size_t join = 0;
  for (std::size_t i = 0; i + 1 < fragments.size() && join < made.joins.size(); ++i) {
    if (fragments[i].unit == fragments[i + 1].unit) continue;
    const double mismatch = velocityMismatch(fragments[i].fragment, fragments[i + 1].fragment, made.joins[join++].time);
    if (std::isfinite(mismatch)) row.velocity_mismatches_mm_s.push_back(mismatch);
  }
}

/// All markers are seen in the frames that measureJoin() looks at.
bool isSeenAround(const MotionClip& motion, Seconds time) {
  const auto frame = static_cast<Eigen::Index>(time * motion.frame_rate_hz);
  const Eigen::Index first = std::clamp<Eigen::Index>(frame - 1, 0, motion.positions_mm.rows() - 1);
  const Eigen::Index last = std::clamp<Eigen::Index>(frame + 2, first, motion.positions_mm.rows() - 1);
  return motion.positions_mm.middleRows(first, last - first + 1).allFinite();
}

/// The take's own change of velocity where the line has joins; and how far the line goes beyond it at a rate that shows
/// it: over the 40 ms of a slow capture's frames speech turns as sharply as any join.
void compareWithCapture(const CorpusTake& take, SynthesisRequest request, const UtteranceAnimation& made,
                        const UnitDatabase& database, EvaluationRow& row) {
  constexpr double kShownHz = 60;
  for (const Join& join : made.joins) {
    if (!isSeenAround(take.motion, join.time)) continue;
    row.captured_velocity_jumps_mm_s.push_back(measureJoin(take.motion, join.time).velocity_jump_mm_s);
  }
  request.options.frame_rate_hz = std::max(kShownHz, take.motion.frame_rate_hz);
  const MotionClip captured = resampleClip(take.motion, request.options.frame_rate_hz);
  for (const Join& join : synthesise(request, database).joins) {
    if (!isSeenAround(captured, join.time)) continue;
    row.added_velocity_jumps_mm_s.push_back(join.velocity_jump_mm_s -
                                            measureJoin(captured, join.time).velocity_jump_mm_s);
  }
}

SynthesisOptions selectingBy(SelectionMethod method, UnitScales units) {
  SynthesisOptions options;
  options.selection.method = method;
  options.selection.units = units;
  return options;
}

}  // namespace

EvaluationMethod unitMethod(std::string name, const UnitDatabase& database, const SynthesisOptions& options) {
  const auto usual = std::make_shared<UsualChanges>(database.corpus());
  const auto curves = std::make_shared<CurveModel>(database);
  return {std::move(name), [&database, options, usual, curves](const CorpusTake& take, EvaluationRow& row) {
            SynthesisRequest request{take.text, "capture", take.labels, {}, options};
            if (options.context.hear) request.audio = take.audio;
            request.options.frame_rate_hz = take.motion.frame_rate_hz;
            request.options.departures.lids_rest = false;  // jumps at joins are the whole face's, as in the take
            try {
              request.units = selectUnits(request.labels, database, options.selection);
            } catch (const InputError&) {  // not even a stand-in: the curves fill in, as in `synth`
              request.options.curves.fill_gaps = true;
              request.options.curves.model = curves.get();
            }
            UtteranceAnimation made = synthesise(request, database);
            countUnits(made, *usual, row);
            compareFragments(request, made, database, row);
            compareWithCapture(take, request, made, database, row);
            return std::move(made.motion);
          }};
}

std::vector<EvaluationMethod> selectionMethods(const Corpus& /*corpus*/, const UnitDatabase& database) {
  return {unitMethod("greedy", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kAny)),
          unitMethod("guided", database, selectingBy(SelectionMethod::kViterbi, UnitScales::kAny))};
}

namespace {

/// From EDGE as published to the default, one departure more a row.
std::vector<EvaluationMethod> stepsFromEdge(const UnitDatabase& database) {
  std::vector<EvaluationMethod> methods;
  SynthesisOptions options = edgeAsPublished();
  const auto add = [&](std::string name) { methods.push_back(unitMethod(std::move(name), database, options)); };
  add("EDGE as published");
  options.departures.silences_keep_their_pace = true;
  add("+ silences' pace");
  options.departures.joins_where_lips_agree = true;
  add("+ join where lips agree");
  options.departures.offsets_led_away = true;
  add("+ offsets led away");
  options.selection.weights = {};
  add("+ lips in the costs");
  options.selection.units = UnitScales::kAny;
  add("+ units of any length");
  options.selection.method = SelectionMethod::kViterbi;
  add("+ cheapest cover");
  return methods;
}

/// The same corpus, whose prediction lacks the networks.
EvaluationMethod withoutNetworks(std::string name, const Corpus& corpus) {
  struct Without {
    explicit Without(const Corpus& with) : corpus(with), database(corpus) {}
    Corpus corpus;
    UnitDatabase database;
  };
  Corpus changed = corpus;
  auto model = std::make_shared<TrajectoryModel>(*corpus.trajectory_model);
  model->networks.clear();
  changed.trajectory_model = model;
  const auto without = std::make_shared<Without>(changed);
  const EvaluationMethod method =
      unitMethod(name, without->database, selectingBy(SelectionMethod::kViterbi, UnitScales::kAny));
  return {std::move(name),
          [without, method](const CorpusTake& take, EvaluationRow& row) { return method.animate(take, row); }};
}

}  // namespace

EvaluationMethod predictionMethod(std::string name, const UnitDatabase& database) {
  SynthesisOptions options = selectingBy(SelectionMethod::kViterbi, UnitScales::kAny);
  options.context.fragments = options.context.keep_contacts = false;
  const auto curves = std::make_shared<CurveModel>(database);
  return {std::move(name), [&database, options, curves](const CorpusTake& take, EvaluationRow&) {
            SynthesisRequest request{take.text, "capture", take.labels, {}, options};
            request.options.curves.model = curves.get();
            request.options.frame_rate_hz = take.motion.frame_rate_hz;
            return synthesise(request, database).motion;
          }};
}

std::vector<EvaluationMethod> ablationMethods(const Corpus& corpus, const UnitDatabase& database) {
  std::vector<EvaluationMethod> methods = stepsFromEdge(database);
  const auto add = [&](std::string name, const auto& change) {
    SynthesisOptions options = selectingBy(SelectionMethod::kViterbi, UnitScales::kAny);
    options.selection.lattice = corpus.lattice_weights;
    options.context.settings = corpus.motion_settings;
    change(options, *options.selection.lattice, *options.context.settings);
    methods.push_back(unitMethod(std::move(name), database, options));
  };
  using Options = SynthesisOptions;
  using Weights = LatticeWeights;
  using Settings = MotionSettings;
  add("guided", [](Options&, Weights&, Settings&) {});
  std::set<std::string_view> added = {""};
  for (const CostTerm& term : pairTerms()) {
    if (!added.insert(term.ablation).second) continue;
    add(fmt::format("- {}", term.ablation), [&](Options&, Weights& weights, Settings&) {
      for (const CostTerm& other : pairTerms()) {
        if (other.ablation == term.ablation) weights[other.name] = 0;
      }
    });
  }
  add("- context (all below)", [](Options& o, Weights&, Settings&) { o.context.enabled = false; });
  if (corpus.trajectory_model != nullptr && !corpus.trajectory_model->networks.empty())
    methods.push_back(withoutNetworks("- networks", corpus));
  add("- mean of the context", [](Options& o, Weights&, Settings&) { o.context.average = false; });
  add("- variance restored", [](Options& o, Weights&, Settings&) { o.context.restore_variance = false; });
  add("- contacts kept", [](Options& o, Weights&, Settings&) { o.context.keep_contacts = false; });
  add("- captured detail", [](Options&, Weights&, Settings& s) { s.first_detail = s.other_detail = 0; });
  add("- learnt settings", [](Options&, Weights&, Settings& s) { s = {}; });
  add("+ all slow captured", [](Options&, Weights&, Settings& s) { s.slow_captured = 1; });
  add("+ all detail as it is", [](Options&, Weights&, Settings& s) { s.first_detail = s.other_detail = 1; });
  add("- coupling searched", [](Options& o, Weights&, Settings&) { o.search_coupling = false; });
  add("- overlap", [](Options& o, Weights&, Settings&) { o.overlap_ms = 0; });
  return methods;
}

std::vector<EvaluationMethod> backoffMethods(const Corpus& corpus, const UnitDatabase& database) {
  std::vector<EvaluationMethod> methods;
  SynthesisOptions options = selectingBy(SelectionMethod::kViterbi, UnitScales::kAny);
  methods.push_back(unitMethod("guided, stand-ins", database, options));
  if (corpus.trajectory_model != nullptr) {
    SynthesisOptions still = options;
    still.context.restore_unsaid = false;
    methods.push_back(unitMethod("guided, movement not brought back", database, still));
  }
  options.curves.fill_gaps = options.curves.before_stand_ins = true;
  methods.push_back(unitMethod("guided, curves in gaps", database, options));
  if (corpus.trajectory_model != nullptr) {
    if (!corpus.trajectory_model->networks.empty()) methods.push_back(withoutNetworks("guided, no networks", corpus));
    methods.push_back(predictionMethod("prediction alone", database));
  }
  methods.push_back(unitMethod("greedy, stand-ins", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kAny)));
  methods.push_back(unitMethod("EDGE as published", database, edgeAsPublished()));
  methods.push_back(curvesMethod("vocal curves", database));
  return methods;
}

EvaluationMethod curvesMethod(std::string name, const UnitDatabase& database) {
  const auto model = std::make_shared<CurveModel>(database);
  return {std::move(name), [&database, model](const CorpusTake& take, EvaluationRow&) {
            SynthesisRequest request{take.text, "capture", take.labels, {}, {}};
            request.options.frame_rate_hz = take.motion.frame_rate_hz;
            request.options.curves.alone = CurveStyle::kSpeech;
            request.options.curves.model = model.get();
            return synthesise(request, database).motion;
          }};
}

std::vector<EvaluationMethod> evaluationMethods(const Corpus& corpus, const UnitDatabase& database) {
  std::vector<EvaluationMethod> methods;
  methods.push_back(unitMethod("guided (default)", database, selectingBy(SelectionMethod::kViterbi, UnitScales::kAny)));
  SynthesisOptions hearing = selectingBy(SelectionMethod::kViterbi, UnitScales::kAny);
  hearing.context.hear = true;
  const bool can_hear = corpus.trajectory_model != nullptr && !corpus.trajectory_model->sound.isEmpty();
  if (can_hear) methods.push_back(unitMethod("guided, with the sound", database, hearing));
  if (corpus.trajectory_model != nullptr) methods.push_back(predictionMethod("prediction alone", database));
  methods.push_back(unitMethod("greedy, any units", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kAny)));
  methods.push_back(
      unitMethod("greedy, paper's units", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kPaper)));
  methods.push_back(unitMethod("EDGE as published", database, edgeAsPublished()));
  methods.push_back(curvesMethod("vocal curves", database));
  const auto dominance = std::make_shared<DominanceModel>(DominanceModel::fit(corpus));
  methods.push_back({"dominance", [dominance](const CorpusTake& take, EvaluationRow&) {
                       return dominance->animate(take.labels, take.motion.frame_rate_hz, take.motion.frameCount());
                     }});
  methods.push_back({"mean pose", [&corpus](const CorpusTake& take, EvaluationRow&) {
                       return meanPose(corpus, take.motion.frame_rate_hz, take.motion.frameCount());
                     }});
  return methods;
}

}  // namespace mouthpiece
