#include "corpus_tools/evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>

#include "base/errors.h"
#include "corpus_tools/dominance_model.h"
#include "motion/resample.h"
#include "synthesis/join.h"
#include "synthesis/synthesis.h"
#include "units/selection.h"
#include "units/unit_database.h"

namespace mouthpiece {
namespace {

/// The frame rates that the synthesis offers.
constexpr double kLowestRateHz = 24, kHighestRateHz = 240;

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

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

class Evaluator {
 public:
  Evaluator(const Corpus& corpus, const std::vector<CorpusTake>& captured, const EvaluationProgress& progress)
      : corpus_(corpus), captured_(captured), progress_(progress), database_(corpus) {
    evaluation_.corpus = corpus.name;
    for (const CorpusTake& take : captured) evaluation_.takes.push_back(take.name);
  }

  Evaluation run() {
    addUnitRow("greedy, any units", SelectionMethod::kGreedy, UnitScales::kAny);
    addUnitRow("greedy, paper's units", SelectionMethod::kGreedy, UnitScales::kPaper);
    addUnitRow("viterbi, any units", SelectionMethod::kViterbi, UnitScales::kAny);
    const DominanceModel dominance = DominanceModel::fit(corpus_);
    addRow("dominance", [&](const CorpusTake& take, EvaluationRow&) {
      return dominance.animate(take.labels, take.motion.frame_rate_hz, take.motion.frameCount());
    });
    addRow("mean pose", [&](const CorpusTake& take, EvaluationRow&) {
      return meanPose(corpus_, take.motion.frame_rate_hz, take.motion.frameCount());
    });
    return std::move(evaluation_);
  }

 private:
  template <typename Animate>
  void addRow(const std::string& method, const Animate& animate) {
    EvaluationRow row;
    row.method = method;
    for (const CorpusTake& take : captured_) {
      row.lips += measureLips(take.motion, animate(take, row), take.labels, corpus_.layout);
      if (progress_) progress_(++done_, kRows * captured_.size());
    }
    evaluation_.rows.push_back(std::move(row));
  }

  void addUnitRow(const std::string& method, SelectionMethod selection, UnitScales units) {
    addRow(method, [&](const CorpusTake& take, EvaluationRow& row) {
      SynthesisRequest request{take.text, "capture", take.labels, {}, {}};
      request.options.frame_rate_hz = take.motion.frame_rate_hz;
      request.options.selection.method = selection;
      request.options.selection.units = units;
      UtteranceAnimation made = synthesise(request, database_);
      countUnits(made, row);
      return std::move(made.motion);
    });
  }

  void countUnits(const UtteranceAnimation& made, EvaluationRow& row) {
    row.phones += made.labels.phones.size();
    row.pairs += made.labels.phones.size() - 1;
    row.units += made.units.size();
    for (const PlacedUnit& unit : made.units) {
      if (unit.is_backoff) row.backoff_pairs += unit.phones.last.value - unit.phones.first.value;
    }
    for (const Join& join : made.joins) {
      row.join_jumps_mm.push_back(join.position_jump_mm);
      row.join_limits_mm.push_back(usualStep(made.motion.frame_rate_hz));
    }
  }

  double usualStep(double frame_rate_hz) {
    const auto known = usual_steps_.find(frame_rate_hz);
    if (known != usual_steps_.end()) return known->second;
    return usual_steps_[frame_rate_hz] = frameChangePercentile(corpus_, frame_rate_hz).step_mm;
  }

  static constexpr std::size_t kRows = 5;
  const Corpus& corpus_;
  const std::vector<CorpusTake>& captured_;
  const EvaluationProgress& progress_;
  UnitDatabase database_;
  Evaluation evaluation_;
  std::map<double, double> usual_steps_;  ///< by frame rate
  std::size_t done_ = 0;
};

/// Captures slower or faster than the synthesis offers are compared at the nearest rate that it does.
std::vector<CorpusTake> atOfferedRates(std::vector<CorpusTake> takes) {
  for (CorpusTake& take : takes) {
    const double rate = std::clamp(take.motion.frame_rate_hz, kLowestRateHz, kHighestRateHz);
    if (rate != take.motion.frame_rate_hz) take.motion = resampleClip(take.motion, rate);
  }
  return takes;
}

}  // namespace

Evaluation evaluateCorpus(const Corpus& corpus, const std::vector<CorpusTake>& captured,
                          const EvaluationProgress& progress) {
  if (captured.empty()) throw InputError(corpus.name, "", "no take to compare with");
  if (corpus.takes.empty()) throw InputError(corpus.name, "", "has no takes; expected some to speak with");
  const std::vector<CorpusTake> comparable = atOfferedRates(captured);
  return Evaluator(corpus, comparable, progress).run();
}

double EvaluationRow::unitsPerPhone() const {
  return phones > 0 ? static_cast<double>(units) / static_cast<double>(phones) : std::nan("");
}

double EvaluationRow::backoffShare() const {
  return pairs > 0 ? static_cast<double>(backoff_pairs) / static_cast<double>(pairs) : std::nan("");
}

double EvaluationRow::joinJumpPercentile(double share) const { return quantile(join_jumps_mm, share); }

double EvaluationRow::usualStep() const {
  double sum = 0;
  for (const double limit : join_limits_mm) sum += limit;
  return join_limits_mm.empty() ? std::nan("") : sum / static_cast<double>(join_limits_mm.size());
}

double EvaluationRow::joinsOverLimit() const {
  if (join_jumps_mm.empty()) return std::nan("");
  std::size_t over = 0;
  for (std::size_t i = 0; i < join_jumps_mm.size(); ++i) over += join_jumps_mm[i] > join_limits_mm[i] ? 1 : 0;
  return static_cast<double>(over) / static_cast<double>(join_jumps_mm.size());
}

std::vector<CorpusTake> holdOut(Corpus& corpus, double share, std::uint64_t seed) {
  if (!(share > 0 && share < 1)) {
    throw InputError("--hold-out", "", fmt::format("found {}; expected a share between 0 and 1", share));
  }
  const std::size_t count = corpus.takes.size();
  if (count < 2) throw InputError(corpus.name, "", fmt::format("has {} take; expected at least two", count));
  const auto wanted = static_cast<std::size_t>(std::lround(share * static_cast<double>(count)));
  const std::size_t held = std::clamp<std::size_t>(wanted, 1, count - 1);
  // Fisher-Yates by hand: std::shuffle differs between standard libraries.
  std::mt19937_64 random(seed);
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i;
  for (std::size_t i = 0; i < held; ++i) std::swap(order[i], order[i + random() % (count - i)]);
  std::vector<bool> is_held(count, false);
  for (std::size_t i = 0; i < held; ++i) is_held[order[i]] = true;
  std::vector<CorpusTake> taken, kept;
  for (std::size_t i = 0; i < count; ++i) (is_held[i] ? taken : kept).push_back(std::move(corpus.takes[i]));
  corpus.takes = std::move(kept);
  return taken;
}

}  // namespace mouthpiece
