#include "corpus_tools/building/corpus_adapting.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "base/errors.h"
#include "base/matrix_solvers.h"
#include "base/parallel_for.h"
#include "corpus_tools/building/adapted_motion.h"
#include "corpus_tools/building/build_state.h"
#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/building/trajectory_design.h"
#include "corpus_tools/building/trajectory_fit.h"

namespace mouthpiece {
namespace {

// Tried for a person, each against takes left out.
constexpr std::array<double, 7> kPoseHolds{0.1, 0.3, 1, 3, 10, 30, 100};
constexpr std::array<double, 6> kTargetHolds{0.5, 1, 2, 4, 8, 32};
constexpr std::size_t kMostFolds = 5, kJudgesEvery = 4;
constexpr double kUntriedHold = 10;  ///< with one take, which leaves none to try on
/// Own targets speak through the sums, which must be heard beside the networks.
constexpr double kMostNetworkShare = 0.75;
constexpr std::size_t kMostOwnFeatures = 1500;

/// How far poses are held, in takes that say the same as the other: across the face, up, out of it.
using PoseHolds = std::array<double, 3>;

/// How far the person's own takes are held back: `targets` as TrajectoryFitOptions::ridge; none: no own targets.
struct Holds {
  PoseHolds poses{kUntriedHold, kUntriedHold, kUntriedHold};
  std::optional<double> targets;
  std::optional<double> gain;  ///< of the prediction of takes left out (gainFor()); none: the other's
};

/// One take of the person beside what the other's model says of it, each less its mean over the seen frames.
struct ComparedTake {
  FitTake fit;
  Eigen::MatrixXd predicted;       ///< frames x components; 0 where not seen
  std::vector<DesignRows> design;  ///< for each of the model's different dynamics
};

class Adapting {
 public:
  using Takes = std::vector<std::size_t>;

  Adapting(const Corpus& large, const Corpus& own, std::size_t jobs)
      : own_(own), jobs_(jobs), placing_(large, own), columns_(speechColumns(own)), base_(*large.trajectory_model) {
    if (!(columns_.lip_norm > 0)) throw InputError(own.name, "", "has no lip markers; expected some to adapt to");
    base_.shapes = placing_(base_.shapes);
    base_.closing = placing_(base_.closing) / placing_.scale();
    base_.closed_opening_mm *= placing_.scale();
    base_.sound = {};  // another voice's
    if (!base_.networks.empty()) base_.network_share = base_.network_share.cwiseMin(kMostNetworkShare);
    std::vector<FitTake> takes =
        fitTakes(own, columns_, TrajectoryFitOptions().fit_rate_hz, TrajectoryFitOptions().most_kept_frames).takes;
    std::vector<std::size_t> numbers;
    for (const FitTake& take : takes) numbers.push_back(take.index);
    features_.emplace(own, numbers, kMostOwnFeatures, base_.silence);
    for (const ComponentDynamics& dynamics : base_.dynamics) {
      const auto same = [&](const ComponentDynamics& other) {
        return other.time_constant == dynamics.time_constant && other.lead == dynamics.lead;
      };
      auto known = std::find_if(dynamics_.begin(), dynamics_.end(), same);
      dynamics_of_.push_back(unsignedIndex(known - dynamics_.begin()));
      if (known == dynamics_.end()) dynamics_.push_back(dynamics);
    }
    for (FitTake& take : takes) compare(std::move(take));
    for (std::size_t i = 0; i < takes_.size(); ++i) all_.push_back(i);
  }

  [[nodiscard]] const Takes& all() const { return all_; }
  [[nodiscard]] const Placing& placing() const { return placing_; }
  /// The other's, placed: what the person's takes correct.
  [[nodiscard]] const TrajectoryModel& base() const { return base_; }
  /// Each take's number in the person's corpus.
  [[nodiscard]] std::size_t indexOf(std::size_t take) const { return takes_[take].fit.index; }

