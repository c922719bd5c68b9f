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

/// What an optical system with seven jig markers makes of a performance.
struct SampleCaptureOptions {
  std::uint64_t seed = 1;
  double noise_mm = 0.1;     ///< of a marker's position, deviation in 3-D
  double gaps_per_take = 5;  ///< mean; each hides one marker, now and then its neighbour too
  Seconds shortest_gap = 0.020;
  Seconds longest_gap = 0.150;
  double long_gap_chance = 0.12;  ///< of a take to hold one gap of `shortest_long_gap` to `longest_long_gap`
  Seconds shortest_long_gap = 0.25;
  Seconds longest_long_gap = 0.50;
};

/// How much was hidden.
struct SampleGaps {
  std::size_t gaps = 0;
  std::size_t hidden_samples = 0;
};

struct SampleCapture {
  MotionClip motion;  ///< the face, then JIG_1 ... JIG_7, in the room's axes; NaN where hidden
  SampleGaps hidden;
};

/// `face` (head still, face axes) worn by a head that nods and turns as people do who speak, seen by cameras with noise
/// and occlusions. Deterministic by seed.
SampleCapture captureSample(const MotionClip& face, const SpeechLabels& labels, const SampleCaptureOptions& options);

/// The jig at rest in face axes: seven points on a rigid band above the forehead, mm.
MarkerPositions sampleJig();

}  // namespace mouthpiece
