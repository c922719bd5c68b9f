#pragma once

#include <cstddef>

#include "units/file/corpus.h"

namespace mouthpiece::samples {

/// The takes of `original` over and over, `times` times, under names of their own: a corpus of hours from one of
/// minutes. Motion is that of the original, which must outlive it; there is no sound. Each round's phones last a little
/// longer or shorter than the original's, as no one says a sentence twice alike: so takes are no copies for who looks
/// at labels.
Corpus repeatedCorpus(const Corpus& original, std::size_t times);

}  // namespace mouthpiece::samples