  /// With the least error at the lips over takes left out.
  [[nodiscard]] Holds chooseHolds() const {
    Holds best;
    if (takes_.size() < 2) return best;
    const std::size_t folds = std::min(kMostFolds, takes_.size());
    std::array<std::vector<std::array<double, kPoseHolds.size()>>, 3> by_poses;
    for (auto& of_axis : by_poses) of_axis.resize(folds);
    parallelFor(folds, jobs_, [&](std::size_t fold) {
      const auto [use, judges] = split(folds, fold);
      for (std::size_t i = 0; i < kPoseHolds.size(); ++i) {
        const double hold = kPoseHolds[i];
        const Eigen::Array3d errors = errorsOn(judges, shapesFrom(use, {hold, hold, hold}), {});
        for (std::size_t axis = 0; axis < 3; ++axis) by_poses[axis][fold][i] = errors(signedIndex(axis));
      }
    });
    for (std::size_t axis = 0; axis < 3; ++axis) best.poses[axis] = kPoseHolds[leastOf(by_poses[axis]).first];
    std::vector<std::array<double, kTargetHolds.size()>> by_targets(folds);
    std::vector<std::array<double, 1>> without(folds);
    parallelFor(folds, jobs_, [&](std::size_t fold) {
      const auto [use, judges] = split(folds, fold);
      const Eigen::MatrixXd shapes = shapesFrom(use, best.poses);
      without[fold][0] = errorsOn(judges, shapes, {}).sum();
      const std::vector<NormalEquations> equations = equationsOf(use, analysisOf(shapes));
      for (std::size_t i = 0; i < kTargetHolds.size(); ++i)
        by_targets[fold][i] = errorsOn(judges, shapes, targetsFrom(equations, kTargetHolds[i])).sum();
    });
    const auto [least, error] = leastOf(by_targets);
    if (error < leastOf(without).second) best.targets = kTargetHolds[least];
    best.gain = gainWith(best, folds);
    return best;
  }

  /// Learnt from the takes of those numbers; the other's, placed, when there are none.
  [[nodiscard]] std::shared_ptr<TrajectoryModel> modelFrom(const Takes& use, const Holds& holds) const {
    auto model = std::make_shared<TrajectoryModel>(base_);
    if (use.empty()) {
      model->analysis = analysisOf(base_.shapes);
      return model;
    }
    model->shapes = shapesFrom(use, holds.poses);
    model->analysis = analysisOf(model->shapes);
    if (holds.targets) addTargets(targetsFrom(equationsOf(use, model->analysis), *holds.targets), *model);
    std::vector<FitTake> takes;
    for (const std::size_t take : use) takes.push_back(takes_[take].fit);
    if (holds.gain) model->gain = *holds.gain;
    model->level.setZero();
    fitLevel(takes, own_, *model);
    fitClosing(takes, own_, columns_, *model);
    return model;
  }

 private:
  void compare(FitTake take) {
    const SpeechLabels& labels = own_.takes[take.index].labels;
    Eigen::MatrixXd predicted = base_.predict(labels, take.times);
    const Eigen::RowVectorXd mean = take.seen.transpose() * predicted / std::max(1.0, take.seen.sum());
    predicted = take.seen.asDiagonal() * (predicted.rowwise() - mean).eval();
    std::vector<DesignRows> design;
    const TakeSegments segments = features_->of(labels);
    for (const ComponentDynamics& dynamics : dynamics_)
      design.push_back(designRows(take, segments, features_->count(), dynamics));
    takes_.push_back({std::move(take), std::move(predicted), std::move(design)});
  }

  [[nodiscard]] std::pair<Takes, Takes> split(std::size_t folds, std::size_t fold) const {
    std::pair<Takes, Takes> parts;
    for (const std::size_t take : all_) (take % folds == fold ? parts.second : parts.first).push_back(take);
    return parts;
  }

  /// The place of the least sum over folds, and that sum.
  template <std::size_t kCount>
  static std::pair<std::size_t, double> leastOf(const std::vector<std::array<double, kCount>>& folds) {
    std::pair<std::size_t, double> least{0, std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < kCount; ++i) {
      double sum = 0;
      for (const auto& fold : folds) sum += fold[i];
      if (sum < least.second) least = {i, sum};
    }
    return least;
  }

  /// What the person's markers do with each of the other's components: ridge regression of the captured on the
  /// predicted, drawn to the other's own shapes.
  [[nodiscard]] Eigen::MatrixXd shapesFrom(const Takes& use, const PoseHolds& holds) const {
    const Eigen::Index components = base_.componentCount();
    Eigen::MatrixXd own = Eigen::MatrixXd::Zero(components, components);
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(components, base_.columnCount());
    for (const std::size_t take : use) {
      const ComparedTake& compared = takes_[take];
      own += compared.predicted.transpose() * compared.predicted;
      both += compared.predicted.transpose() * compared.fit.displacements.cast<double>();
    }
    const double energy = std::max(1e-9, own.trace() / asReal(components) / std::max(1.0, asReal(use.size())));
    Eigen::MatrixXd shapes(components, base_.columnCount());
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double held = holds[unsignedIndex(axis)] * energy;
      const Eigen::MatrixXd solved =
          solveSymmetric(own + held * Eigen::MatrixXd::Identity(components, components), both + held * base_.shapes);
      for (Eigen::Index column = axis; column < shapes.cols(); column += 3) shapes.col(column) = solved.col(column);
    }
    for (Eigen::Index column = 0; column < shapes.cols(); ++column) {
      if (!(columns_.weights(column) > 0)) shapes.col(column).setZero();
    }
    return shapes;
  }

