#include "speaker/manner.h"

#include <fmt/format.h>

#include <array>

#include "base/errors.h"
#include "expression/expression.h"
#include "phonetics/language/language.h"
#include "speaker/shared_files.h"
#include "synthesis/line_edits.h"
#include "synthesis/speech_dials.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

StyleSignal signalOf(const StyleParameter& parameter, const DialRow& dial) {
  if (parameter.automatic) throw InputError(fmt::format("found auto for {}; expected a number or a file", dial.name));
  if (!parameter.file.empty()) return readStyleSignal(parameter.file, dial.most, dial.least);
  const double value = parameter.constant.value_or(dial.usual);
  if (!(value >= dial.least && value <= dial.most))
    throw InputError(fmt::format("found {} for {}; expected {} to {}", value, dial.name, dial.least, dial.most));
  return StyleSignal(value);
}

SpeechDials dialsOf(const Manner& manner) {
  const std::array given{&manner.strength, &manner.jaw, &manner.lips, &manner.hold, &manner.lead_ms, &manner.smooth_ms};
  static_assert(given.size() == kSpeechDials.size());
  SpeechDials dials;
  for (std::size_t i = 0; i < given.size(); ++i) dials.*kSpeechDials[i].signal = signalOf(*given[i], kSpeechDials[i]);
  return dials;
}

ExpressionOptions expressionOf(const Manner& manner) {
  ExpressionOptions expression;
  static_assert(static_cast<int>(Manner::UpperFace::kBest) == static_cast<int>(UpperFaceSource::kBest));
  expression.upper_face = static_cast<UpperFaceSource>(manner.upper_face);
  expression.gaze = manner.gaze;
  expression.head = manner.head_motion;
  if (!manner.mood.empty()) expression.mood = moodOf(manner.mood);
  expression.seed = manner.seed;
  return expression;
}

StyleWish wishOf(const StyleParameter& parameter, std::string_view name, double largest) {
  if (parameter.constant && !(*parameter.constant >= 0 && *parameter.constant <= largest))
    throw InputError(fmt::format("found {} for {}; expected 0 to {}", *parameter.constant, name, largest));
  StyleWish wish;
  wish.automatic = parameter.automatic;
  if (parameter.constant) wish.given = StyleSignal(*parameter.constant);
  if (!parameter.file.empty()) wish.given = readStyleSignal(parameter.file, largest);
  return wish;
}

}  // namespace

void expectUsable(const SpeakerOptions& options) {
  if (options.page_engine) pageEngineFile();
  const Manner& manner = options.manner;
  constexpr double kLeastRate = 23.97;  // film on video: 23.976
  if (!(manner.frame_rate_hz >= kLeastRate && manner.frame_rate_hz <= 240))
    throw InputError(fmt::format("found {} frames a second; expected 23.976 to 240", manner.frame_rate_hz));
  if (!(manner.overlap_ms >= 0 && manner.overlap_ms <= 1000))
    throw InputError(fmt::format("found an overlap of {} ms; expected 0 to 1000", manner.overlap_ms));
  const std::string& voice = options.voice.empty() ? options.usual_voice : options.voice;
  if (options.rate && voice != "corpus")
    throw InputError(
        fmt::format("found a speaking rate for the voice {}; expected the voice corpus with it", printable(voice)));
  if (options.rate && !(*options.rate >= 0.4 && *options.rate <= 2.5))
    throw InputError(fmt::format("found a speaking rate of {}; expected 0.4 to 2.5", *options.rate));
}

const Language& languageFor(SpeakerOptions& options) {
  std::string& speaks = options.usual_voice;
  const bool is_default = options.voice.empty() && speaks == SpeakerOptions().usual_voice;
  if (!options.voice.empty()) speaks = options.voice;
  const Language& spoken = languageOfVoice(speaks);
  if (options.language.empty()) return spoken;
  const Language& language = languageOf(options.language);
  if (&spoken == &language) {
    if (is_default) speaks = voiceOfRegion(options.language).value_or(speaks);
    return language;
  }
  if (!options.voice.empty())
    throw InputError(fmt::format("found the voice {} for text in {}; expected {}", printable(options.voice),
                                 language.name, voiceFor(language)));
  speaks.clear();
  return language;
}

SynthesisOptions synthesisOf(const Manner& manner, const CurveModel& model) {
  const bool as_published = manner.method == Manner::Method::kEdge;
  SynthesisOptions options = as_published ? edgeAsPublished() : SynthesisOptions();
  options.frame_rate_hz = manner.frame_rate_hz;
  options.overlap_ms = manner.overlap_ms;
  if (!as_published) {
    options.selection.method =
        manner.method == Manner::Method::kGreedy ? SelectionMethod::kGreedy : SelectionMethod::kViterbi;
    options.selection.units = manner.units == Manner::Units::kPaper ? UnitScales::kPaper : UnitScales::kAny;
  }
  switch (manner.blend) {
    case Manner::Blend::kSmooth:
      options.blend = BlendKind::kSmooth;
      break;
    case Manner::Blend::kLinear:
      options.blend = BlendKind::kLinear;
      break;
    case Manner::Blend::kCosine:
      options.blend = BlendKind::kCosine;
      break;
    case Manner::Blend::kExponential:
      options.blend = BlendKind::kExponential;
      break;
  }
  CurveOptions& curves = options.curves;
  if (manner.style != Manner::Style::kCaptured)
    curves.alone = manner.style == Manner::Style::kSing ? CurveStyle::kSing : CurveStyle::kSpeech;
  if (manner.method == Manner::Method::kCurves && !curves.alone) curves.alone = CurveStyle::kSpeech;
  curves.ma = wishOf(manner.ma, "Ma", 1);
  curves.ps = wishOf(manner.ps, "Ps", 1);
  curves.ja = wishOf(manner.ja, "Ja", kLargestArticulation);
  curves.li = wishOf(manner.li, "Li", kLargestArticulation);
  options.dials = dialsOf(manner);
  options.expression = expressionOf(manner);
  if (!manner.edits.empty()) options.edits = readLineEdits(manner.edits);
  // The paper has no curves: a pair that was not captured has a stand-in, or is refused.
  curves.fill_gaps = manner.backoff == Manner::Backoff::kVocal && !as_published;
  curves.model = &model;
  return options;
}

}  // namespace mouthpiece
