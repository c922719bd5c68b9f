#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "units/prediction/context_network.h"

namespace mouthpiece {

/// A take as a network learns from it.
struct NetworkTake {
  std::vector<ContextSegment> segments;
  std::vector<Seconds> times;
  Eigen::VectorXf seen;           ///< 1 or 0 a time
  ContextNetwork::Matrix values;  ///< times x components, mm, their mean over the seen taken off; 0 where not seen
};

struct NetworkFitOptions {
  Eigen::Index hidden = 48;
  int epochs = 24;
  double rate = 4e-3;        ///< Adam's, at its largest; falls to nothing along a cosine
  double decay = 1.0;        ///< of weights, times the rate
  double sound_decay = 4.0;  ///< the same of what belongs to one sound alone: what sounds share is preferred
  double forgotten = 0.25;   ///< share of segments whose own sound is hidden in a step: what sounds share must do
  std::size_t takes_a_step = 4;
};

/// Least squares of the values by Adam, over the takes of those numbers. The same seed, the same network, whatever the
/// number of threads.
ContextNetwork fitContextNetwork(const std::vector<NetworkTake>& takes, const std::vector<std::size_t>& use,
                                 Eigen::Index components, std::uint64_t seed, const NetworkFitOptions& options = {});

/// What the network says of a take, its mean over the seen taken off; 0 where not seen.
Eigen::MatrixXd centredPrediction(const ContextNetwork& network, const NetworkTake& take);

}  // namespace mouthpiece