  /// Weighted least squares of a pose by `shapes`: columns x components.
  [[nodiscard]] Eigen::MatrixXd analysisOf(const Eigen::MatrixXd& shapes) const {
    const Eigen::MatrixXd weighted = columns_.weights.cwiseAbs2().asDiagonal() * shapes.transpose();
    Eigen::MatrixXd products = shapes * weighted;
    products.diagonal().array() += 1e-4 * products.trace() / asReal(products.rows());
    return solveSymmetric(std::move(products), weighted.transpose()).transpose();
  }

  /// For each of the different dynamics, what the person's takes have beyond the poses.
  [[nodiscard]] std::vector<NormalEquations> equationsOf(const Takes& use, const Eigen::MatrixXd& analysis) const {
    std::vector<NormalEquations> equations(dynamics_.size(), {features_->count(), base_.componentCount()});
    for (const std::size_t take : use) {
      const ComparedTake& compared = takes_[take];
      const Eigen::MatrixXd beyond = compared.fit.displacements.cast<double>() * analysis - compared.predicted;
      for (std::size_t i = 0; i < equations.size(); ++i) equations[i].add(compared.design[i], beyond);
    }
    return equations;
  }

  /// Features x components. No feature may run freely, as visemes do where nothing is known before.
  [[nodiscard]] Eigen::MatrixXd targetsFrom(const std::vector<NormalEquations>& equations, double hold) const {
    Eigen::MatrixXd targets(features_->count(), base_.componentCount());
    const Eigen::MatrixXd ridge = (hold * features_->ridgeFactors().cwiseMax(1.0)).asDiagonal();
    for (std::size_t i = 0; i < equations.size(); ++i) {
      const Eigen::MatrixXd solved = equations[i].solve(ridge);
      for (std::size_t c = 0; c < dynamics_of_.size(); ++c) {
        if (dynamics_of_[c] == i) targets.col(signedIndex(c)) = solved.col(signedIndex(c));
      }
    }
    return targets;
  }

  /// Of a take, mm; `targets` may be empty.
  [[nodiscard]] Eigen::MatrixXd movesOf(const ComparedTake& compared, const Eigen::MatrixXd& shapes,
                                        const Eigen::MatrixXd& targets) const {
    Eigen::MatrixXd values = compared.predicted;
    for (std::size_t c = 0; targets.size() > 0 && c < dynamics_of_.size(); ++c) {
      const auto column = signedIndex(c);
      values.col(column) += compared.design[dynamics_of_[c]].times(targets.col(column));
    }
    return values * shapes;
  }

  /// Across the face, up and out of it, weighted as the fit is: squares of what is missed.
  [[nodiscard]] Eigen::Array3d errorsOn(const Takes& judges, const Eigen::MatrixXd& shapes,
                                        const Eigen::MatrixXd& targets) const {
    Eigen::Array3d errors = Eigen::Array3d::Zero();
    for (const std::size_t take : judges) {
      const Eigen::MatrixXd missed = weighted(movesOf(takes_[take], shapes, targets) - capturedOf(takes_[take]));
      for (Eigen::Index column = 0; column < missed.cols(); ++column)
        errors(column % 3) += missed.col(column).squaredNorm();
    }
    return errors;
  }

  /// What the person moves in takes left out, beside what is predicted of them.
  [[nodiscard]] double gainWith(const Holds& holds, std::size_t folds) const {
    std::vector<double> predicted(folds), captured(folds);
    parallelFor(folds, jobs_, [&](std::size_t fold) {
      const auto [use, judges] = split(folds, fold);
      const Eigen::MatrixXd shapes = shapesFrom(use, holds.poses);
      Eigen::MatrixXd targets;
      if (holds.targets) targets = targetsFrom(equationsOf(use, analysisOf(shapes)), *holds.targets);
      for (const std::size_t take : judges) {
        predicted[fold] += weighted(movesOf(takes_[take], shapes, targets)).squaredNorm();
        captured[fold] += weighted(capturedOf(takes_[take])).squaredNorm();
      }
    });
    return gainFor(std::accumulate(predicted.begin(), predicted.end(), 0.0),
                   std::accumulate(captured.begin(), captured.end(), 0.0));
  }

