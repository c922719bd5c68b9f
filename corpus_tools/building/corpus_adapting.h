#pragma once

#include <cstddef>

#include "units/file/corpus.h"

namespace mouthpiece {

/// `large`, which somebody else spoke, brought to the person of `own` (docs/theory/corpus_tools/adapting.md): the takes
/// of `own`, and after them those of `large`, called LARGE/TAKE, their motion mapped into this person's face and
/// without their sound; a trajectory model with the other's dynamics and this person's poses. How far the person is
/// believed is decided on the person's own takes; build_log["adapted"] tells. Without takes in `own` only size and axes
/// are fitted. The result loads motion from both arguments, which must outlive it. Throws InputError where `large` has
/// no trajectory model or other markers than `own`, or the layout has no lips.
Corpus adaptCorpus(const Corpus& large, const Corpus& own, std::size_t jobs = 0);

}  // namespace mouthpiece
