#include "corpus_tools/building/trajectory_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/matrix_solvers.h"
#include "base/parallel_for.h"
#include "base/statistics.h"
#include "corpus_tools/building/prediction_parts.h"
#include "corpus_tools/building/trajectory_design.h"

namespace mouthpiece {
namespace {

// Searched for each component; the error is flat around the best.
constexpr Seconds kTimeConstants[] = {0.018, 0.025, 0.032};
constexpr Seconds kLeads[] = {0.0, 0.015};
constexpr std::size_t kJudgeEvery = 4;  ///< every fourth take judges the search
constexpr std::size_t kLeastTakes = 4;
/// 72 MB of normal equations. GRID has 1,000.
constexpr std::size_t kMostFeatures = 3000;
constexpr std::size_t kNetworks = 4;
constexpr double kHeldToHalf = 0.25;

/// The principal components of the speaking face: analysis, shapes.
void fitComponents(const std::vector<FitTake>& takes, const SpeechColumns& columns, Eigen::Index components,
                   TrajectoryModel& model) {
  const Eigen::Index width = columns.weights.size();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(width, width);
  for (const FitTake& take : takes) {
    const Eigen::MatrixXd weighted = take.displacements.cast<double>() * columns.weights.asDiagonal();
    covariance.selfadjointView<Eigen::Lower>().rankUpdate(weighted.transpose());
  }
  const Eigen::MatrixXd directions = symmetricEigen(covariance).vectors.rightCols(components).rowwise().reverse();
  model.analysis = columns.weights.asDiagonal() * directions / columns.lip_norm;
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(components, components);
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(components, width);
  for (const FitTake& take : takes) {
    const Eigen::MatrixXd displacements = take.displacements.cast<double>();
    const Eigen::MatrixXd values = displacements * model.analysis;
    own += values.transpose() * values;
    both += values.transpose() * displacements;
  }
  own.diagonal().array() += 1e-9 * std::max(1e-12, own.diagonal().maxCoeff());
  model.shapes = solveSymmetric(std::move(own), both);
  for (Eigen::Index column = 0; column < width; ++column) {
    if (!(columns.weights(column) > 0)) model.shapes.col(column).setZero();
  }
}

struct Solution {
  Eigen::MatrixXd targets;              ///< features x components
  Eigen::RowVectorXd judged_errors;     ///< squared, on the judges
  std::vector<Eigen::MatrixXd> judged;  ///< what is predicted of each judge, centred
};

/// A corpus as its fit goes through it: some takes in memory, of a short corpus all.
struct Material {
  const Corpus& corpus;
  const SpeechColumns& columns;
  const TrajectoryFitOptions& options;
  const FitTakes& kept;
};

class TargetSolver {
 public:
  TargetSolver(const Material& material, const SegmentFeatures& features, const TrajectoryModel& model)
      : material_(material), takes_(material.kept.takes), features_(features), model_(model), prior_(features.names()) {
    const Eigen::VectorXd factors = (features.ridgeFactors() * material.options.ridge).cwiseSqrt();
    ridge_ = prior_.precision();
    ridge_.array().colwise() *= factors.array();
    ridge_.array().rowwise() *= factors.transpose().array();
    for (const FitTake& take : takes_) segments_.push_back(features.of(material.corpus.takes[take.index].labels));
  }

  /// From the kept takes of those numbers.
  [[nodiscard]] Solution solve(const ComponentDynamics& dynamics, const std::vector<std::size_t>& use,
                               const std::vector<std::size_t>& judges) const {
    NormalEquations equations(features_.count(), model_.componentCount());
    for (const std::size_t take : use)
      equations.add(designRows(takes_[take], segments_[take], features_.count(), dynamics), valuesOf(takes_[take]));
    Solution solution;
    solution.targets = equations.solve(ridge_);
    solution.judged_errors = Eigen::RowVectorXd::Zero(model_.componentCount());
    for (const std::size_t take : judges) {
      solution.judged.push_back(
          designRows(takes_[take], segments_[take], features_.count(), dynamics).times(solution.targets));
      solution.judged_errors += (valuesOf(takes_[take]) - solution.judged.back()).colwise().squaredNorm();
    }
    return solution;
  }

