#pragma once

#include <string>

#include "audio/audio_clip.h"
#include "hearing/alignment/forced_alignment.h"
#include "hearing/recognition/word_network.h"

namespace mouthpiece {

/// Hears the stretches of English words in `audio` of which the alignment is not sure once more, by a network
/// where it is there, and puts how far they are believed then in place of what they were:
/// docs/theory/hearing/alignment.md#the-network-is-asked. Says what is wrong where it cannot; else "".
std::string judgeByNetwork(WordNetwork& network, const AudioClip& audio, ForcedAlignment& alignment);

}  // namespace mouthpiece
