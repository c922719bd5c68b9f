#pragma once

namespace mouthpiece {

/// What a mismatch costs in the lattice (viterbi in a corpus with a trajectory model). Each target term is the mean
/// over a pair of phones. Set by hand; `corpus tune` learns others for a corpus (docs/theory/selection.md).
struct LatticeWeights {
  double prediction_per_mm2 = 0.3;  ///< squared distance of the captured components to those predicted for the line
  double context_per_mm2 = 0.65;    ///< of those predicted for the fragment's own take to those for the line
  double duration = 1.0;            ///< |ln(target / source duration)|; silences do not count
  double neighbours = 0.5;          ///< phones two to each side: 0 the same, 0.5 the same class, 1 another
  double position = 0.1;            ///< per edge of syllable, word or phrase that only one of the two has there
  double stress = 0.1;              ///< stressed in one and not in the other
  double rate = 0.1;                ///< |ln| of the ratio of phones a second, in the words around
  double closure_per_mm = 0.5;      ///< per B P M: lips left open beyond the speaker's usual closure
  double join_position_per_mm = 0.2;
  double join_velocity_per_mm_s = 0.03;
  double join_opening_per_mm = 0.05;
  double unit = 0.1;    ///< per join; none where the pairs are neighbours in the capture
  double backoff = 10;  ///< per stand-in, and its distance by viseme class on top
};

}  // namespace mouthpiece
