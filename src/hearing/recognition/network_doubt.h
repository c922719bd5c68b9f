#pragma once

#include <filesystem>
#include <string>

#include "audio/audio_clip.h"
#include "hearing/alignment/forced_alignment.h"

namespace mouthpiece {

/// Hears the stretches of English words in `audio` of which the alignment is not sure once more, by a network
/// (hasWordNetwork), and puts how far they are believed then in place of what they were:
/// docs/theory/hearing/alignment.md#the-network-is-asked. Says what is wrong where it cannot; else "".
std::string judgeByNetwork(const std::filesystem::path& network, const AudioClip& audio, ForcedAlignment& alignment);

}  // namespace mouthpiece