  /// From all takes of the corpus; those that are not kept are read, summed up and forgotten one by one.
  [[nodiscard]] Eigen::MatrixXd solveAll(const ComponentDynamics& dynamics) const {
    NormalEquations equations(features_.count(), model_.componentCount());
    const auto add = [&](const FitTake& take, const TakeSegments& segments) {
      equations.add(designRows(take, segments, features_.count(), dynamics), valuesOf(take));
    };
    if (material_.kept.are_all) {
      for (std::size_t take = 0; take < takes_.size(); ++take) add(takes_[take], segments_[take]);
    } else {
      for (std::size_t i = 0; i < material_.corpus.takes.size(); ++i) {
        const auto take = fitTake(material_.corpus, i, material_.columns, material_.options.fit_rate_hz);
        if (take) add(*take, features_.of(material_.corpus.takes[i].labels));
      }
    }
    return equations.solve(ridge_);
  }

  [[nodiscard]] const ArticulatoryPrior& prior() const { return prior_; }

  /// Frames x components, centred.
  [[nodiscard]] Eigen::MatrixXd valuesOf(const FitTake& take) const {
    return take.displacements.cast<double>() * model_.analysis;
  }

 private:
  const Material& material_;
  const std::vector<FitTake>& takes_;
  const SegmentFeatures& features_;
  const TrajectoryModel& model_;
  ArticulatoryPrior prior_;
  Eigen::MatrixXd ridge_;
  std::vector<TakeSegments> segments_;  ///< of the kept takes
};

std::vector<ComponentDynamics> candidateDynamics() {
  std::vector<ComponentDynamics> candidates;
  for (const Seconds time_constant : kTimeConstants) {
    for (const Seconds lead : kLeads) candidates.push_back({time_constant, lead});
  }
  return candidates;
}

void setTargets(const SegmentFeatures& features, const ArticulatoryPrior& prior, const Eigen::MatrixXd& targets,
                TrajectoryModel& model) {
  model.targets = prior.unsaid(targets);
  for (Eigen::Index feature = 0; feature < features.count(); ++feature)
    model.targets[features.name(feature)] = targets.row(feature).transpose();
}

/// What is predicted of each judge by models that have not seen it, and what was captured.
struct Judged {
  std::vector<Eigen::MatrixXd> predicted, captured;  ///< frames x components, centred
  Eigen::MatrixXd targets;                           ///< of those models, features x components
};

/// Each component's dynamics with the least error on takes left out, and then the targets from all takes.
Judged fitMovement(const SegmentFeatures& features, const TargetSolver& solver, const std::vector<std::size_t>& use,
                   const std::vector<std::size_t>& judges, std::size_t jobs, TrajectoryModel& model) {
  const std::vector<ComponentDynamics> candidates = candidateDynamics();
  std::vector<Solution> searched(candidates.size());
  parallelFor(candidates.size(), jobs, [&](std::size_t i) { searched[i] = solver.solve(candidates[i], use, judges); });

  Judged judged;
  judged.predicted = searched.front().judged;
  judged.targets.resize(features.count(), model.componentCount());
  std::vector<std::size_t> chosen;
  for (Eigen::Index component = 0; component < model.componentCount(); ++component) {
    const auto least = std::min_element(searched.begin(), searched.end(), [&](const Solution& a, const Solution& b) {
      return a.judged_errors(component) < b.judged_errors(component);
    });
    chosen.push_back(unsignedIndex(least - searched.begin()));
    model.dynamics.push_back(candidates[chosen.back()]);
    judged.targets.col(component) = least->targets.col(component);
    for (std::size_t i = 0; i < judges.size(); ++i)
      judged.predicted[i].col(component) = least->judged[i].col(component);
  }

  Eigen::MatrixXd targets(features.count(), model.componentCount());
  std::vector<Eigen::MatrixXd> solved(candidates.size());
  parallelFor(candidates.size(), jobs, [&](std::size_t i) {
    const bool used = std::find(chosen.begin(), chosen.end(), i) != chosen.end();
    if (used) solved[i] = solver.solveAll(candidates[i]);
  });
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    targets.col(signedIndex(i)) = solved[chosen[i]].col(signedIndex(i));
  }
  setTargets(features, solver.prior(), targets, model);
  return judged;
}

NetworkTake networkTake(const FitTake& take, const SpeechLabels& labels, const SilenceTiming& timing,
                        const Eigen::MatrixXd& values) {
  return {contextSegments(labels, timing), take.times, take.seen.cast<float>(), values.cast<float>()};
}

/// Networks, each without another part of the takes: together they have seen all. The one that has not seen the judges
/// says how far to believe them, and joins the judged prediction. Returns what each take has beyond the network that
/// has not seen it.
std::vector<SoundTake> fitNetworks(const Corpus& corpus, const std::vector<FitTake>& takes, const TargetSolver& solver,
                                   const std::vector<std::size_t>& judges, std::size_t jobs, Judged& judged,
                                   TrajectoryModel& model) {
  std::vector<NetworkTake> known;
  for (const FitTake& take : takes)
    known.push_back(networkTake(take, corpus.takes[take.index].labels, model.silence, solver.valuesOf(take)));
  model.networks.resize(kNetworks);
  parallelFor(kNetworks, jobs, [&](std::size_t network) {
    std::vector<std::size_t> use;
    for (std::size_t take = 0; take < known.size(); ++take) {
      if (take % kJudgeEvery != network % kJudgeEvery) use.push_back(take);
    }
    model.networks[network] = fitContextNetwork(known, use, model.componentCount(), network + 1);
  });
  // Least squares along the way from the one prediction to the other; a bias towards half of each.
  Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(model.componentCount()), length = along;
  std::vector<Eigen::MatrixXd> by_network;
  for (std::size_t i = 0; i < judges.size(); ++i) {
    by_network.push_back(centredPrediction(model.networks.front(), known[judges[i]]));
    const Eigen::MatrixXd way = by_network.back() - judged.predicted[i];
    along += way.cwiseProduct(judged.captured[i] - judged.predicted[i]).colwise().sum();
    length += way.colwise().squaredNorm();
  }
  const Eigen::RowVectorXd held = length * kHeldToHalf;
  const Eigen::RowVectorXd share = (along + 0.5 * held).cwiseQuotient((length + held).cwiseMax(1e-12));
  model.network_share = share.cwiseMax(0).cwiseMin(1);
  for (std::size_t i = 0; i < judges.size(); ++i)
    judged.predicted[i] += (by_network[i] - judged.predicted[i]) * model.network_share.asDiagonal();

  std::vector<SoundTake> beyond(takes.size());
  parallelFor(takes.size(), jobs, [&](std::size_t i) {
    const std::size_t part = i % kJudgeEvery;
    beyond[i] = {takes[i].index, part, takes[i].times, takes[i].seen,
                 solver.valuesOf(takes[i]) - centredPrediction(model.networks[part], known[i])};
  });
  return beyond;
}

/// As far as takes left out ask for it.
void fitGain(const Judged& judged, TrajectoryModel& model) {
  double predicted = 0, captured = 0;
  for (std::size_t i = 0; i < judged.captured.size(); ++i) {
    predicted += judged.predicted[i].squaredNorm();
    captured += judged.captured[i].squaredNorm();
  }
  model.gain = gainFor(predicted, captured);
}

std::vector<std::size_t> takesWithFeatures(const Corpus& corpus, const FitTakes& kept) {
  std::vector<std::size_t> takes(kept.are_all ? kept.takes.size() : corpus.takes.size());
  for (std::size_t i = 0; i < takes.size(); ++i) takes[i] = kept.are_all ? kept.takes[i].index : i;
  return takes;
}

}  // namespace

