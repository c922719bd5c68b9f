#pragma once

#include <string>
#include <vector>

#include "corpus_tools/takes/head_tracking.h"
#include "corpus_tools/takes/take_files.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// The head reference in the build log, so that takes from outside can be brought into the corpus' frame.
void logHeadReference(Corpus& corpus, const HeadReference& reference);
/// As logged; a corpus from elsewhere has at least its neutral pose.
HeadReference headReferenceOf(const Corpus& corpus);
/// The numbers of a reference as text: the same for the same reference.
std::string textOf(const HeadReference& reference);

/// "NAME: reason" a line.
std::string leftOutToText(const std::vector<LeftOutTake>& left_out);

}  // namespace mouthpiece
