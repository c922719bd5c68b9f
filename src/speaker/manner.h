#pragma once

#include "mouthpiece/speaker.h"
#include "synthesis/synthesis.h"

namespace mouthpiece {

struct Language;

/// The language of the lines. The usual voice becomes the one that speaks: the voice that was asked for; where that is
/// a language alone, "" for the language's first. Throws InputError for what nobody knows, and for a voice that was
/// asked for with a language that it does not speak.
const Language& languageFor(SpeakerOptions& options);
/// Throws InputError for options that no line can be made with: rates, overlaps, a page engine that is not there.
void expectUsable(const SpeakerOptions& options);
/// How lines are made that are asked for in `manner`; reads the files that it names. `model`, the corpus' own, is
/// pointed to. Throws InputError for numbers out of their ranges and files that do not hold what they should.
SynthesisOptions synthesisOf(const Manner& manner, const CurveModel& model);

}  // namespace mouthpiece
