// DominanceModel of evaluation_methods.h.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"
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

Eigen::MatrixXd DominanceModel::sharesOf(const SpeechLabels& labels, std::span<const Seconds> times) const {
  Eigen::MatrixXd shares = Eigen::MatrixXd::Zero(std::ssize(times), kPhoneCount);
  constexpr double kLeast = 1e-12;
  for (std::size_t row = 0; row < times.size(); ++row) {
    const auto at = signedIndex(row);
    // Far from every phone all dominances underflow; the mouth rests there.
    shares(at, static_cast<Eigen::Index>(Phone::kSil)) = kLeast;
    for (const LabelledPhone& phone : labels.phones) {
      const PhoneParameters& own = parameters_[static_cast<std::size_t>(phone.phone)];
      // A long silence holds its target to its edge; a middle alone would let go of it.
      const Seconds before = (phone.phone == Phone::kSil ? phone.span.start : phone.span.middle()) - times[row];
      const Seconds after = times[row] - (phone.phone == Phone::kSil ? phone.span.end : phone.span.middle());
      const double rate = before > 0 ? own.rate_before : own.rate_after;
      const Seconds away = std::max({0.0, before, after});
      shares(at, static_cast<Eigen::Index>(phone.phone)) += own.magnitude * std::exp(-rate * std::pow(away, power_));
    }
  }
  return shares.array().colwise() / shares.rowwise().sum().array();
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
  return normal.ldlt().solve(right);
}

double errorOf(const DominanceModel& model, const std::vector<DominanceTake>& takes, const Eigen::MatrixXd& targets,
               std::size_t only) {
  double sum = 0;
  for (const DominanceTake& take : takes) {
    const auto& phones = take.labels->phones;
    const bool concerns = only == kPhoneCount || std::any_of(phones.begin(), phones.end(), [&](const LabelledPhone& p) {
                            return static_cast<std::size_t>(p.phone) == only;
                          });
    if (concerns) sum += (model.sharesOf(*take.labels, take.times) * targets - take.poses).squaredNorm();
  }
  return sum;
}

}  // namespace

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
      const double error = errorOf(candidate, some, bestTargets(candidate, some), kPhoneCount);
      if (!(error < least)) continue;
      least = error;
      start = candidate;
    }
  }
  model = start;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::MatrixXd targets = bestTargets(model, some);
    for (std::size_t phone = 0; phone < kPhoneCount; ++phone) {
      double own = errorOf(model, some, targets, phone);
      if (!(own > 0)) continue;  // nobody says it
      for (const auto field :
           {&PhoneParameters::magnitude, &PhoneParameters::rate_before, &PhoneParameters::rate_after}) {
        for (const double factor : kSteps) {
          DominanceModel candidate = model;
          candidate.parameters_[phone].*field *= factor;
          const double error = errorOf(candidate, some, targets, phone);
          if (!(error < own)) continue;
          own = error;
          model = candidate;
        }
      }
    }
  }
  model.targets_ = bestTargets(model, all);
  return model;
}

}  // namespace mouthpiece
