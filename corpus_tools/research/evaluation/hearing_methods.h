#pragma once

#include <string>
#include <vector>

#include "corpus_tools/research/evaluation/evaluation_methods.h"

namespace mouthpiece {

/// Rows of symbols against the right ones: the fewest exchanges, gaps and insertions that make one of the other.
struct HearingErrors {
  std::size_t right = 0, exchanged = 0, left_out = 0, put_in = 0;  ///< right: symbols of the right row

  [[nodiscard]] double rate() const;  ///< NaN where there was nothing to hear
  HearingErrors& operator+=(const HearingErrors& other);
};
HearingErrors hearingErrors(const std::vector<std::string>& right, const std::vector<std::string>& heard);

/// What one way of hearing made of takes.
struct HearingScore {
  std::string way;  ///< as the row of the table is named
  HearingErrors phones, visemes, words;
  std::size_t takes = 0, unheard = 0;
  double sound_s = 0, time_s = 0;  ///< wall time of hearing
};

/// The default method from a take's own labels, and from what is heard in its sound alone: by words and phones with the
/// corpus' lines known, with `hint` beside or nothing known, and by phones. `scores` gets a row a way and must outlive
/// the methods. Takes need their sound.
EvaluationMethods hearingMethods(std::vector<HearingScore>& scores, const std::string& hint);

/// A table for people, and the same as JSON.
std::string hearingTable(const std::vector<HearingScore>& scores);
std::string hearingJson(const std::vector<HearingScore>& scores);

}  // namespace mouthpiece
