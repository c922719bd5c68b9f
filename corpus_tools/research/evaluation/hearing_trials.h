#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"

namespace mouthpiece {

class WordNetwork;

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
  std::size_t most_takes = 40;     ///< evenly chosen
  std::size_t jobs = 0;            ///< threads; 0: one a core. The result does not depend on it
  WordNetwork* network = nullptr;  ///< that hears phones in noise (phonesBesideText); none: the aligner alone
  EvaluationProgress progress = {};
};

/// Aligns takes of `corpus`, their words said as their labels have them: in office, street and music noise at 20, 10
/// and 5 dB and in a room (noises.h), and with wrong texts. Throws InputError for a corpus without sound, and without
/// an acoustic model.
AlignmentTrial tryAlignment(const Corpus& corpus, const AlignmentTrialOptions& options = {});

/// A table for people, and the same as JSON.
std::string alignmentTable(const AlignmentTrial& trial);
std::string alignmentJson(const AlignmentTrial& trial);

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

/// The default method, with the sound, from a take's own labels, and from what is heard in its sound alone: by words
/// and phones with the corpus' lines known, with `hint` beside or nothing known, and by phones. `scores` gets a row a
/// way and must outlive the methods. `word_network`: RecogniserOptions'. Takes need their sound.
EvaluationMethods hearingMethods(std::vector<HearingScore>& scores, const std::string& hint,
                                 const std::shared_ptr<WordNetwork>& word_network);

/// A table for people, and the same as JSON.
std::string hearingTable(const std::vector<HearingScore>& scores);
std::string hearingJson(const std::vector<HearingScore>& scores);

}  // namespace mouthpiece
