#pragma once

#include <memory>
#include <optional>
#include <string>

#include "mouthpiece/corpus.h"
#include "mouthpiece/face.h"
#include "mouthpiece/live.h"
#include "mouthpiece/speaker.h"
#include "phonetics/text/lexicon.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {

class LiveEar;

/// What a speaker gives to its live streams; they share its corpus and face.
struct LiveSetup {
  SharedCorpus corpus;
  std::optional<SharedFace> face;
  SynthesisOptions synthesis;  ///< refers to the corpus alone
  std::string voice;
  std::optional<double> rate;
  std::optional<Lexicon> lexicon;
  const Language* language;
  SpeakerOptions::Hear hear = SpeakerOptions::Hear::kAuto;
};

/// What hears a stream's sound; `setup` outlives it. Throws InputError where words are wanted that nothing hears.
std::unique_ptr<LiveEar> makeLiveEar(const LiveSetup& setup, const LiveOptions& options);

/// Throws InputError for options out of range, and as LiveMotion does.
LiveStream makeLiveStream(LiveSetup setup, const LiveOptions& options);

}  // namespace mouthpiece
