#pragma once

#include <Eigen/Core>

#include "hearing/tags/vowel_envelope.h"
#include "base/byte_reader.h"

namespace mouthpiece {

/// How the vowels of voices lie, learnt from many of them, and with it how those of one recording lie: what is E for
/// one singer is I for another, but seldom both are in one recording (docs/theory/vowel_network.md, "The voice of a
/// recording"). Immutable: may be shared by threads.
class VowelAdaptation {
 public:
  /// The last part of the weights' file. Throws InputError for sizes that do not fit the bytes, numbers that are not
  /// finite and a covariance that is none.
  static VowelAdaptation read(ByteReader& reader);

  /// The network's shares (frames x 6) as this voice's vowels have it; the share of silence stays, and so do frames
  /// without a pitch.
  [[nodiscard]] Eigen::MatrixXf adapt(const VowelEnvelopes& envelopes, const Eigen::MatrixXf& shares) const;

 private:
  struct Frames;
  struct Fit;
  [[nodiscard]] Eigen::MatrixXd densities(const Eigen::MatrixXd& places, const Eigen::VectorXd& mean,
                                          const Eigen::MatrixXd& covariance, double scatter) const;
  [[nodiscard]] double scattered(const Eigen::MatrixXd& places, const Eigen::MatrixXd& counts,
                                 const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) const;
  [[nodiscard]] Fit fit(const Frames& frames, Eigen::MatrixXd shares) const;
  [[nodiscard]] Eigen::MatrixXd byVoices(const Frames& frames) const;

  Eigen::MatrixXd directions_;  ///< bands x directions in which vowels lie apart; a vowel's frames scatter by 1 there
  Eigen::VectorXd mean_;        ///< of a voice's five means, one after the other
  Eigen::MatrixXd precision_;   ///< inverse of their covariance
  Eigen::MatrixXd starts_;      ///< a voice a column, from which to look for the one heard
};

}  // namespace mouthpiece
