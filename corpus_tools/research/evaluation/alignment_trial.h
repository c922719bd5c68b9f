#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "corpus_tools/research/evaluation/evaluation.h"

namespace mouthpiece {

/// A take's own words found in its sound with something under it, against where they are found in the sound alone.
struct NoiseRow {
  std::string under;                      ///< "office, 10 dB"
  std::vector<double> start_errors_ms{};  ///< of every phone, not negative
  std::size_t words = 0;                  ///< that another follows
  std::size_t silences = 0;               ///< of these, followed by over 150 ms of silence that the clean sound lacks
  std::size_t takes = 0, unaligned = 0;   ///< unaligned: no path was found
};

/// How often a text is doubted (doubtsAbout) that is said, or is not.
struct DoubtRow {
  std::string text;   ///< "right", "another's", "cut", "one word in five changed"
  std::string under;  ///< "" for the sound alone
  std::size_t lines = 0, doubted = 0;
};

struct AlignmentTrial {
  std::vector<NoiseRow> noise;
  std::vector<DoubtRow> doubt;
};

struct AlignmentTrialOptions {
  std::size_t most_takes = 40;  ///< evenly chosen
  std::size_t jobs = 0;         ///< threads; 0: one a core. The result does not depend on it
  EvaluationProgress progress = {};
};

/// Aligns takes of `corpus`, their words said as their labels have them: in office, street and music noise at 20, 10
/// and 5 dB and in a room (noises.h), and with wrong texts. Throws InputError for a corpus without sound, and without
/// an acoustic model.
AlignmentTrial tryAlignment(const Corpus& corpus, const AlignmentTrialOptions& options = {});

/// A table for people, and the same as JSON.
std::string alignmentTable(const AlignmentTrial& trial);
std::string alignmentJson(const AlignmentTrial& trial);

}  // namespace mouthpiece