double gainFor(double predicted, double captured) {
  constexpr double kPredictedVariance = 0.92;  // of the capture's; the fragments' own detail brings the rest
  constexpr double kLargestGain = 1.25;
  return std::clamp(std::sqrt(kPredictedVariance * captured / std::max(predicted, 1e-12)), 1.0, kLargestGain);
}

void fitLevel(const std::vector<FitTake>& takes, const Corpus& corpus, TrajectoryModel& model) {
  model.level = Eigen::RowVectorXd::Zero(model.componentCount());
  Eigen::RowVectorXd sum = model.level;
  for (const FitTake& take : takes) {
    const Eigen::MatrixXd predicted = model.predict(corpus.takes[take.index].labels, take.times);
    const Eigen::RowVectorXd mean = take.seen.transpose() * predicted / take.seen.sum();
    sum += take.mean * model.analysis - mean;
  }
  model.level = sum / asReal(takes.size());
}

void fitClosing(const std::vector<FitTake>& takes, const Corpus& corpus, const SpeechColumns& columns,
                TrajectoryModel& model) {
  model.closing = Eigen::RowVectorXd::Zero(columns.weights.size());
  if (!columns.lips.hasLips()) return;
  double squares = 0;
  std::vector<double> closed;
  for (const FitTake& take : takes) {
    const double mean = take.seen.dot(take.openings) / take.seen.sum();
    const Eigen::VectorXd opening = take.seen.cwiseProduct((take.openings.array() - mean).matrix());
    model.closing += opening.transpose() * take.displacements.cast<double>();
    squares += opening.squaredNorm();
    for (const LabelledPhone& phone : corpus.takes[take.index].labels.phones) {
      if (!isBilabial(phone.phone)) continue;
      const double tightest = take.tightestOpening(phone.span);
      if (std::isfinite(tightest)) closed.push_back(tightest);
    }
  }
  model.closing /= std::max(squares, 1e-12);
  for (Eigen::Index column = 0; column < model.closing.size(); ++column) {
    if (!(columns.weights(column) > 0)) model.closing(column) = 0;
  }
  model.closed_opening_mm = median(std::move(closed), model.closed_opening_mm);
}

