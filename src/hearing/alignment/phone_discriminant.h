#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "hearing/alignment/speaker_adaptation.h"

namespace mouthpiece {

/// Which phone of a speaker a frame is heard in, by what stands around it: discriminants of his own phones, each in
/// three parts as its states are (R. A. Fisher, 1936; docs/theory/hearing/phone_ear.md).
class PhoneDiscriminant {
 public:
  static constexpr Eigen::Index kParts = 3;
  /// Frames on either side of a frame, the farthest away, that tell of its phone.
  static constexpr Eigen::Index kFarthest = 12;

  /// Tells nothing.
  PhoneDiscriminant() = default;
  /// `codebooks`: how many there are. Tells nothing where too little was heard.
  PhoneDiscriminant(std::span<const SpeakerFrames> heard, std::size_t codebooks);

  /// How far a sound's frames lie from the nearest phone, against how far those do that were learnt from; 1 where
  /// nothing is known.
  [[nodiscard]] double strangenessOf(const Eigen::MatrixXf& features) const;

  /// Learns what logRatios() needs and strangenessOf() does not, which takes the most time. The second time nothing.
  void learnRatios();

  [[nodiscard]] bool isEmpty() const { return projection_.size() == 0; }

  /// (kParts * codebooks) x frames, entry part * codebooks + codebook: the logarithm of how much likelier the frame is
  /// in that part of that phone than anywhere, scaled as PhoneLoop takes it; 0 for phones that he was not heard to say.
  /// learnRatios() comes first.
  [[nodiscard]] Eigen::MatrixXf logRatios(const Eigen::MatrixXf& features) const;

 private:
  /// Fills rows_ with those of `rows`, by sound and frame, that are met often enough. Returns the class of each row;
  /// -1: none.
  std::vector<Eigen::Index> chooseRows(const std::vector<std::vector<Eigen::Index>>& rows);

  /// The mean squared distance of frames to the nearest class.
  [[nodiscard]] double distanceOf(const Eigen::MatrixXf& directions) const;

  Eigen::MatrixXf projection_;  ///< directions that part the phones x stacked features
  Eigen::VectorXf offset_;
  Eigen::MatrixXf class_means_;               ///< along the directions
  double usual_distance_ = 1;                 ///< squared, to the nearest of them
  Eigen::MatrixXf learnt_from_;               ///< frames along the directions, until learnRatios()
  std::vector<Eigen::Index> learnt_classes_;  ///< theirs
  Eigen::MatrixXf slopes_;                    ///< classes x directions and their products
  Eigen::VectorXf constants_;                 ///< of the classes
  Eigen::VectorXf log_priors_;
  std::vector<Eigen::Index> rows_;  ///< of the classes
  Eigen::Index row_count_ = 0;
};

}  // namespace mouthpiece
