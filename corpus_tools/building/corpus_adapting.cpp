#include "corpus_tools/building/corpus_adapting.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <optional>

#include "base/errors.h"
#include "base/parallel_for.h"
#include "corpus_tools/building/build_state.h"
#include "corpus_tools/building/settings_fit.h"
#include "corpus_tools/building/trajectory_design.h"
#include "corpus_tools/building/trajectory_fit.h"
#include "corpus_tools/takes/pose_fit.h"

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

/// Another's markers in the person's order, size and axes.
class Placing {
 public:
  Placing(const Corpus& large, const Corpus& own) {
    const std::vector<std::string> names = large.layout.markerNames();
    for (const std::string& name : own.layout.markerNames()) {
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end() || names.size() != own.layout.markers.size())
        throw InputError(large.name, found == names.end() ? name : "",
                         fmt::format("has {} markers, {} has {}; expected the same ones", names.size(), own.name,
                                     own.layout.markers.size()));
      sources_.push_back(unsignedIndex(found - names.begin()));
    }
    const auto fit = fitPose(pickMarkers(large.neutral_pose_mm, sources_), own.neutral_pose_mm, PoseScale::kFree);
    if (!fit) throw InputError(large.name, "neutral pose", "cannot be laid over that of " + own.name);
    scale_ = fit->scale;
    turn_ = scale_ * fit->target_from_source.rotation.transpose();
  }

  /// Rows of displacements, 3 * markers wide.
  template <typename Rows>
  [[nodiscard]] Eigen::MatrixXd operator()(const Eigen::MatrixBase<Rows>& rows) const {
    Eigen::MatrixXd placed(rows.rows(), rows.cols());
    for (std::size_t i = 0; i < sources_.size(); ++i)
      placed.middleCols(signedIndex(3 * i), 3) = rows.middleCols(signedIndex(3 * sources_[i]), 3) * turn_;
    return placed;
  }
  [[nodiscard]] double scale() const { return scale_; }

 private:
  std::vector<std::size_t> sources_;  ///< the other's marker for each of the person's
  Eigen::Matrix3d turn_;              ///< on rows, with the size
  double scale_ = 1;
};

