#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "hearing/alignment/acoustic_model.h"

namespace mouthpiece {

/// What a speaker said in one sound, as the model hears it.
struct SpeakerFrames {
  Eigen::MatrixXf features;           ///< a column a frame (PhoneDecoder::featuresOf)
  std::vector<std::size_t> codebook;  ///< of each frame, whose phone is said in it; kNoCodebook: not known
  static constexpr std::size_t kNoCodebook = static_cast<std::size_t>(-1);
};

/// `model` as one speaker says its phones: the densities' means and how often each is met go towards what is heard of
/// him (maximum a posteriori: J.-L. Gauvain and C.-H. Lee, 1994; docs/theory/hearing/phone_ear.md). A model of other
/// features than the frames' stays as it is.
TiedModel adaptedToSpeaker(const TiedModel& model, std::span<const SpeakerFrames> heard);

/// The mean over frames of the logarithm of the likeliest density of all in the first stream: how well a model knows a
/// sound, whatever is said in it.
double fitOf(const TiedModel& model, const Eigen::MatrixXf& features);

}  // namespace mouthpiece
