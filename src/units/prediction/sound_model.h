#pragma once

#include <Eigen/Core>
#include <span>

#include "audio/audio_clip.h"
#include "base/time.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Level (dB) and twelve mel-frequency cepstral coefficients.
inline constexpr Eigen::Index kSoundMeasures = 13;
/// Deviations 60 ms before, at and after a moment; in silence also those within 120 ms, where breath is heard.
inline constexpr Eigen::Index kSoundFeatures = 8 * kSoundMeasures;

/// What a recording says beyond its phones, and what that moves (docs/theory/units/sound_model.md). Empty where the
/// corpus has no sound or nothing in it told anything about takes left out.
struct SoundModel {
  Eigen::MatrixXd expected;          ///< kPhoneCount x kSoundMeasures: how this speaker's phones sound
  Eigen::RowVectorXd spread;         ///< standard deviation of a measure about that, each take's own level taken off
  Eigen::RowVectorXd widest_spread;  ///< which nine in ten takes stay under
  Eigen::MatrixXd weights;           ///< kSoundFeatures x components, mm; features in units of `spread`

  [[nodiscard]] bool isEmpty() const { return weights.size() == 0; }
};

/// What is measured of a sound every kStep, row i at i * kStep.
struct SoundMeasures {
  static constexpr Seconds kStep = 0.010;
  Eigen::MatrixXd rows;  ///< x kSoundMeasures
};
SoundMeasures soundMeasures(const AudioClip& clip);

/// How a sound departs from what its phones are expected to sound like, smoothed over 35 ms. The means of the
/// departure, in speech and in silence, are taken off: they are the speaker's, the microphone's and the room's.
class SoundDeviations {
 public:
  SoundDeviations(SoundMeasures measures, const SpeechLabels& labels, const Eigen::MatrixXd& expected);

  /// Of each measure in speech, the standard deviation.
  [[nodiscard]] Eigen::RowVectorXd spreadInSpeech() const;
  /// times x kSoundFeatures, each measure times `scale`; zero beyond the sound's ends.
  [[nodiscard]] Eigen::MatrixXd featuresAt(std::span<const Seconds> times, const Eigen::RowVectorXd& scale) const;
  [[nodiscard]] const Eigen::MatrixXd& rows() const { return rows_; }

 private:
  [[nodiscard]] Eigen::RowVectorXd at(Seconds time) const;

  Eigen::MatrixXd rows_;     ///< x kSoundMeasures, every SoundMeasures::kStep
  Eigen::VectorXd silence_;  ///< 0 to 1 a row
};

/// The sound of a line, made comparable with that of the corpus' speaker. What departs more widely than his own takes
/// do is another voice or noise: each measure is scaled down to his width, and a sound that fits his phones badly
/// altogether is not believed at all.
class HeardLine {
 public:
  /// `model` is not empty and outlives this.
  HeardLine(const SoundModel& model, const AudioClip& clip, const SpeechLabels& labels)
      : HeardLine(model, soundMeasures(clip), labels) {}
  HeardLine(const SoundModel& model, SoundMeasures measures, const SpeechLabels& labels);

  /// times x components, mm: to be added to the prediction.
  [[nodiscard]] Eigen::MatrixXd at(std::span<const Seconds> times) const;
  /// 0 to 1.
  [[nodiscard]] double believed() const { return believed_; }
  /// Mean square of the departures over the widest usual ones: up to 1 for the corpus' speaker.
  [[nodiscard]] double strangeness() const { return strangeness_; }

 private:
  const SoundModel* model_;
  SoundDeviations deviations_;
  Eigen::RowVectorXd scale_;
  double strangeness_ = 0, believed_ = 1;
};

}  // namespace mouthpiece
