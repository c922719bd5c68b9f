#pragma once

#include <string>

#include "hearing/alignment/forced_alignment.h"
#include "hearing/alignment/pronouncer.h"
#include "hearing/alignment/samples_to_hear.h"
#include "hearing/network/word_network.h"

namespace mouthpiece {

/// Hears the stretches of English words of which the alignment is not sure once more, by a network where it is there,
/// and puts how far they are believed then in place of what they were:
/// docs/theory/hearing/doubt.md#the-network-is-asked. `pronouncer` says what is heard. Says what is wrong where it
/// cannot; else "".
std::string judgeByNetwork(WordNetwork& network, const Pronouncer& pronouncer, const SamplesToHear& to_hear,
                           ForcedAlignment& alignment);

}  // namespace mouthpiece