  static Eigen::MatrixXd capturedOf(const ComparedTake& compared) { return compared.fit.displacements.cast<double>(); }
  [[nodiscard]] Eigen::MatrixXd weighted(const Eigen::MatrixXd& moves) const {
    return moves * columns_.weights.asDiagonal();
  }

  void addTargets(const Eigen::MatrixXd& targets, TrajectoryModel& model) const {
    Eigen::VectorXd heard = Eigen::VectorXd::Ones(model.componentCount());
    if (!model.networks.empty()) heard -= model.network_share.transpose();
    for (Eigen::Index feature = 0; feature < targets.rows(); ++feature) {
      auto& target = model.targets[features_->name(feature)];
      if (target.size() == 0) target = Eigen::VectorXd::Zero(heard.size());
      target += targets.row(feature).transpose().cwiseQuotient(heard);
    }
  }

  const Corpus& own_;
  std::size_t jobs_;
  Placing placing_;
  SpeechColumns columns_;
  TrajectoryModel base_;
  std::optional<SegmentFeatures> features_;
  std::vector<ComponentDynamics> dynamics_;  ///< the different ones
  std::vector<std::size_t> dynamics_of_;     ///< of each component
  std::vector<ComparedTake> takes_;
  Takes all_;
};

/// Without motion and sound, but with their rates.
CorpusTake lightTake(const CorpusTake& take, std::string name) {
  return {
      std::move(name), take.text, take.labels, {take.motion.frame_rate_hz, {}, {}}, {take.audio.sample_rate_hz, {}}};
}

/// The person's every fourth take judges what the others made of the rest.
TrajectoryFit judgedFit(const Adapting& adapting, const Holds& holds) {
  TrajectoryFit fit{adapting.modelFrom(adapting.all(), holds), nullptr, {}, {}};
  if (adapting.all().size() < 2) return fit;
  Adapting::Takes use;
  for (const std::size_t take : adapting.all()) {
    if (take % kJudgesEvery != 0)
      use.push_back(take);
    else
      fit.judges.push_back(adapting.indexOf(take));
  }
  fit.judging = adapting.modelFrom(use, holds);
  return fit;
}

}  // namespace

Corpus adaptCorpus(const Corpus& large, const Corpus& own, std::size_t jobs) {
  if (large.trajectory_model == nullptr)
    throw InputError(large.name, "", "has no trajectory model; expected a corpus that `corpus build` made");
  if (jobs == 0) jobs = defaultThreadCount();
  const Adapting adapting(large, own, jobs);
  const Holds holds = adapting.chooseHolds();
  const TrajectoryFit fit = judgedFit(adapting, holds);

  Corpus adapted;
  adapted.name = own.name;
  adapted.layout = own.layout;
  adapted.neutral_pose_mm = own.neutral_pose_mm;
  adapted.build_log = own.build_log;
  for (const char* key : {kTakeReportsKey, "sound_model", "motion_settings"}) adapted.build_log.erase(key);
  adapted.build_log["built_with"] = "corpus adapt";
  for (const CorpusTake& take : own.takes) adapted.takes.push_back(lightTake(take, take.name));
  for (const CorpusTake& take : large.takes)
    adapted.takes.push_back(lightTake(take, isAdapted(take) ? take.name : large.name + "/" + take.name));
  adapted.take_source = std::make_shared<AdaptedMotion>(large, own, adapting.placing(), adapting.base(), *fit.model);
  adapted.lattice_weights = large.lattice_weights;
  adapted.sound_cut_weights = own.sound_cut_weights;
  adapted.motion_settings = large.motion_settings;
  learnSettings(adapted, fit, adapting.all().size(), jobs);
  adapted.viseme_poses = visemePosesOf(adapted);
  adapted.build_log["adapted"] = fmt::format(
      "{} own takes, {} of {} at {:.3f} of their size; poses held by {}, {}, {} takes (across, up, out), own targets "
      "{}",
      own.takes.size(), large.takes.size(), large.name, adapting.placing().scale(), holds.poses[0], holds.poses[1],
      holds.poses[2], holds.targets ? fmt::format("held by {}", *holds.targets) : "none");
  return adapted;
}

}  // namespace mouthpiece