/// How far the person's own takes are held back: `poses` in takes that say the same as the other, `targets` as
/// TrajectoryFitOptions::ridge; none: no own targets.
struct Holds {
  double poses = kUntriedHold;
  std::optional<double> targets;
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
    std::vector<std::array<double, kPoseHolds.size()>> by_poses(folds);
    parallelFor(folds, jobs_, [&](std::size_t fold) {
      const auto [use, judges] = split(folds, fold);
      for (std::size_t i = 0; i < kPoseHolds.size(); ++i)
        by_poses[fold][i] = errorOn(judges, shapesFrom(use, kPoseHolds[i]), {});
    });
    best.poses = kPoseHolds[leastOf(by_poses).first];
    std::vector<std::array<double, kTargetHolds.size()>> by_targets(folds);
    std::vector<std::array<double, 1>> without(folds);
    parallelFor(folds, jobs_, [&](std::size_t fold) {
      const auto [use, judges] = split(folds, fold);
      const Eigen::MatrixXd shapes = shapesFrom(use, best.poses);
      without[fold][0] = errorOn(judges, shapes, {});
      const std::vector<NormalEquations> equations = equationsOf(use, analysisOf(shapes));
      for (std::size_t i = 0; i < kTargetHolds.size(); ++i)
        by_targets[fold][i] = errorOn(judges, shapes, targetsFrom(equations, kTargetHolds[i]));
    });
    const auto [least, error] = leastOf(by_targets);
    if (error < leastOf(without).second) best.targets = kTargetHolds[least];
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
  [[nodiscard]] Eigen::MatrixXd shapesFrom(const Takes& use, double hold) const {
    const Eigen::Index components = base_.componentCount();
    Eigen::MatrixXd own = Eigen::MatrixXd::Zero(components, components);
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(components, base_.columnCount());
    for (const std::size_t take : use) {
      const ComparedTake& compared = takes_[take];
      own += compared.predicted.transpose() * compared.predicted;
      both += compared.predicted.transpose() * compared.fit.displacements.cast<double>();
    }
    const double held = hold * std::max(1e-9, own.trace() / asReal(components) / std::max(1.0, asReal(use.size())));
    own.diagonal().array() += held;
    Eigen::MatrixXd shapes = own.ldlt().solve(both + held * base_.shapes);
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
    return products.ldlt().solve(weighted.transpose()).transpose();
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

  [[nodiscard]] double errorOn(const Takes& judges, const Eigen::MatrixXd& shapes,
                               const Eigen::MatrixXd& targets) const {
    double error = 0;
    for (const std::size_t take : judges) {
      const ComparedTake& compared = takes_[take];
      Eigen::MatrixXd values = compared.predicted;
      for (std::size_t c = 0; targets.size() > 0 && c < dynamics_of_.size(); ++c) {
        const auto column = signedIndex(c);
        values.col(column) += compared.design[dynamics_of_[c]].times(targets.col(column));
      }
      const Eigen::MatrixXd missed = values * shapes - compared.fit.displacements.cast<double>();
      error += (missed * columns_.weights.asDiagonal()).squaredNorm();
    }
    return error;
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

/// The person's takes, then the other's as the person would have moved.
class AdaptedMotion final : public MotionSource {
 public:
  AdaptedMotion(const Corpus& large, const Corpus& own, const Placing& placing, const TrajectoryModel& base,
                const TrajectoryModel& model)
      : large_(large),
        own_(own),
        placing_(placing),
        change_(model.shapes - base.shapes),
        shift_((model.level - base.level) * model.shapes) {}

  [[nodiscard]] MotionClip load(TakeIndex take) const override {
    if (take.value < own_.takes.size()) return motionOf(own_, take);
    const TakeIndex theirs(take.value - own_.takes.size());
    const MotionClip motion = motionOf(large_, theirs);
    const Eigen::Map<const Eigen::RowVectorXd> their_neutral(large_.neutral_pose_mm.data(),
                                                             large_.neutral_pose_mm.size());
    const Eigen::Map<const Eigen::RowVectorXd> own_neutral(own_.neutral_pose_mm.data(), own_.neutral_pose_mm.size());
    const Eigen::MatrixXd displacements = motion.positions_mm.rowwise() - their_neutral;
    const Eigen::MatrixXd moves = valuesOf(displacements, motion, large_.takes[theirs.value].labels) * change_;
    MotionClip mapped{motion.frame_rate_hz, own_.layout.markerNames(), placing_(displacements) + moves};
    mapped.positions_mm.rowwise() += own_neutral + shift_;
    roundToFile(mapped);
    return mapped;
  }

  [[nodiscard]] AudioClip loadAudio(TakeIndex take) const override {
    if (take.value >= own_.takes.size()) return {large_.takes[take.value - own_.takes.size()].audio.sample_rate_hz, {}};
    return own_.motion_source != nullptr ? own_.motion_source->loadAudio(take) : own_.takes[take.value].audio;
  }

 private:
  /// As captured; as predicted where a speaking marker was not seen.
  [[nodiscard]] Eigen::MatrixXd valuesOf(const Eigen::MatrixXd& displacements, const MotionClip& motion,
                                         const SpeechLabels& labels) const {
    const TrajectoryModel& model = *large_.trajectory_model;
    Eigen::MatrixXd values = displacements.array().isFinite().select(displacements, 0.0) * model.analysis;
    const auto speaks = (model.analysis.array() != 0).rowwise().any().eval();
    std::vector<Seconds> times;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      if ((displacements.row(row).transpose().array().isFinite() || !speaks).all()) continue;
      rows.push_back(row);
      times.push_back(asReal(row) / motion.frame_rate_hz);
    }
    if (!rows.empty()) values(rows, Eigen::all) = model.predict(labels, times);
    return values;
  }

  const Corpus &large_, &own_;
  Placing placing_;
  Eigen::MatrixXd change_;    ///< of the shapes, from the other's, placed
  Eigen::RowVectorXd shift_;  ///< of the level
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
  adapted.motion_source = std::make_shared<AdaptedMotion>(large, own, adapting.placing(), adapting.base(), *fit.model);
  adapted.lattice_weights = large.lattice_weights;
  adapted.sound_cut_weights = own.sound_cut_weights;
  adapted.motion_settings = large.motion_settings;
  learnSettings(adapted, fit, adapting.all().size(), jobs);
  adapted.viseme_poses = visemePosesOf(adapted);
  adapted.build_log["adapted"] =
      fmt::format("{} own takes, {} of {} at {:.3f} of their size; poses held by {} takes, own targets {}",
                  own.takes.size(), large.takes.size(), large.name, adapting.placing().scale(), holds.poses,
                  holds.targets ? fmt::format("held by {}", *holds.targets) : "none");
  return adapted;
}

}  // namespace mouthpiece
