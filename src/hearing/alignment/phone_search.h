#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "hearing/alignment/phone_decoder.h"
#include "hearing/alignment/phone_row.h"

namespace mouthpiece {

inline constexpr Seconds kFrameStep = 0.010;

/// Where the codebooks are of the model's phones that a language's phone is heard as, in turn.
using HeardAs = std::map<Phone, std::vector<std::size_t>>;

/// What a silence costs, in nats.
struct Pauses {
  double each = 0;
  double inner = 0;        ///< more between two words
  double inner_frame = 0;  ///< each frame of such a one
};

/// The likeliest path through all `words` and the silences before, between and after them: the phones in order, without
/// gaps, from the first frame to the last; spans are not filled in. A phone is the model's after its
/// neighbour and before silence, which tells best what is said. `scores`: 0 is the best of a frame. Empty where the
/// frames are too few. Time and memory grow with the length alone: paths some 100 words beside the likeliest are given
/// up, and of a long text what lies 20 s back is settled. Throws InputError when there are more than 100,000 phones, 63
/// ways to say a word, or too many pairs of such ways. (L. R. Rabiner, Proceedings of the IEEE 77, 1989, section III
/// B.)
std::vector<DecodedPhone> likeliestPath(const WordWays& words, const HeardAs& heard, const TiedModel& model,
                                        const Pauses& pauses, Eigen::Index frames, const ScoresOf& scores);

}  // namespace mouthpiece
