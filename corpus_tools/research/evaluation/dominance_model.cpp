// DominanceModel of evaluation_methods.h.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/errors.h"
#include "base/matrix_solvers.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"

namespace mouthpiece {
namespace {

/// Enough takes to tell one setting from another; targets come from all.
constexpr std::size_t kTrainingTakes = 48;
constexpr std::array<double, 3> kPowers = {1.0, 1.5, 2.0};
/// D falls to 1/e this far from the phone's middle.
constexpr std::array<Seconds, 6> kReaches = {0.03, 0.045, 0.065, 0.09, 0.12, 0.16};
constexpr std::array<double, 4> kSteps = {2.5, 0.4, 1.4, 0.7};  ///< by which a parameter of a phone is multiplied
constexpr int kRounds = 2;
constexpr double kHeldBack = 2;  ///< frames at the mean pose that each target is drawn to

/// A take's seen frames: times, and poses less the mean pose.
struct DominanceTake {
  const SpeechLabels* labels = nullptr;
  std::vector<Seconds> times;
  Eigen::MatrixXd poses;
};

std::vector<DominanceTake> dominanceTakes(const Corpus& corpus, const Eigen::RowVectorXd& mean, std::size_t every) {
  std::vector<DominanceTake> takes;
  for (std::size_t i = 0; i < corpus.takes.size(); i += every) {
    const CorpusTake& take = corpus.takes[i];
    DominanceTake& own = takes.emplace_back();
    own.labels = &take.labels;
    std::vector<Eigen::Index> seen;
    for (Eigen::Index frame = 0; frame < take.motion.positions_mm.rows(); ++frame) {
      if (!take.motion.positions_mm.row(frame).allFinite()) continue;
      seen.push_back(frame);
      own.times.push_back(asReal(frame) / take.motion.frame_rate_hz);
    }
    own.poses = take.motion.positions_mm(seen, Eigen::all).rowwise() - mean;
  }
  return takes;
}

Eigen::RowVectorXd meanPoseOf(const Corpus& corpus) {
  Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(signedIndex(3 * corpus.layout.markers.size()));
  double frames = 0;
  for (const CorpusTake& take : corpus.takes) {
    for (const auto& row : take.motion.positions_mm.rowwise()) {
      if (!row.allFinite()) continue;
      sum += row;
      frames += 1;
    }
  }
  return sum / std::max(1.0, frames);
}

std::vector<Eigen::Index> lipColumnsOf(const MarkerLayout& layout) {
  std::vector<Eigen::Index> columns;
  for (std::size_t marker = 0; marker < layout.markers.size(); ++marker) {
    if (layout.markers[marker].region != "lip") continue;
    for (Eigen::Index axis = 0; axis < 3; ++axis) columns.push_back(signedIndex(3 * marker) + axis);
  }
  return columns;
}

}  // namespace

Eigen::VectorXd DominanceModel::dominanceOf(Phone phone, const PhoneParameters& own, const SpeechLabels& labels,
                                            std::span<const Seconds> times) const {
  constexpr double kLeast = 1e-12;
  // Far from every phone all dominances underflow; the mouth rests there.
  Eigen::VectorXd dominance = Eigen::VectorXd::Constant(std::ssize(times), phone == Phone::kSil ? kLeast : 0);
  for (const LabelledPhone& said : labels.phones) {
    if (said.phone != phone) continue;
    // A long silence holds its target to its edge; a middle alone would let go of it.
    const Seconds from = phone == Phone::kSil ? said.span.start : said.span.middle();
    const Seconds to = phone == Phone::kSil ? said.span.end : said.span.middle();
    for (std::size_t row = 0; row < times.size(); ++row) {
      const Seconds before = from - times[row], away = std::max({0.0, before, times[row] - to});
      const double rate = before > 0 ? own.rate_before : own.rate_after;
      dominance[signedIndex(row)] += own.magnitude * std::exp(-rate * std::pow(away, power_));
    }
  }
  return dominance;
}

Eigen::MatrixXd DominanceModel::dominancesOf(const SpeechLabels& labels, std::span<const Seconds> times) const {
  Eigen::MatrixXd all(std::ssize(times), kPhoneCount);
  for (std::size_t phone = 0; phone < kPhoneCount; ++phone)
    all.col(signedIndex(phone)) = dominanceOf(static_cast<Phone>(phone), parameters_[phone], labels, times);
  return all;
}

Eigen::MatrixXd DominanceModel::sharesOf(const SpeechLabels& labels, std::span<const Seconds> times) const {
  const Eigen::MatrixXd dominances = dominancesOf(labels, times);
  return dominances.array().colwise() / dominances.rowwise().sum().array();
}

MotionClip DominanceModel::animate(const SpeechLabels& labels, double frame_rate_hz, std::size_t frames) const {
  MotionClip clip{frame_rate_hz, marker_names_, {}};
  std::vector<Seconds> times;
  for (std::size_t frame = 0; frame < frames; ++frame) times.push_back(clip.timeOf(FrameIndex(frame)));
  clip.positions_mm = (sharesOf(labels, times) * targets_).rowwise() + mean_;
  return clip;
}

namespace {

/// Targets with the least squared error: phones x columns.
Eigen::MatrixXd bestTargets(const DominanceModel& model, const std::vector<DominanceTake>& takes) {
  Eigen::MatrixXd normal = kHeldBack * Eigen::MatrixXd::Identity(kPhoneCount, kPhoneCount);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(kPhoneCount, takes.front().poses.cols());
  for (const DominanceTake& take : takes) {
    const Eigen::MatrixXd shares = model.sharesOf(*take.labels, take.times);
    normal += shares.transpose() * shares;
    right += shares.transpose() * take.poses;
  }
  return solveSymmetric(std::move(normal), right);
}

}  // namespace

/// What a model with given targets is off a take, told anew where one phone's parameters change.
class DominanceModel::Trial {
 public:
  Trial(const DominanceModel& model, const DominanceTake& take, const Eigen::MatrixXd& targets)
      : take_(take), targets_(targets), dominances_(model.dominancesOf(*take.labels, take.times)) {
    sum_ = dominances_.rowwise().sum();
    moved_ = dominances_ * targets;
  }

