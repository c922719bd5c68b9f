#pragma once

#include <vector>

#include "hearing/recognition/stretch_hearing.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Puts P, B and M that are heard without words among the `phones` of words where these have none, and how well they
/// fit among `fits`, which has one of each.
void keepClosings(const StretchHearing& hearing, std::vector<LabelledPhone>& phones, std::vector<double>& fits);

/// Puts the phones that are heard without words in place of those of each word of `labels` that is more likely wrong
/// than right, and how sure they are among `fits`. `word_odds`: of each word, the logarithm of the odds that it is
/// wrong.
void hearUnlikelyWords(const StretchHearing& hearing, const std::vector<double>& word_odds, SpeechLabels& labels,
                       std::vector<double>& fits);

}  // namespace mouthpiece
