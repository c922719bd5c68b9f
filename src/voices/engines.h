#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "phonetics/labels/labels_builder.h"
#include "phonetics/language/espeak_library.h"
#include "voices/voice.h"

namespace mouthpiece {

// What the table of voices (voice.cpp) makes its rows with: `name` is the engine's own name of the voice.

/// Festival as a child process: one run a line; the text is a file that its tokeniser reads as data. Where Festival is
/// not installed, hangs, fails or answers nonsense, Flite speaks in its place and says so.
std::unique_ptr<Voice> makeFestivalVoice(std::string_view name, const Language& language, const VoiceOptions& options);

/// One of the voices linked into the program through Flite's library: slt, rms, awb or kal16.
std::unique_ptr<Voice> makeFliteVoice(std::string_view name, const Language& language, const VoiceOptions& options);

/// eSpeak NG's formant synthesis, through its library. Quick; its breath is never quite the same twice. Throws
/// InputError when its data are not installed.
std::unique_ptr<Voice> makeEspeakVoice(std::string_view name, const Language& language, const VoiceOptions& options);

/// The corpus' own recordings; Festival's quickest voice, or Flite, says which phones. Throws InputError without a
/// corpus.
std::unique_ptr<Voice> makeCorpusVoice(std::string_view name, const Language& language, const VoiceOptions& options);

/// One utterance's phones. `stresses`: of each syllabic sound in order, or empty when unknown.
/// - A symbol that stands for several phones ("ɔːɹ") is split, three fifths to the vowel.
/// - The silence that a stop holds before its burst becomes part of the stop, as everywhere in Mouthpiece; after a
///   pause, its last 60 ms.
/// - An l after a vowel, which eSpeak announces when it is over, takes a third of the two.
/// Symbols that no row of IPA describes are said with a neutral mouth and added to `unknown`.
std::vector<PhoneSegment> phonesFromEspeak(const std::vector<EspeakEvent>& events, const std::vector<int>& stresses,
                                           const AudioClip& audio, const Language& language,
                                           std::vector<std::string>& unknown);

/// The phones that a symbol of eSpeak stands for: by the language's inventory and voice symbols, else by articulation.
/// None for one that no row of IPA describes.
std::vector<SpelledPhone> phonesOfEspeakSymbol(std::string_view symbol, const Language& language,
                                               std::vector<std::string>& unknown);

/// The stress (0 to 2) of every syllabic sound in eSpeak's transcription of a text ("ðə tˈaɪm ɪz nˈaʊ": 0 1 0 1).
std::vector<int> stressesOfEspeakText(std::string_view transcription, const Language& language = english());

}  // namespace mouthpiece
