#include "hearing/alignment/acoustic_model.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/errors.h"
#include "base/index.h"

namespace mouthpiece {
namespace {

/// In a stream no density counts for less than this much under the best of its frame: a sound unlike all of the model's
/// cannot outweigh the rest (PocketSphinx' MAX_NEG_ASCR).
constexpr double kFloor = 96 * kScoreUnit;
constexpr Eigen::Index kBlock = 16;
constexpr std::int16_t kWorstScore = 3 * (96 + 255);
/// Of a song a frame stands for no more than this: 0.3 s are too long for any fleeting sound.
constexpr double kMostFrames = 30;
constexpr double kLargestScore = std::numeric_limits<std::int16_t>::max();

}  // namespace

SenoneScorer::SenoneScorer(std::shared_ptr<const TiedModel> model, bool portable_loops)
    : model_(std::move(model)), kernels_(portable_loops ? nullptr : senoneKernels()) {
  for (const TiedModel::Codebook& codebook : model_->codebooks)
    likelihoods_.emplace_back(signedIndex(codebook.senones.size()));
}

LikeliestDensities& SenoneScorer::likeliest(std::size_t codebook, std::size_t stream, Eigen::Index frame) {
  const std::size_t streams = model_->stream_sizes.size();
  return likeliest_[(unsignedIndex(frame) * streams + stream) * model_->codebooks.size() + codebook];
}

void SenoneScorer::findLikeliest(std::size_t stream, const Eigen::Ref<const Eigen::MatrixXf>& features) {
  const Eigen::Index size = features.rows(), frames = features.cols();
  Eigen::MatrixXf terms(2 * size + 1, frames);
  terms.topRows(size) = features.cwiseAbs2();
  terms.middleRows(size, size) = features;
  terms.bottomRows(1).setOnes();
  for (const std::size_t codebook : looked_at_) {
    const Eigen::MatrixXf& gaussians = model_->codebooks[codebook].gaussians[stream];
    const bool by_kernels = kernels_ != nullptr && gaussians.rows() % 8 == 0;
    if (by_kernels) {
      log_densities_.resize(gaussians.rows(), 1);
    } else {
      log_densities_.noalias() = gaussians * terms;
    }
    std::array<Eigen::Index, kKept> likely{0, 1, 2, 3};
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      LikeliestDensities& found = likeliest(codebook, stream, frame);
      found.log_density.fill(-std::numeric_limits<float>::max());
      found.density.fill(0);
      if (by_kernels) {
        kernels_->find(gaussians, terms.col(frame).data(), likely, log_densities_.data(), found);
        likely = found.density;
        continue;
      }
      const float* values = log_densities_.col(frame).data();
      for (Eigen::Index first = 0; first < log_densities_.rows(); first += kBlock) {
        const Eigen::Index count = std::min(kBlock, log_densities_.rows() - first);
        // Few blocks hold one that is likelier than those found before.
        if (Eigen::Map<const Eigen::ArrayXf>(values + first, count).maxCoeff() <= found.log_density.back()) continue;
        for (Eigen::Index i = first; i < first + count; ++i) {
          if (values[i] > found.log_density.back()) found.insert(values[i], i);
        }
      }
    }
  }
}

/// Against the best density of the frame in this stream, in place.
void SenoneScorer::toLikelihoods(std::size_t stream, Eigen::Index frame) {
  float best = -std::numeric_limits<float>::max();
  for (const std::size_t codebook : looked_at_)
    best = std::max(best, likeliest(codebook, stream, frame).log_density.front());
  for (const std::size_t codebook : looked_at_) {
    for (float& value : likeliest(codebook, stream, frame).log_density)
      value = std::exp(std::max(value - best, asFloat(-kFloor)));
  }
}

