#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "audio/audio_clip.h"
#include "hearing/alignment/voice_transform.h"
#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"

namespace mouthpiece {

/// A sound of which is known what is said when.
struct LabelledSound {
  AudioClip audio;
  SpeechLabels labels;
};

/// Sounds of one person, `most` of them at most, evenly spaced among all that there are.
using SpeakerSounds = std::function<std::vector<LabelledSound>(std::size_t most)>;
SpeakerSounds soundsAmong(std::vector<LabelledSound> all);

/// 16 kHz, as the ears take it.
std::vector<std::int16_t> samplesToHear(const AudioClip& audio);

/// A column of what an ear hears is so long, and the first one's start so far from the sound's.
inline constexpr Seconds kEarStep = 0.010, kEarShift = 0.008;

/// How likely each phone is at each time of a sound, whatever is said (PhoneLoop). Not thread-safe.
class PhoneEar {
 public:
  /// The language's acoustic model and its order of phones. Throws InputError without the first.
  explicit PhoneEar(const Language& language = english());
  ~PhoneEar();

  /// Learns how one speaker says his phones, from sounds of his. What sounds like him (fitOf) is heard so from then on;
  /// a sound that goes on is taken to be his.
  void learn(std::span<const LabelledSound> sounds);
  /// Learns so little of a speaker that it knows whose sounds may be his, and the rest from kMostSounds of his when
  /// such a one comes: most recordings are another's. What `speaker` throws then comes from there.
  void learn(SpeakerSounds speaker);
  /// Each takes some 10 ms and, meanwhile, 1 MB; more would tell more.
  static constexpr std::size_t kMostSounds = 150;

  /// Learns the voice of one recording from stretches of it, whatever they say, in place of the voice before: what is
  /// not the learnt speaker's is heard by it from then on, where that is likelier. Of no stretches: no voice is known.
  void adaptTo(std::span<const std::span<const std::int16_t>> stretches);

  /// Rows: phones by their number; a column every 10 ms, from 8 ms on. samples: 16 kHz. `around`: they and what lies
  /// around them, if anything does, which tells whether they are noisy, and who speaks where they are short. A noisy
  /// sound is heard by the model in its noise (adaptedToNoise).
  Eigen::MatrixXf posteriors(std::span<const std::int16_t> samples, std::span<const std::int16_t> around = {});
  /// Whether the sound that posteriors() heard last was taken to be the learnt speaker's.
  [[nodiscard]] bool knowsSpeaker() const;
  /// How that sound's voice was heard: none where the speaker is known, in noise, and where the sound is no
  /// likelier by the voice of its recording.
  [[nodiscard]] VoiceTransform voice() const;

  /// Hears a sound that goes on; `begins`: with these samples. Returns how many frames of 10 ms were heard since it
  /// began: a frame is heard 56 ms after it begins. The level is that of the last seconds of speech: `is_speech` says
  /// whether these samples are some.
  std::size_t hearOn(std::span<const std::int16_t> samples, bool begins, bool is_speech);
  /// posteriors() of the last `count` frames of it, at most kRemembered.
  [[nodiscard]] Eigen::MatrixXf posteriorsOfLast(std::size_t count) const;
  /// Hears its last `count` frames again, fewer than kRemembered and than there are, where much more is known by now:
  /// the level of speech, and the learnt speaker's phones or, where `is_clean`, the voice of the last seconds of
  /// speech. Returns whether it did.
  bool hearAgain(std::size_t count, bool is_clean);
  static constexpr std::size_t kRemembered = 140;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A phone heard, to 10 ms.
struct HeardPhone {
  Phone phone = Phone::kSil;
  std::size_t first = 0, end = 0;  ///< frames
  double confidence = 0;           ///< its posterior in the mean
};

/// The row of phones that is right in the most frames that can be expected, where a phone that looks like the right
/// one counts by `likeness` (phones x phones, 0 to 1); each at least three frames long. `posteriors`: of PhoneEar.
/// `change`: what one more phone costs, in frames.
std::vector<HeardPhone> likeliestPhones(const Eigen::MatrixXf& posteriors, const Eigen::MatrixXf& likeness,
                                        double change);

/// Phones x phones for likeliestPhones(): two of one viseme are nearly as good as each other to the lips; 1 for a phone
/// itself, silence is like nothing else.
Eigen::MatrixXf lipLikeness();
/// What a phone more costs then.
inline constexpr double kFurtherPhone = 1.0;

}  // namespace mouthpiece
