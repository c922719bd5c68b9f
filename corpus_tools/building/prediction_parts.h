#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "corpus_tools/building/trajectory_design.h"
#include "units/file/corpus.h"
#include "units/prediction/context_network.h"
#include "units/prediction/sound_model.h"

namespace mouthpiece {

/// What features of segments (speechSegments()) bring is alike where the sounds that they name are made alike: a
/// Gaussian process over height, backness, rounding, place, manner and the lips' contact, of a sound and of its
/// neighbour (docs/theory/units/prediction.md). So a rare feature is drawn to those like it instead of to nothing, and
/// one that nobody said is placed by them.
class ArticulatoryPrior {
 public:
  /// The features that somebody said.
  explicit ArticulatoryPrior(std::vector<std::string> names);

  /// Of the usual covariance of what they bring, whose diagonal is 1: the inverse. features x features.
  [[nodiscard]] Eigen::MatrixXd precision() const;

  /// What phones, visemes and pairs of visemes that are not among them are expected to bring. `targets`: a row a
  /// feature.
  [[nodiscard]] std::map<std::string, Eigen::VectorXd> unsaid(const Eigen::MatrixXd& targets) const;

 private:
  /// Features of one kind; those of two have nothing to do with each other.
  struct Kind {
    std::vector<Eigen::Index> places;
    Eigen::MatrixXd precision;
  };
  std::vector<std::string> names_;
  std::vector<Kind> kinds_;
};

/// A take as a network learns from it.
struct NetworkTake {
  std::vector<ContextSegment> segments;
  std::vector<Seconds> times;
  Eigen::VectorXf seen;           ///< 1 or 0 a time
  ContextNetwork::Matrix values;  ///< times x components, mm, their mean over the seen taken off; 0 where not seen
};

struct NetworkFitOptions {
  Eigen::Index hidden = 48;
  int epochs = 24;
  double rate = 4e-3;        ///< Adam's, at its largest; falls to nothing along a cosine
  double decay = 1.0;        ///< of weights, times the rate
  double sound_decay = 4.0;  ///< the same of what belongs to one sound alone: what sounds share is preferred
  double forgotten = 0.25;   ///< share of segments whose own sound is hidden in a step: what sounds share must do
  std::size_t takes_a_step = 4;
};

/// Least squares of the values by Adam, over the takes of those numbers. The same seed, the same network, whatever the
/// number of threads.
ContextNetwork fitContextNetwork(const std::vector<NetworkTake>& takes, const std::vector<std::size_t>& use,
                                 Eigen::Index components, std::uint64_t seed, const NetworkFitOptions& options = {});

/// What the network says of a take, its mean over the seen taken off; 0 where not seen.
Eigen::MatrixXd centredPrediction(const ContextNetwork& network, const NetworkTake& take);

/// How long before speech this speaker's mouth opens, by how long the silence before it lasts: a line through the takes
/// that open it visibly, drawn to the usual timing by 20 takes; never shorter or longer than in the takes' shortest and
/// longest silences. The usual timing where few do.
SilenceTiming fitSilenceTiming(const std::vector<FitTake>& takes, const Corpus& corpus);

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
