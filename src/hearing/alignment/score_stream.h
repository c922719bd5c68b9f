#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>

#include "hearing/alignment/fleeting_sounds.h"
#include "hearing/alignment/senone_scores.h"

namespace mouthpiece {

/// Feeds PocketSphinx' search with scores as from a file of them ("s3" header, then a row of int16 a frame): a block of
/// frames is weighed when the one before was read.
class ScoreStream {
 public:
  /// `features`: a column a frame. All but `weighing` are only looked at and must outlive it.
  ScoreStream(SenoneScorer& scorer, const Eigen::MatrixXf& features, Weighing weighing, const FleetingSounds& fleeting);

  /// The next bytes, at most `size`; 0: there are no more.
  std::size_t take(char* buffer, std::size_t size);

 private:
  void weighNext();

  SenoneScorer& scorer_;
  const Eigen::MatrixXf& features_;
  Weighing weighing_;
  const FleetingSounds& fleeting_;
  Eigen::Index next_ = 0;
  std::string bytes_;
  std::size_t at_ = 0;
};

}  // namespace mouthpiece
