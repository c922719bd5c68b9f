#include "hearing/alignment/speaker_adaptation.h"

#include <algorithm>
#include <cmath>

#include "base/index.h"

namespace mouthpiece {
namespace {

/// Frames that a phone's common shift, a density's own mean and its weight are held back by.
constexpr double kHeldShift = 40, kHeldMean = 12, kHeldWeight = 40;
constexpr int kSpeakerRounds = 2;
/// A weight is multiplied by at most this, or divided.
constexpr double kMostTimes = 8;

/// What was heard of the densities of one codebook in one stream.
struct Heard {
  Eigen::VectorXd counts;
  Eigen::MatrixXd sums;  ///< of what is beyond the density's mean, a column a density
};

/// The frames of a codebook in all sounds, side by side.
Eigen::MatrixXf framesOf(std::span<const SpeakerFrames> heard, std::size_t codebook) {
  Eigen::Index count = 0;
  for (const SpeakerFrames& sound : heard) count += std::count(sound.codebook.begin(), sound.codebook.end(), codebook);
  Eigen::MatrixXf frames(heard.front().features.rows(), count);
  Eigen::Index next = 0;
  for (const SpeakerFrames& sound : heard) {
    for (std::size_t t = 0; t < sound.codebook.size(); ++t) {
      if (sound.codebook[t] == codebook) frames.col(next++) = sound.features.col(signedIndex(t));
    }
  }
  return frames;
}

Eigen::MatrixXf logLikelihoods(const Eigen::MatrixXf& rows, const Eigen::MatrixXf& frames) {
  const Eigen::Index size = frames.rows();
  Eigen::MatrixXf terms(2 * size + 1, frames.cols());
  terms << frames.cwiseAbs2(), frames, Eigen::RowVectorXf::Ones(frames.cols());
  return rows * terms;
}

Heard hearStream(const Eigen::MatrixXf& rows, const Densities& densities, const Eigen::VectorXd& weights,
                 const Eigen::MatrixXf& frames) {
  Eigen::MatrixXf likely = logLikelihoods(rows, frames);
  likely.colwise() += weights.array().max(1e-12).log().matrix().cast<float>();
  likely.rowwise() -= likely.colwise().maxCoeff();
  Eigen::MatrixXd share = likely.array().exp().matrix().cast<double>();
  share.array().rowwise() /= share.colwise().sum().array();
  Heard heard;
  heard.counts = share.rowwise().sum();
  heard.sums = frames.cast<double>() * share.transpose() - densities.means * heard.counts.asDiagonal();
  return heard;
}

void adaptStream(TiedModel::Codebook& codebook, std::size_t stream, const Eigen::MatrixXf& frames) {
  Eigen::MatrixXf& rows = codebook.gaussians[stream];
  const Densities plain = densitiesOf(rows);
  const Eigen::VectorXd sums = codebook.weights[stream].cast<double>().colwise().sum();
  const Eigen::VectorXd weights = sums / std::max(sums.sum(), 1e-12);
  Heard heard;
  Densities own = plain;
  for (int round = 0; round < kSpeakerRounds; ++round) {
    heard = hearStream(rows, plain, weights, frames);
    const Eigen::VectorXd shift = heard.sums.rowwise().sum() / (heard.counts.sum() + kHeldShift);
    for (Eigen::Index i = 0; i < plain.means.cols(); ++i) {
      own.means.col(i) = plain.means.col(i) + (heard.sums.col(i) + kHeldMean * shift) / (heard.counts(i) + kHeldMean);
      rows.row(i) = densityRow(own.means.col(i), plain.variances.col(i));
    }
  }
  const double total = heard.counts.sum();
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    const double usual = std::max(weights(i), 1e-12);
    const double share = (heard.counts(i) + kHeldWeight * usual) / (total + kHeldWeight);
    codebook.weights[stream].col(i) *= asFloat(std::clamp(share / usual, 1 / kMostTimes, kMostTimes));
  }
}

}  // namespace

TiedModel adaptedToSpeaker(const TiedModel& model, std::span<const SpeakerFrames> heard) {
  TiedModel adapted = model;
  for (const SpeakerFrames& sound : heard) {
    if (sound.features.rows() != model.featureCount()) return model;
  }
  if (heard.empty()) return model;
  for (std::size_t i = 0; i < adapted.codebooks.size(); ++i) {
    const Eigen::MatrixXf frames = framesOf(heard, i);
    if (frames.cols() == 0) continue;
    Eigen::Index row = 0;
    for (std::size_t stream = 0; stream < model.stream_sizes.size(); ++stream) {
      adaptStream(adapted.codebooks[i], stream, frames.middleRows(row, model.stream_sizes[stream]));
      row += model.stream_sizes[stream];
    }
  }
  return adapted;
}

double fitOf(const TiedModel& model, const Eigen::MatrixXf& features) {
  const Eigen::MatrixXf frames = features.topRows(model.stream_sizes.front());
  Eigen::RowVectorXf best = Eigen::RowVectorXf::Constant(frames.cols(), -1e30F);
  for (const TiedModel::Codebook& codebook : model.codebooks)
    best = best.cwiseMax(logLikelihoods(codebook.gaussians.front(), frames).colwise().maxCoeff());
  return frames.cols() > 0 ? static_cast<double>(best.mean()) : 0.0;
}

}  // namespace mouthpiece
