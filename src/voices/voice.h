#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "audio/audio_clip.h"
#include "phonetics/labels/speech_labels.h"
#include "phonetics/language/language.h"
#include "phonetics/text/lexicon.h"
#include "units/selection/selection.h"

namespace mouthpiece {

class UnitDatabase;

/// A line as a voice spoke it: the sound and, on the same clock, its labels.
struct SpokenLine {
  AudioClip audio;
  SpeechLabels labels;
  std::vector<SelectedUnit> units;  ///< whose sound this is; empty unless a corpus spoke
  std::string text;                 ///< what was asked for, cleaned
  std::string voice;                ///< the voice that really spoke, e.g. "festival:cmu_us_slt_arctic_hts"
  std::string notice;  ///< a word to the user (e.g. "Festival is not installed: speaking with flite:slt"), or ""
};

/// What a voice has so far of a line: the labels of its next utterance, from 0 s on, before any sound of it; or sound
/// that follows.
struct SpokenPiece {
  SpeechLabels labels;  ///< none: this is sound
  AudioClip audio;      ///< none: these are labels
};

/// Turns text into speech. Not thread-safe.
class Voice {
 public:
  virtual ~Voice() = default;
  /// `text` is UTF-8 and hostile. Throws InputError for text with nothing to say in it, in a script the
  /// voice cannot read, or too long.
  virtual SpokenLine speak(std::string_view text) = 0;
  /// The same, given to `take` as it is known; all at once where an engine tells nothing before its end. What `take`
  /// throws ends it.
  virtual void speakInPieces(std::string_view text, const std::function<void(const SpokenPiece&)>& take);
};

struct VoiceOptions {
  /// Pronunciations that go before the voice's own; nullptr for none. The Festival voices honour it. Kept alive by the
  /// caller.
  const Lexicon* lexicon = nullptr;
  /// What "corpus" speaks with; nullptr: there is no such voice. Kept alive by the caller.
  const UnitDatabase* corpus = nullptr;
  SelectionOptions selection = {};  ///< of the corpus voice's units
  std::optional<double> rate = {};  ///< corpus voice: 1 as fast as Festival would speak; none: as the recordings do
};

/// A voice that can be asked for.
struct VoiceRow {
  std::string_view name;      ///< "festival:kal_diphone": an engine and its own name of the voice; or one name
  std::string_view what;      ///< for a list of voices
  std::string_view language;  ///< that it speaks: a tag of languageOf()
  /// `own_name`: what follows the colon.
  std::unique_ptr<Voice> (*make)(std::string_view own_name, const Language& language, const VoiceOptions& options);
};

/// All that there are, the default one first.
std::span<const VoiceRow> voices();
/// Their names.
std::vector<std::string> knownVoices();

/// The language that a voice speaks. Throws InputError as makeVoice does.
const Language& languageOfVoice(std::string_view name);
/// The first voice of the table that speaks a language, else eSpeak NG's. Throws InputError for one that nobody speaks.
std::string voiceFor(const Language& language);

/// The voice of the table that speaks a language as a region does: "espeak:en-gb" for "en-GB"; nullopt where the
/// language's own voice is the region's, or none is.
std::optional<std::string> voiceOfRegion(std::string_view tag);

/// Makes the voice of that name; "espeak:" and any language of eSpeak NG's is one. A missing Festival falls back on
/// Flite, said in SpokenLine::notice. Throws InputError for an unknown name, listing the known ones.
std::unique_ptr<Voice> makeVoice(std::string_view name, const VoiceOptions& options = {});

/// Whether the program `festival` can be found on the PATH.
bool festivalAvailable();

}  // namespace mouthpiece
