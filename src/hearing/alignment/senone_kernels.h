#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

namespace mouthpiece {

/// The likeliest densities of a codebook in one stream of a frame, the best first.
struct LikeliestDensities {
  std::array<float, 4> log_density{};
  std::array<Eigen::Index, 4> density{};

  /// Takes one in that is likelier than the last.
  void insert(float value, Eigen::Index place) {
    std::size_t at = log_density.size() - 1;
    for (; at > 0 && log_density[at - 1] < value; --at) {
      log_density[at] = log_density[at - 1];
      density[at] = density[at - 1];
    }
    log_density[at] = value;
    density[at] = place;
  }
};

/// Of senones of one codebook in one stream: the columns of their weights for the densities kept, and what those count.
struct MixedStream {
  std::array<const float*, 4> weights{};
  std::array<float, 4> shares{};
};

/// The inner loops of SenoneScorer for processors with AVX2. Sums are made in the order in which Eigen makes them, with
/// no fused operations, so that the scores are the same bits.
struct SenoneKernels {
  /// gaussians * terms, and the largest of it in `found`, which holds none yet. `densities`: room for the product, a
  /// multiple of 8 rows. `likely`: different places that are guessed to be the largest, as they were in the frame
  /// before; the nearer the fewer are looked at.
  void (*find)(const Eigen::MatrixXf& gaussians, const float* terms, const std::array<Eigen::Index, 4>& likely,
               float* densities, LikeliestDensities& found);
  /// likelihoods[i]: the product over the streams (one or more) of the sums of weights[k][i] * shares[k]. Returns the
  /// largest.
  float (*mix)(const MixedStream* streams, std::size_t stream_count, Eigen::Index senones, float* likelihoods);
  /// scores[i]: the whole part of unit * log(likelihoods[i] / best) + 1/2, the logarithm of what is positive and normal
  /// at the least. No more than `best` is likely.
  void (*score)(const float* likelihoods, Eigen::Index senones, float best, float unit, std::int16_t* scores);
};

/// None where the processor has no AVX2.
const SenoneKernels* senoneKernels();

}  // namespace mouthpiece
