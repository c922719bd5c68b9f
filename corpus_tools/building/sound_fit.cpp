#include "corpus_tools/building/prediction_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/index.h"
#include "base/matrix_solvers.h"
#include "base/parallel_for.h"
#include "base/statistics.h"

namespace mouthpiece {
namespace {

constexpr double kHeldShare = 0.1, kHeldFrames = 300;  ///< ridge: a share of the frames, and so many more
constexpr double kHeldPhone = 25;  ///< rows of 10 ms at the mean that a phone's expected sound is drawn to
constexpr std::size_t kLeastSounds = 12;

AudioClip soundOfTake(const Corpus& corpus, std::size_t take) {
  return corpus.take_source != nullptr ? corpus.take_source->loadAudio(TakeIndex(take)) : corpus.takes[take].audio;
}

/// How each phone sounds on average.
Eigen::MatrixXd expectedSounds(const Corpus& corpus, const std::vector<SoundTake>& takes,
                               const std::vector<SoundMeasures>& measures) {
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(kPhoneCount, kSoundMeasures);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(kPhoneCount);
  for (std::size_t i = 0; i < takes.size(); ++i) {
    for (const LabelledPhone& phone : corpus.takes[takes[i].index].labels.phones) {
      const auto rowFrom = [&](Seconds time) {
        const auto row = static_cast<Eigen::Index>(std::ceil(time / SoundMeasures::kStep));
        return std::clamp<Eigen::Index>(row, 0, measures[i].rows.rows());
      };
      const Eigen::Index first = rowFrom(phone.span.start), end = rowFrom(phone.span.end);
      const auto own = static_cast<Eigen::Index>(phone.phone);
      if (end > first) sums.row(own) += measures[i].rows.middleRows(first, end - first).colwise().sum();
      counts(own) += asReal(std::max<Eigen::Index>(0, end - first));
    }
  }
  const Eigen::RowVectorXd mean = sums.colwise().sum() / std::max(1.0, counts.sum());
  sums.rowwise() += kHeldPhone * mean;
  return (counts.array() + kHeldPhone).inverse().matrix().asDiagonal() * sums;
}

/// The least-squares problem of some takes, sums only.
struct Sums {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(kSoundFeatures, kSoundFeatures);
  Eigen::MatrixXd right;
  double frames = 0;

  void add(const Sums& other, double sign = 1) {
    normal += sign * other.normal;
    right += sign * other.right;
    frames += sign * other.frames;
  }
  [[nodiscard]] Eigen::MatrixXd solve() const {
    Eigen::MatrixXd held = normal;
    held.diagonal().array() += kHeldShare * frames + kHeldFrames;
    return solveSymmetric(std::move(held), right);
  }
};

Eigen::RowVectorXd quantileOfRows(const Eigen::MatrixXd& rows, double share) {
  Eigen::RowVectorXd result(rows.cols());
  for (Eigen::Index column = 0; column < rows.cols(); ++column)
    result(column) = quantile({rows.col(column).begin(), rows.col(column).end()}, share);
  return result;
}

}  // namespace

SoundFit fitSound(const Corpus& corpus, const std::vector<SoundTake>& takes, std::size_t parts, std::size_t jobs) {
  std::vector<SoundMeasures> measures(takes.size());
  parallelFor(takes.size(), jobs,
              [&](std::size_t i) { measures[i] = soundMeasures(soundOfTake(corpus, takes[i].index)); });
  const auto heard = std::count_if(measures.begin(), measures.end(), [](const auto& m) { return m.rows.rows() > 0; });
  if (unsignedIndex(heard) < kLeastSounds) return {};

  SoundFit fit;
  SoundModel& model = fit.model;
  model.expected = expectedSounds(corpus, takes, measures);
  std::vector<SoundDeviations> deviations;
  Eigen::MatrixXd spreads(heard, kSoundMeasures);
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < takes.size(); ++i) {
    if (measures[i].rows.rows() == 0) continue;
    deviations.emplace_back(measures[i], corpus.takes[takes[i].index].labels, model.expected);
    spreads.row(signedIndex(numbers.size())) = deviations.back().spreadInSpeech();
    numbers.push_back(i);
  }
  constexpr double kLeastSpread = 1e-3, kMostTakes = 0.9;
  model.spread = spreads.cwiseAbs2().colwise().mean().cwiseSqrt().cwiseMax(kLeastSpread);
  model.widest_spread = quantileOfRows(spreads, kMostTakes).cwiseMax(kLeastSpread);

  const Eigen::Index components = takes.front().residual.cols();
  std::vector<Sums> sums(parts);
  for (Sums& part : sums) part.right = Eigen::MatrixXd::Zero(kSoundFeatures, components);
  const Eigen::RowVectorXd scale = model.spread.cwiseInverse();
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const SoundTake& take = takes[numbers[i]];
    Eigen::MatrixXd features = deviations[i].featuresAt(take.times, scale);
    features.rowwise() -= take.seen.transpose() * features / std::max(1.0, take.seen.sum());
    const Eigen::MatrixXd seen = take.seen.asDiagonal() * features;
    Sums& own = sums[take.part];
    own.normal += seen.transpose() * features;
    own.right += seen.transpose() * take.residual;
    own.frames += take.seen.sum();
  }
  Sums all = sums.front();
  for (std::size_t part = 1; part < parts; ++part) all.add(sums[part]);

  // How far the parts left out bear it: least squares of their residual along what is predicted.
  Eigen::RowVectorXd along = Eigen::RowVectorXd::Zero(components), length = along;
  for (const Sums& part : sums) {
    Sums others = all;
    others.add(part, -1);
    const Eigen::MatrixXd weights = others.solve();
    along += weights.cwiseProduct(part.right).colwise().sum();
    length += weights.cwiseProduct(part.normal * weights).colwise().sum();
  }
  const Eigen::RowVectorXd share = along.cwiseQuotient(length.cwiseMax(1e-12)).cwiseMax(0).cwiseMin(1);
  double squares = 0;
  for (const std::size_t i : numbers) squares += takes[i].residual.squaredNorm();
  const double gained = (2 * share.cwiseProduct(along) - share.cwiseAbs2().cwiseProduct(length)).sum();
  fit.account =
      fmt::format("{} takes; of the squared error that phones leave, the sound takes {:.1f} % on takes left out", heard,
                  100 * gained / std::max(squares, 1e-12));
  model.weights = all.solve() * share.asDiagonal();
  if (!(share.maxCoeff() > 0)) model = {};
  return fit;
}

}  // namespace mouthpiece
