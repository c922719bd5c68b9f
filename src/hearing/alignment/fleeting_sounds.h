#pragma once

#include <cstddef>
#include <vector>

#include "phonetics/language/phone.h"
#include "hearing/alignment/senone_scores.h"

namespace mouthpiece {

/// Sounds that are movements, in singing too: nobody holds them (Y W R L HH). Where a song's frames are left out, such
/// a sound is weighed as if they were heard: it must not take a held vowel that is like it, as the Y of "you" its UW.
class FleetingSounds {
 public:
  /// None: nothing is weighed.
  FleetingSounds() = default;
  /// `kept`: the frames that are heard (thinFrames).
  FleetingSounds(const TiedModel& model, const std::vector<std::size_t>& kept);

  /// `scores`: of the frames from `first` on, of those that are kept.
  void weigh(SenoneScorer::Scores& scores, Eigen::Index first) const;

  /// How often a phone that was heard in the kept frames [first, last] was weighed, a frame in the mean: 1 for most.
  [[nodiscard]] double timesWeighed(Phone phone, std::size_t first, std::size_t last) const;

 private:
  std::vector<int> senones_;
  std::vector<double> frame_counts_;  ///< how many frames each kept one stands for
};

}  // namespace mouthpiece
