#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "audio/audio_tags.h"
#include "phonetics/labels/speech_labels.h"

namespace mouthpiece {

/// Everything that is heard in a song or a line (VOCAL 4.1): pitch, notes and vibrato of its vowels, the vowels that
/// are really sung, the high-frequency energy of its consonants. `labels` may be nullptr: then notes
/// are those of syllables found by their loudness, and there are no consonants.
AudioTags hearTags(const AudioClip& clip, const SpeechLabels* labels);

/// The span of every vowel of the labels (a note that is tied over several vowels of one kind stays apart), in order.
std::vector<TimeSpan> vowelSpans(const SpeechLabels& labels);

/// What makes the tags doubtful, a line each, for the user: silence, clipping, other sounds under the voice, words that
/// are not what is sung. Empty when all is well. `labels` may be nullptr.
std::vector<std::string> soundWarnings(const AudioClip& clip, const SpeechLabels* labels, const AudioTags& tags);

/// tags.json (docs/formats/tags.md).
std::string formatTagsJson(const AudioTags& tags);

}  // namespace mouthpiece
