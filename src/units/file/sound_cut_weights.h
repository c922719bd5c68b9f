#pragma once

namespace mouthpiece {

/// What a cut from one recording of a phone into another costs (docs/theory/corpus_voice.md). Set by hand;
/// `corpus tune --voice` learns others for a corpus.
struct SoundCutWeights {
  double spectral = 1;         ///< per distance of neighbouring frames of steady speech, in MFCC
  double level_per_db = 0.08;  ///< difference of level
  double per_octave = 6;       ///< difference of pitch
  double voicing = 1.5;        ///< only one side is voiced
  double slip = 2;             ///< per phone length between the places of the two cuts
  double loud_per_db = 0.02;   ///< louder than the quietest place of the left phone
  double lip_per_mm = 0.3;     ///< of the lips, where both takes' own prediction is taken off
  double in_join = 0.5;        ///< of the sum, among the selection's join costs

  friend bool operator==(const SoundCutWeights&, const SoundCutWeights&) = default;
};

}  // namespace mouthpiece
