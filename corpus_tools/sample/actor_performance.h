#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "corpus_tools/sample/actor_model.h"
#include "motion/motion_clip.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// ActorOptions::variation of the sample corpus.
inline constexpr double kActorVariation = 0.08;

struct ActorOptions {
  double frame_rate_hz = 120;
  std::size_t frame_count = 0;
  /// How much repetitions differ: targets by this share of each component's deviation, times by up to 10 ms. 0: none.
  double variation = 0;
  std::uint64_t seed = 1;        ///< of the variation
  bool restore_variance = true;  ///< apply ActorModel::gain
  bool close_lips = true;        ///< B P M and F V reach their ActorClosures
  bool expression = false;       ///< blinks and brows
};

/// The model's components while it says `labels`: frames x components, 0 is the neutral pose.
Eigen::MatrixXd actorComponents(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options);

/// The face that says `labels`, head still, in the model's axes.
MotionClip performSpeech(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options);

/// Blinks and slow brow movements of a face at `options.frame_rate_hz`: frames x (3 * markers), mm to add.
Eigen::MatrixXd actorExpression(const ActorModel& model, const SpeechLabels& labels, const ActorOptions& options);

/// Smooth random movement: deviation 1, mean 0, correlated over about `correlation` seconds. One value a frame.
Eigen::VectorXd smoothNoise(std::uint64_t seed, std::uint64_t stream, Seconds correlation, double frame_rate_hz,
                            std::size_t frame_count);

}  // namespace mouthpiece