TrajectoryFit fitTrajectory(const Corpus& corpus, const TrajectoryFitOptions& options) {
  const SpeechColumns columns = speechColumns(corpus);
  if (!(columns.lip_norm > 0)) return {};
  const FitTakes kept = fitTakes(corpus, columns, options.fit_rate_hz, options.most_kept_frames);
  const std::vector<FitTake>& takes = kept.takes;
  if (takes.size() < kLeastTakes) return {};
  const std::size_t jobs = options.jobs > 0 ? options.jobs : defaultThreadCount();
  auto model = std::make_shared<TrajectoryModel>();
  const auto speaking = signedIndex((columns.weights.array() > 0).count());
  fitComponents(takes, columns, std::min(options.components, speaking), *model);
  model->level = Eigen::RowVectorXd::Zero(model->componentCount());
  model->silence = fitSilenceTiming(takes, corpus);
  const SegmentFeatures features(corpus, takesWithFeatures(corpus, kept), kMostFeatures, model->silence);
  const Material material{corpus, columns, options, kept};
  const TargetSolver solver(material, features, *model);
  std::vector<std::size_t> use, judges;
  for (std::size_t take = 0; take < takes.size(); ++take) (take % kJudgeEvery == 0 ? judges : use).push_back(take);
  Judged judged = fitMovement(features, solver, use, judges, jobs, *model);
  for (const std::size_t take : judges) judged.captured.push_back(solver.valuesOf(takes[take]));
  const std::vector<SoundTake> beyond = fitNetworks(corpus, takes, solver, judges, jobs, judged, *model);
  fitGain(judged, *model);
  fitLevel(takes, corpus, *model);
  fitClosing(takes, corpus, columns, *model);

  SoundFit sound = fitSound(corpus, beyond, kJudgeEvery, jobs);
  model->sound = std::move(sound.model);

  TrajectoryFit fit{model, nullptr, {}, std::move(sound.account)};
  auto judging = std::make_shared<TrajectoryModel>(*model);
  setTargets(features, solver.prior(), judged.targets, *judging);
  judging->networks.resize(1);  // the one without the judges
  fit.judging = judging;
  for (const std::size_t judge : judges) fit.judges.push_back(takes[judge].index);
  return fit;
}

std::shared_ptr<const TrajectoryModel> fitTrajectoryModel(const Corpus& corpus, const TrajectoryFitOptions& options) {
  return fitTrajectory(corpus, options).model;
}

}  // namespace mouthpiece
