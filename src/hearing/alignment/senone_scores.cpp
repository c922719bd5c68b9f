#include "hearing/alignment/senone_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/errors.h"

namespace mouthpiece {
namespace {

/// In a stream no density counts for less than this much under the best of its frame: a sound unlike all of the model's
/// cannot outweigh the rest (PocketSphinx' MAX_NEG_ASCR).
constexpr double kFloor = 96 * kScoreUnit;
constexpr Eigen::Index kBlock = 16;
constexpr std::int16_t kWorstScore = 3 * (96 + 255);

void insertInto(std::array<float, SenoneScorer::kKept>& values, std::array<Eigen::Index, SenoneScorer::kKept>& places,
                float value, Eigen::Index place) {
  std::size_t at = values.size() - 1;
  for (; at > 0 && values[at - 1] < value; --at) {
    values[at] = values[at - 1];
    places[at] = places[at - 1];
  }
  values[at] = value;
  places[at] = place;
}

}  // namespace

SenoneScorer::SenoneScorer(std::shared_ptr<const TiedModel> model) : model_(std::move(model)) {
  for (const TiedModel::Codebook& codebook : model_->codebooks)
    likelihoods_.emplace_back(static_cast<Eigen::Index>(codebook.senones.size()));
}

SenoneScorer::Likeliest& SenoneScorer::likeliest(std::size_t codebook, std::size_t stream, Eigen::Index frame) {
  const std::size_t streams = model_->stream_sizes.size();
  return likeliest_[(static_cast<std::size_t>(frame) * streams + stream) * model_->codebooks.size() + codebook];
}

void SenoneScorer::findLikeliest(std::size_t stream, const Eigen::Ref<const Eigen::MatrixXf>& features) {
  const Eigen::Index size = features.rows(), frames = features.cols();
  Eigen::MatrixXf terms(2 * size + 1, frames);
  terms.topRows(size) = features.cwiseAbs2();
  terms.middleRows(size, size) = features;
  terms.bottomRows(1).setOnes();
  for (const std::size_t codebook : looked_at_) {
    log_densities_.noalias() = model_->codebooks[codebook].gaussians[stream] * terms;
    for (Eigen::Index frame = 0; frame < frames; ++frame) {
      Likeliest& found = likeliest(codebook, stream, frame);
      found.log_density.fill(-std::numeric_limits<float>::max());
      found.density.fill(0);
      const float* values = log_densities_.col(frame).data();
      for (Eigen::Index first = 0; first < log_densities_.rows(); first += kBlock) {
        const Eigen::Index count = std::min(kBlock, log_densities_.rows() - first);
        // Few blocks hold one that is likelier than those found before.
        if (Eigen::Map<const Eigen::ArrayXf>(values + first, count).maxCoeff() <= found.log_density.back()) continue;
        for (Eigen::Index i = first; i < first + count; ++i) {
          if (values[i] > found.log_density.back()) insertInto(found.log_density, found.density, values[i], i);
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
      value = std::exp(std::max(value - best, static_cast<float>(-kFloor)));
  }
}

void SenoneScorer::scoreFrame(Eigen::Index frame, const Weighing& weighing) {
  const std::size_t streams = model_->stream_sizes.size();
  float best = std::numeric_limits<float>::min();
  for (const std::size_t index : looked_at_) {
    const TiedModel::Codebook& codebook = model_->codebooks[index];
    Eigen::ArrayXf& likelihood = likelihoods_[index];
    for (std::size_t stream = 0; stream < streams; ++stream) {
      const Likeliest& found = likeliest(index, stream, frame);
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
    const auto unit = static_cast<float>(-weighing.scale / kScoreUnit);
    score = (score / best).max(std::numeric_limits<float>::min()).log() * unit + 0.5F;
    for (Eigen::Index i = 0; i < score.size(); ++i)
      scores_(codebook.senones[static_cast<std::size_t>(i)], frame) = static_cast<std::int16_t>(score[i]);
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
  likeliest_.resize(static_cast<std::size_t>(frames) * streams * model_->codebooks.size());
  for (std::size_t stream = 0, row = 0; stream < streams; ++stream) {
    const Eigen::Index size = model_->stream_sizes[stream];
    findLikeliest(stream, features.middleRows(static_cast<Eigen::Index>(row), size));
    row += static_cast<std::size_t>(size);
    for (Eigen::Index frame = 0; frame < frames; ++frame) toLikelihoods(stream, frame);
  }
  scores_.setConstant(static_cast<Eigen::Index>(model_->senone_count), frames, kWorstScore);
  for (Eigen::Index frame = 0; frame < frames; ++frame) scoreFrame(frame, weighing);
  return scores_;
}

}  // namespace mouthpiece