  [[nodiscard]] bool says(std::size_t phone) const {
    return std::any_of(take_.labels->phones.begin(), take_.labels->phones.end(),
                       [&](const LabelledPhone& said) { return static_cast<std::size_t>(said.phone) == phone; });
  }

  [[nodiscard]] double error() const { return errorWith(moved_, sum_); }

  /// The error of a model that differs in `phone` alone.
  [[nodiscard]] double errorOf(const DominanceModel& model, std::size_t phone) const {
    const Eigen::VectorXd more = moreOf(model, phone);
    return errorWith(moved_ + more * targets_.row(signedIndex(phone)), sum_ + more);
  }

  void take(const DominanceModel& model, std::size_t phone) {
    const Eigen::VectorXd more = moreOf(model, phone);
    moved_ += more * targets_.row(signedIndex(phone));
    sum_ += more;
    dominances_.col(signedIndex(phone)) += more;
  }

 private:
  [[nodiscard]] Eigen::VectorXd moreOf(const DominanceModel& model, std::size_t phone) const {
    return model.dominanceOf(static_cast<Phone>(phone), model.parameters_[phone], *take_.labels, take_.times) -
           dominances_.col(signedIndex(phone));
  }
  [[nodiscard]] double errorWith(const Eigen::MatrixXd& moved, const Eigen::VectorXd& sum) const {
    return ((moved.array().colwise() / sum.array()).matrix() - take_.poses).squaredNorm();
  }

  const DominanceTake& take_;
  const Eigen::MatrixXd& targets_;  ///< phones x columns
  Eigen::MatrixXd dominances_;      ///< times x phones
  Eigen::VectorXd sum_;
  Eigen::MatrixXd moved_;  ///< the dominances' targets, added up: times x columns
};

DominanceModel DominanceModel::fit(const Corpus& corpus) {
  MOUTHPIECE_EXPECT(!corpus.takes.empty());
  DominanceModel model;
  model.marker_names_ = corpus.layout.markerNames();
  model.mean_ = meanPoseOf(corpus);
  const std::vector<DominanceTake> all = dominanceTakes(corpus, model.mean_, 1);
  std::vector<DominanceTake> some =
      dominanceTakes(corpus, model.mean_, std::max<std::size_t>(1, corpus.takes.size() / kTrainingTakes));
  const std::vector<Eigen::Index> lips = lipColumnsOf(corpus.layout);
  for (DominanceTake& take : some) take.poses = take.poses(Eigen::all, lips).eval();

  double least = std::numeric_limits<double>::infinity();
  DominanceModel start = model;
  for (const double power : kPowers) {
    for (const Seconds reach : kReaches) {
      DominanceModel candidate = model;
      candidate.power_ = power;
      const double rate = std::pow(1 / reach, power);
      candidate.parameters_.fill({1, rate, rate});
      const Eigen::MatrixXd targets = bestTargets(candidate, some);
      double error = 0;
      for (const DominanceTake& take : some) error += Trial(candidate, take, targets).error();
      if (!(error < least)) continue;
      least = error;
      start = candidate;
    }
  }
  model = start;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::MatrixXd targets = bestTargets(model, some);
    std::vector<Trial> trials;
    for (const DominanceTake& take : some) trials.emplace_back(model, take, targets);
    for (std::size_t phone = 0; phone < kPhoneCount; ++phone) {
      std::vector<Trial*> concerned;
      for (Trial& trial : trials) {
        if (trial.says(phone)) concerned.push_back(&trial);
      }
      if (concerned.empty()) continue;
      const auto errorOf = [&](const DominanceModel& candidate) {
        double sum = 0;
        for (const Trial* trial : concerned) sum += trial->errorOf(candidate, phone);
        return sum;
      };
      double own = errorOf(model);
      for (const auto field :
           {&PhoneParameters::magnitude, &PhoneParameters::rate_before, &PhoneParameters::rate_after}) {
        for (const double factor : kSteps) {
          DominanceModel candidate = model;
          candidate.parameters_[phone].*field *= factor;
          const double error = errorOf(candidate);
          if (!(error < own)) continue;
          own = error;
          model = candidate;
        }
      }
      for (Trial* trial : concerned) trial->take(model, phone);
    }
  }
  model.targets_ = bestTargets(model, all);
  return model;
}

}  // namespace mouthpiece
