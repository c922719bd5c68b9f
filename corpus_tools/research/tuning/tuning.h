#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace mouthpiece {

struct TuningOptions {
  std::size_t folds = 6;         ///< each take is made from the takes of the other folds; half search, half judge
  std::size_t most_takes = 300;  ///< of a larger corpus, that many, evenly spaced: time and memory stay bounded
  bool always = false;           ///< takes the best found even where its gain may be chance
  std::size_t jobs = 0;          ///< threads; 0: one per core. The result does not depend on it
};

using TuningProgress = std::function<void(std::size_t done, std::size_t total)>;

/// What a search for weights found. A score is a number, or has a sum() that is one; less is better.
template <typename Weights, typename Score>
struct Tuned {
  Weights weights;           ///< the best found where `taken`, else those of the corpus
  bool helps = false;        ///< also on the judging takes, by more than `judge_error`
  bool taken = false;        ///< `weights` are the best found
  std::size_t settings = 0;  ///< tried
  std::size_t search_takes = 0, judge_takes = 0;
  double search_before = 0, search_after = 0;
  Score judge_before{}, judge_after{};
  double judge_error = 0;  ///< standard error of the difference of the judging takes' scores
  std::string changes;     ///< "duration 1 -> 0.5, ..." of the best found; empty when it is where it began
};

}  // namespace mouthpiece
