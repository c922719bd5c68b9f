#include "corpus_tools/evaluation_methods.h"

#include <map>
#include <memory>
#include <mutex>

#include "corpus_tools/dominance_model.h"
#include "synthesis/join.h"

namespace mouthpiece {
namespace {

MotionClip meanPose(const Corpus& corpus, double frame_rate_hz, std::size_t frames) {
  const auto width = static_cast<Eigen::Index>(3 * corpus.layout.markers.size());
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(width), counts = Eigen::RowVectorXd::Zero(width);
  for (const CorpusTake& take : corpus.takes) {
    const auto seen = take.motion.positions_mm.array().isFinite();
    sum += seen.select(take.motion.positions_mm.array(), 0.0).matrix().colwise().sum();
    counts += seen.cast<double>().matrix().colwise().sum();
  }
  MotionClip clip{frame_rate_hz, corpus.layout.markerNames(), {}};
  clip.positions_mm = (sum.array() / counts.array()).matrix().replicate(static_cast<Eigen::Index>(frames), 1);
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
    row.join_jumps_mm.push_back(join.position_jump_mm);
    row.join_limits_mm.push_back(limit.step_mm);
    row.velocity_jumps_mm_s.push_back(join.velocity_jump_mm_s);
    row.velocity_limits_mm_s.push_back(limit.velocity_change_mm_s);
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
  return {std::move(name), [&database, options, usual](const CorpusTake& take, EvaluationRow& row) {
            SynthesisRequest request{take.text, "capture", take.labels, {}, options};
            request.options.frame_rate_hz = take.motion.frame_rate_hz;
            UtteranceAnimation made = synthesise(request, database);
            countUnits(made, *usual, row);
            return std::move(made.motion);
          }};
}

std::vector<EvaluationMethod> evaluationMethods(const Corpus& corpus, const UnitDatabase& database) {
  std::vector<EvaluationMethod> methods;
  methods.push_back(unitMethod("greedy, any units", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kAny)));
  methods.push_back(
      unitMethod("greedy, paper's units", database, selectingBy(SelectionMethod::kGreedy, UnitScales::kPaper)));
  methods.push_back(
      unitMethod("viterbi, any units", database, selectingBy(SelectionMethod::kViterbi, UnitScales::kAny)));
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
