#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "units/file/corpus.h"
#include "units/prediction/sound_model.h"

namespace mouthpiece {

/// A take as the fit of its sound sees it.
struct SoundTake {
  std::size_t index = 0;  ///< in the corpus
  std::size_t part = 0;   ///< takes of one part were left out together where the residuals come from
  std::vector<Seconds> times;
  Eigen::VectorXd seen;      ///< 1 or 0 a time
  Eigen::MatrixXd residual;  ///< times x components, mm: captured less predicted by what has not seen the take; centred
};

struct SoundFit {
  SoundModel model;     ///< empty where nothing was found
  std::string account;  ///< how much less the error is on parts left out; "" where there is no sound
};

/// Ridge regression of what the phones do not tell on how the sound departs from them; each component as far as parts
/// left out bear it. Reads the takes' sounds one by one. `parts`: how many.
SoundFit fitSound(const Corpus& corpus, const std::vector<SoundTake>& takes, std::size_t parts, std::size_t jobs);

}  // namespace mouthpiece
