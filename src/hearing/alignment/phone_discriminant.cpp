#include "hearing/alignment/phone_discriminant.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/errors.h"
#include "base/index.h"
#include "base/matrix_solvers.h"

namespace mouthpiece {
namespace {

/// Frames around a frame that tell of its phone, up to 120 ms away.
constexpr std::array<Eigen::Index, 7> kAround{-PhoneDiscriminant::kFarthest, -8, -4, 0, 4, 8,
                                              PhoneDiscriminant::kFarthest};
/// Parts of phones of fewer frames tell nothing.
constexpr double kLeastFrames = 20;
/// So much more spread than is seen is taken to be there: of what is not in the takes.
constexpr double kHeldSpread = 0.3, kLeastSpread = 1e-6;
/// Directions that are kept, and of these so many, the first ones, are multiplied with each other.
constexpr Eigen::Index kDirections = 60, kMultiplied = 40;
/// Frames are alike, so that each counts by this power; what is known then counts so much beside the acoustic model,
/// up to e to the last.
constexpr float kAlike = 0.3F, kKnownWeight = 0.4F, kMostKnown = 6;

/// Each column with those around it below it; beyond the ends the last one stands.
Eigen::MatrixXf stacked(const Eigen::MatrixXf& features) {
  const Eigen::Index rows = features.rows(), frames = features.cols();
  Eigen::MatrixXf all(rows * std::ssize(kAround), frames);
  for (Eigen::Index t = 0; t < frames; ++t) {
    for (std::size_t i = 0; i < kAround.size(); ++i)
      all.col(t).segment(signedIndex(i) * rows, rows) =
          features.col(std::clamp<Eigen::Index>(t + kAround[i], 0, frames - 1));
  }
  return all;
}

/// Directions, and the products of the first ones with each other.
Eigen::MatrixXf withProducts(const Eigen::MatrixXf& directions) {
  const Eigen::Index rows = directions.rows(), few = std::min(rows, kMultiplied);
  Eigen::MatrixXf all(rows + few * (few + 1) / 2, directions.cols());
  all.topRows(rows) = directions;
  Eigen::Index next = rows;
  for (Eigen::Index i = 0; i < few; ++i) {
    for (Eigen::Index k = 0; k <= i; ++k) all.row(next++) = directions.row(i).cwiseProduct(directions.row(k));
  }
  return all;
}

/// Of each frame the part of its phone that it stands in, as rows of logRatios(); -1: not known.
std::vector<Eigen::Index> rowsOf(const SpeakerFrames& sound, std::size_t codebooks) {
  std::vector<Eigen::Index> rows(sound.codebook.size(), -1);
  for (std::size_t first = 0; first < rows.size();) {
    std::size_t end = first;
    while (end < rows.size() && sound.codebook[end] == sound.codebook[first]) ++end;
    if (sound.codebook[first] != SpeakerFrames::kNoCodebook) {
      for (std::size_t t = first; t < end; ++t) {
        const std::size_t part = PhoneDiscriminant::kParts * (t - first) / (end - first);
        rows[t] = signedIndex(part * codebooks + sound.codebook[first]);
      }
    }
    first = end;
  }
  return rows;
}

/// Frames of classes: their means, a column a class, and how they are spread around them.
struct Spread {
  Eigen::MatrixXd means, within;
  Eigen::VectorXd shares;  ///< of the classes
};

Spread spreadOf(Eigen::MatrixXf frames, const std::vector<Eigen::Index>& classes, Eigen::Index count) {
  Spread spread{Eigen::MatrixXd::Zero(frames.rows(), count), {}, Eigen::VectorXd::Zero(count)};
  for (std::size_t t = 0; t < classes.size(); ++t) {
    spread.means.col(classes[t]) += frames.col(signedIndex(t)).cast<double>();
    spread.shares(classes[t]) += 1;
  }
  const double total = asReal(classes.size());
  spread.means.array().rowwise() /= spread.shares.transpose().array();
  for (std::size_t t = 0; t < classes.size(); ++t)
    frames.col(signedIndex(t)) -= spread.means.col(classes[t]).cast<float>();
  Eigen::MatrixXf squares = Eigen::MatrixXf::Zero(frames.rows(), frames.rows());
  squares.selfadjointView<Eigen::Lower>().rankUpdate(frames);
  squares = squares.selfadjointView<Eigen::Lower>();
  spread.within = squares.cast<double>() / total;
  spread.within.diagonal() *= 1 + kHeldSpread;
  spread.within.diagonal().array() += kLeastSpread;
  spread.shares /= total;
  return spread;
}

}  // namespace

std::vector<Eigen::Index> PhoneDiscriminant::chooseRows(const std::vector<std::vector<Eigen::Index>>& rows) {
  std::vector<double> counts(unsignedIndex(row_count_), 0);
  for (const std::vector<Eigen::Index>& sound : rows) {
    for (const Eigen::Index row : sound) {
      if (row >= 0) ++counts[unsignedIndex(row)];
    }
  }
  std::vector<Eigen::Index> class_of(counts.size(), -1);
  for (std::size_t row = 0; row < counts.size(); ++row) {
    if (counts[row] < kLeastFrames) continue;
    class_of[row] = std::ssize(rows_);
    rows_.push_back(signedIndex(row));
  }
  return class_of;
}

PhoneDiscriminant::PhoneDiscriminant(std::span<const SpeakerFrames> heard, std::size_t codebooks)
    : row_count_(kParts * signedIndex(codebooks)) {
  std::vector<std::vector<Eigen::Index>> rows;
  for (const SpeakerFrames& sound : heard) rows.push_back(rowsOf(sound, codebooks));
  const std::vector<Eigen::Index> class_of = chooseRows(rows);
  if (rows_.size() < 2) return;
  std::vector<Eigen::Index> classes;
  Eigen::MatrixXf frames;
  for (std::size_t i = 0; i < heard.size(); ++i) {
    const Eigen::MatrixXf own = stacked(heard[i].features);
    frames.conservativeResize(own.rows(), frames.cols() + own.cols());
    for (std::size_t t = 0; t < rows[i].size(); ++t) {
      if (rows[i][t] < 0 || class_of[unsignedIndex(rows[i][t])] < 0) continue;
      frames.col(std::ssize(classes)) = own.col(signedIndex(t));
      classes.push_back(class_of[unsignedIndex(rows[i][t])]);
    }
    frames.conservativeResize(Eigen::NoChange, std::ssize(classes));
  }
  const Eigen::Index count = std::ssize(rows_);
  // Fisher's directions: where the means lie far apart for how the frames are spread around them.
  const Spread raw = spreadOf(frames, classes, count);
  const Eigen::LLT<Eigen::MatrixXd> root(raw.within);
  const Eigen::VectorXd centre = raw.means * raw.shares;
  Eigen::MatrixXd apart = raw.means.colwise() - centre;
  root.matrixL().solveInPlace(apart);
  const Eigen::MatrixXd between = symmetricEigen(apart * raw.shares.asDiagonal() * apart.transpose()).vectors;
  const Eigen::Index kept = std::min({kDirections, count - 1, frames.rows()});
  Eigen::MatrixXd directions = between.rightCols(kept).rowwise().reverse();
  root.matrixU().solveInPlace(directions);
  projection_ = directions.transpose().cast<float>();
  offset_ = -(directions.transpose() * centre).cast<float>();
  class_means_ = (projection_ * raw.means.cast<float>()).colwise() + offset_;
  learnt_from_ = (projection_ * frames).colwise() + offset_;
  usual_distance_ = distanceOf(learnt_from_);
  learnt_classes_ = std::move(classes);
}

void PhoneDiscriminant::learnRatios() {
  if (learnt_classes_.empty()) return;
  const Spread own =
      spreadOf(withProducts(std::exchange(learnt_from_, {})), std::exchange(learnt_classes_, {}), std::ssize(rows_));
  const Eigen::LLT<Eigen::MatrixXd> metric(own.within);
  const Eigen::MatrixXd slopes = metric.solve(own.means);
  slopes_ = slopes.transpose().cast<float>();
  constants_ = (-0.5 * own.means.cwiseProduct(slopes).colwise().sum().transpose()).cast<float>();
  log_priors_ = own.shares.array().log().matrix().cast<float>();
}

double PhoneDiscriminant::distanceOf(const Eigen::MatrixXf& directions) const {
  double sum = 0;
  for (Eigen::Index t = 0; t < directions.cols(); ++t)
    sum += double{(class_means_.colwise() - directions.col(t)).colwise().squaredNorm().minCoeff()};
  return sum / asReal(directions.cols());
}

double PhoneDiscriminant::strangenessOf(const Eigen::MatrixXf& features) const {
  if (isEmpty() || features.cols() == 0) return 1;
  return distanceOf((projection_ * stacked(features)).colwise() + offset_) / usual_distance_;
}

Eigen::MatrixXf PhoneDiscriminant::logRatios(const Eigen::MatrixXf& features) const {
  Eigen::MatrixXf ratios = Eigen::MatrixXf::Zero(row_count_, features.cols());
  if (isEmpty() || features.cols() == 0) return ratios;
  MOUTHPIECE_EXPECT(learnt_classes_.empty());
  const Eigen::MatrixXf directions = withProducts((projection_ * stacked(features)).colwise() + offset_);
  const Eigen::MatrixXf odds = kAlike * ((slopes_ * directions).colwise() + constants_);
  for (Eigen::Index t = 0; t < odds.cols(); ++t) {
    const Eigen::VectorXf own = odds.col(t) + log_priors_;
    const float best = own.maxCoeff();
    const float any = best + std::log((own.array() - best).exp().sum());
    for (std::size_t i = 0; i < rows_.size(); ++i)
      ratios(rows_[i], t) = kKnownWeight * std::clamp(odds(signedIndex(i), t) - any, -kMostKnown, kMostKnown);
  }
  return ratios;
}

}  // namespace mouthpiece
