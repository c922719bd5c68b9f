#pragma once

#include <memory>
#include <string>
#include <vector>

#include "units/file/corpus.h"
#include "units/prediction/trajectory_model.h"

namespace mouthpiece {

struct TrajectoryFitOptions {
  Eigen::Index components = 12;
  double ridge = 1;         ///< how far targets are held back (docs/theory/units/prediction.md)
  double fit_rate_hz = 30;  ///< faster captures are thinned to about this: lips hold little above half of it
  /// Of a longer corpus every n-th take is kept in memory (30,000 frames of 66 markers: 24 MB, twenty minutes at 25 Hz)
  /// for components, dynamics and level; targets always come from all takes.
  double most_kept_frames = 30'000;
  std::size_t jobs = 0;  ///< threads; 0: one per core. The result does not depend on it
};

struct TrajectoryFit {
  std::shared_ptr<const TrajectoryModel> model;    ///< fitted to all takes; null when there is too little
  std::shared_ptr<const TrajectoryModel> judging;  ///< one like it that has not seen `judges`
  std::vector<std::size_t> judges;                 ///< takes of the corpus
  std::string sound_account = {};                  ///< SoundFit::account
};

/// Fits the model to all takes of `corpus`. Null when it has too little to learn from: fewer than four takes that are
/// seen in most frames, or a layout without lips.
TrajectoryFit fitTrajectory(const Corpus& corpus, const TrajectoryFitOptions& options = {});
/// Its model.
std::shared_ptr<const TrajectoryModel> fitTrajectoryModel(const Corpus& corpus,
                                                          const TrajectoryFitOptions& options = {});

}  // namespace mouthpiece
