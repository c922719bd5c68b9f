#pragma once

#include <vector>

#include "units/corpus.h"

namespace mouthpiece {

/// Moves each take rigidly to where its mouth shapes lie in the other takes: a tracker without a jig places the same
/// face differently as the head turns (1.0 mm between the takes of grid_s1). What a take's markers should be is told by
/// its phones: marker offsets by take in a two-way layout, phone + take, by alternating means; then the rigid motion
/// that takes most of the offsets away, all markers weighing the same. Distances within the face stay. Returns the
/// largest move of a marker of the mean face for each take, mm.
std::vector<double> alignTakesByPhones(std::vector<CorpusTake>& takes);

}  // namespace mouthpiece
