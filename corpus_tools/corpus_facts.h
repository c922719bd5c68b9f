#pragma once

#include <string>
#include <vector>

#include "units/corpus.h"

namespace mouthpiece {

/// What a corpus holds, for people and as JSON.
std::string corpusFactsText(const Corpus& corpus);
std::string corpusFactsJson(const Corpus& corpus);

/// What is suspicious in a corpus that could be read, one line each: motion or sound shorter than the labels, markers
/// missing or jumping, a neutral pose that is no face. `corpus` was read with its audio.
std::vector<std::string> corpusProblems(const Corpus& corpus);

}  // namespace mouthpiece
