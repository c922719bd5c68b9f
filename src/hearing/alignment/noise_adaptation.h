#pragma once

#include <Eigen/Core>
#include <vector>

#include "hearing/alignment/acoustic_model.h"

namespace mouthpiece {

/// `model` as its sounds come out of the steady background of one sound: a vector Taylor series of how speech and
/// noise add up in the mel bands (P. Moreno, 1996; docs/theory/hearing/alignment.md). cepstra: of the whole sound, a
/// column every 10 ms, their mean not taken off; the adapted model weighs the same features as `model` does. `wanted`:
/// the codebooks that may be in it. A model of other features than cepstra with two differences stays as it is.
TiedModel adaptedToNoise(const TiedModel& model, const Eigen::MatrixXd& cepstra, const std::vector<bool>& wanted);

/// Whether adaptedToNoise() knows such a background: another stays out of the model. cepstra: as there.
bool isSteady(const Eigen::MatrixXd& cepstra);

/// How much the bands of a sound's background change within a tenth of a second, dB: the root of the mean square over
/// the quiet frames, each averaged over some 50 ms. cepstra: as of adaptedToNoise().
double unsteadinessDb(const Eigen::MatrixXd& cepstra);

}  // namespace mouthpiece
