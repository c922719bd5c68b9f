#pragma once

#include <cstddef>
#include <vector>

#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

class SqliteDatabase;

/// How many rows of each table a take promises.
struct LabelCounts {
  std::size_t phones = 0;
  std::size_t syllables = 0;
  std::size_t words = 0;
};

/// The labels of all takes, from the tables words, syllables and phones. Throws InputError unless every promise of
/// SpeechLabels holds and each take has as many rows as `counts` says.
std::vector<SpeechLabels> readLabels(SqliteDatabase& database, const std::vector<LabelCounts>& counts);

}  // namespace mouthpiece