void SenoneScorer::scoreFrame(Eigen::Index frame, const Weighing& weighing) {
  const std::size_t streams = model_->stream_sizes.size();
  float best = std::numeric_limits<float>::min();
  for (const std::size_t index : looked_at_) {
    const TiedModel::Codebook& codebook = model_->codebooks[index];
    Eigen::ArrayXf& likelihood = likelihoods_[index];
    if (kernels_ != nullptr) {
      mixed_.clear();
      for (std::size_t stream = 0; stream < streams; ++stream) {
        const LikeliestDensities& found = likeliest(index, stream, frame);
        MixedStream& mixed = mixed_.emplace_back(MixedStream{{}, found.log_density});
        for (std::size_t k = 0; k < kKept; ++k)
          mixed.weights[k] = codebook.weights[stream].col(found.density[k]).data();
      }
      best = std::max(best, kernels_->mix(mixed_.data(), streams, likelihood.size(), likelihood.data()));
      continue;
    }
    for (std::size_t stream = 0; stream < streams; ++stream) {
      const LikeliestDensities& found = likeliest(index, stream, frame);
      const Eigen::MatrixXf& weights = codebook.weights[stream];
      static_assert(kKept == 4, "written out below, so that it is one pass over the weights");
      const auto mixed = weights.col(found.density[0]).array() * found.log_density[0] +
                         weights.col(found.density[1]).array() * found.log_density[1] +
                         weights.col(found.density[2]).array() * found.log_density[2] +
                         weights.col(found.density[3]).array() * found.log_density[3];
      if (stream == 0) {
        likelihood = mixed;
      } else {
        likelihood *= mixed;
      }
    }
    if (likelihood.size() > 0) best = std::max(best, likelihood.maxCoeff());
  }
  for (const std::size_t index : looked_at_) {
    if (!weighing.wanted[index]) continue;
    const TiedModel::Codebook& codebook = model_->codebooks[index];
    Eigen::ArrayXf& score = likelihoods_[index];
    const auto unit = asFloat(-weighing.scale / kScoreUnit);
    if (kernels_ != nullptr) {
      own_scores_.resize(codebook.senones.size());
      kernels_->score(score.data(), score.size(), best, unit, own_scores_.data());
      for (std::size_t i = 0; i < own_scores_.size(); ++i) scores_(codebook.senones[i], frame) = own_scores_[i];
      continue;
    }
    score = (score / best).max(std::numeric_limits<float>::min()).log() * unit + 0.5F;
    for (Eigen::Index i = 0; i < score.size(); ++i)
      scores_(codebook.senones[unsignedIndex(i)], frame) = static_cast<std::int16_t>(score[i]);
  }
}

const SenoneScorer::Scores& SenoneScorer::score(const Eigen::Ref<const Eigen::MatrixXf>& features,
                                                const Weighing& weighing) {
  MOUTHPIECE_EXPECT(weighing.wanted.size() == model_->codebooks.size());
  MOUTHPIECE_EXPECT(features.rows() == model_->featureCount());
  looked_at_.clear();
  for (std::size_t codebook = 0; codebook < weighing.wanted.size(); ++codebook) {
    if (weighing.against_all || weighing.wanted[codebook]) looked_at_.push_back(codebook);
  }
  const Eigen::Index frames = features.cols();
  const std::size_t streams = model_->stream_sizes.size();
  likeliest_.resize(unsignedIndex(frames) * streams * model_->codebooks.size());
  for (std::size_t stream = 0, row = 0; stream < streams; ++stream) {
    const Eigen::Index size = model_->stream_sizes[stream];
    findLikeliest(stream, features.middleRows(signedIndex(row), size));
    row += unsignedIndex(size);
    for (Eigen::Index frame = 0; frame < frames; ++frame) toLikelihoods(stream, frame);
  }
  scores_.setConstant(signedIndex(model_->senone_count), frames, kWorstScore);
  for (Eigen::Index frame = 0; frame < frames; ++frame) scoreFrame(frame, weighing);
  return scores_;
}

FleetingSounds::FleetingSounds(const TiedModel& model, const std::vector<std::size_t>& kept) {
  for (const TiedModel::Codebook& codebook : model.codebooks) {
    const Phone phone = phoneFromName(codebook.phone).value_or(Phone::kSil);
    if (rowOf(phone).fleeting) senones_.insert(senones_.end(), codebook.senones.begin(), codebook.senones.end());
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const std::size_t before = kept[i > 0 ? i - 1 : i], after = kept[i + 1 < kept.size() ? i + 1 : i];
    frame_counts_.push_back(std::clamp(0.5 * asReal(after - before), 1.0, kMostFrames));
  }
}

void FleetingSounds::weigh(SenoneScorer::Scores& scores, Eigen::Index first) const {
  if (frame_counts_.empty()) return;
  for (Eigen::Index frame = 0; frame < scores.cols(); ++frame) {
    const double count = frame_counts_[unsignedIndex(first + frame)];
    for (const int senone : senones_)
      scores(senone, frame) = static_cast<std::int16_t>(std::min(count * scores(senone, frame), kLargestScore));
  }
}

double FleetingSounds::timesWeighed(Phone phone, std::size_t first, std::size_t last) const {
  if (last >= frame_counts_.size() || !rowOf(phone).fleeting) return 1;
  const auto begin = frame_counts_.begin() + signedIndex(first);
  const auto end = frame_counts_.begin() + signedIndex(last + 1);
  return std::accumulate(begin, end, 0.0) / asReal(last + 1 - first);
}

}  // namespace mouthpiece
