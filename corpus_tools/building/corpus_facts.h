#pragma once

#include <string>
#include <vector>

#include "units/file/corpus.h"

namespace mouthpiece {

/// What a corpus holds, for people and as JSON.
std::string corpusFactsText(const Corpus& corpus);
std::string corpusFactsJson(const Corpus& corpus);

/// One line each. Problems make a corpus unfit; remarks are worth knowing, as long gaps or a marker that jumps.
struct CorpusCheck {
  std::vector<std::string> problems;
  std::vector<std::string> remarks;
};

/// Of a corpus that could be read, with its audio: motion or sound shorter than the labels, no take, a neutral pose
/// that is no face; markers missing or jumping.
CorpusCheck checkCorpus(const Corpus& corpus);

}  // namespace mouthpiece
