#pragma once

#include <Eigen/Core>

#include "audio/audio_clip.h"

namespace mouthpiece {

/// The spectrum of a voice without its pitch, 100 frames a second as vowelFeatures has them: energies of the 26 mel
/// bands in nepers, after joining the tops of the harmonics, so that a high voice's harmonics do not pass for formants.
struct VowelEnvelopes {
  Eigen::MatrixXd levels;    ///< frames x 26, relative to the loud frames, at least -12, averaged over five frames
  Eigen::VectorXd pitch_hz;  ///< 0 where there is none
};
VowelEnvelopes vowelEnvelopes(const AudioClip& clip);

}  // namespace mouthpiece
