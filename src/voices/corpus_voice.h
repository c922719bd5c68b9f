#pragma once

#include <memory>
#include <optional>

#include "units/selection/selection.h"
#include "units/selection/unit_database.h"
#include "voices/corpus_sounds.h"
#include "voices/voice.h"

namespace mouthpiece {

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
