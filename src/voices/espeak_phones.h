#pragma once

#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "phonetics/labels/labels_builder.h"

namespace mouthpiece {

/// What eSpeak tells while it speaks, in order. A phone's time is when its sound sets on: of a stop, the burst.
struct EspeakEvent {
  Seconds time = 0;
  std::string symbol;  ///< IPA; "" for a pause
  std::size_t word = 0;
};

/// One utterance's phones. `stresses`: of each syllabic sound in order, or empty when unknown.
/// - A symbol that stands for several phones ("ɔːɹ") is split, three fifths to the vowel.
/// - The silence that a stop holds before its burst becomes part of the stop, as everywhere in Mouthpiece; after a
///   pause, its last 60 ms.
/// - An l after a vowel, which eSpeak announces when it is over, takes a third of the two.
/// Throws InputError for a symbol that is not English.
std::vector<PhoneSegment> phonesFromEspeak(const std::vector<EspeakEvent>& events, const std::vector<int>& stresses,
                                           const AudioClip& audio);

/// The phones that an IPA symbol of eSpeak's English stands for. Throws InputError when it is unknown.
std::vector<Phone> phonesOfEspeakSymbol(std::string_view symbol);

/// The stress (0 to 2) of every syllabic sound in eSpeak's transcription of a text ("ðə tˈaɪm ɪz nˈaʊ": 0 1 0 1).
std::vector<int> stressesOfEspeakText(std::string_view transcription);

}  // namespace mouthpiece
