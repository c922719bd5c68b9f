#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "audio/sound_joiner.h"
#include "units/selection/selection.h"
#include "units/selection/unit_database.h"
#include "voices/voice.h"

namespace mouthpiece {

/// Where two recordings of the same phone are best cut to go from one into the other.
struct SoundCut {
  Seconds left = 0;   ///< in the left recording: leave it here
  Seconds right = 0;  ///< and go on here
  double cost = 0;    ///< about 1 for neighbouring frames of steady speech that differ as such frames do
};

/// The recordings of a corpus, loaded, marked and measured when first needed. Not thread-safe.
class CorpusSounds {
 public:
  explicit CorpusSounds(const UnitDatabase& database);
  ~CorpusSounds();

  /// Throws InputError when the corpus has no sound for that take, its sound is damaged, or it has another sampling
  /// rate than the first take that was asked for.
  const MarkedSound& soundOf(TakeIndex take);
  /// Those of the corpus until others are set.
  [[nodiscard]] const SoundCutWeights& weights() const { return weights_; }
  void setWeights(const SoundCutWeights& weights);
  [[nodiscard]] int sampleRateHz() const { return sample_rate_hz_; }

  /// The best cut from phone `left` into phone `right`: alike in spectrum (MFCC), level, pitch and lips, at about the
  /// same place of the phone, and where it is quiet. Cached.
  SoundCut cut(const PhonePlace& left, const PhonePlace& right);

 private:
  struct Frames;
  struct Recording;
  Recording& recordingOf(TakeIndex take);

  const UnitDatabase& database_;
  SoundCutWeights weights_;
  int sample_rate_hz_ = 0;
  std::map<std::size_t, std::unique_ptr<Recording>> recordings_;
  std::map<std::pair<PhonePlace, PhonePlace>, SoundCut> cuts_;
};

struct CorpusVoiceOptions {
  SelectionOptions selection;
  /// Speaking rate: 1 as fast as the reader would speak. Not given: the fragments' own durations.
  std::optional<double> rate;
};

/// Speaks with the corpus' own recordings: the units that SpokenLine::units names give the sound here and the motion in
/// synthesis, so lips and sound come from one recording. Phones, words and stress are another voice's; durations are
/// those of the fragments. Joins are cut where the two recordings are most alike and made pitch-synchronously.
class CorpusVoice : public Voice {
 public:
  /// `reader` turns text into phones; `database` outlives the voice.
  CorpusVoice(std::unique_ptr<Voice> reader, const UnitDatabase& database, const CorpusVoiceOptions& options = {});
  /// Throws InputError, besides for the text, when the corpus lacks a phone of the line or has no sound.
  SpokenLine speak(std::string_view text) override;
  /// In place of the corpus' own.
  void setCutWeights(const SoundCutWeights& weights) { sounds_.setWeights(weights); }

 private:
  std::unique_ptr<Voice> reader_;
  const UnitDatabase& database_;
  CorpusVoiceOptions options_;
  CorpusSounds sounds_;
};

}  // namespace mouthpiece
