// The options that say how lines are performed, the same for one and for many.
#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "base/text_numbers.h"
#include "phonetics/language/language.h"
#include "programs/synth/commands.h"
#include "speaker/manner.h"
#include "voices/voice.h"

namespace mouthpiece {
namespace {

struct Range {
  double least, most;
};

/// A number over time: a number, "auto" where the sound can tell, or a file.
void addStyleParameter(CLI::App& app, const std::string& option, StyleParameter& value, Range range, bool may_be_auto,
                       const std::string& help) {
  app.add_option_function<std::string>(
      option,
      [&value, option, range, may_be_auto](const std::string& text) {
        value = {};
        if (may_be_auto && text == "auto") {
          value.automatic = true;
        } else if (const std::optional<double> number = parseNumber(text)) {
          if (!(*number >= range.least && *number <= range.most))
            throw InputError(option, "", fmt::format("found {}; expected {} to {}", text, range.least, range.most));
          value.constant = number;
        } else {
          std::error_code error;
          if (!std::filesystem::exists(text, error))
            throw InputError(option, "",
                             fmt::format("found '{}'; expected {} to {}{}, or a file of time_s,value", printable(text),
                                         range.least, range.most, may_be_auto ? ", auto" : ""));
          value.file = text;
        }
      },
      help);
}

}  // namespace

SpeakerOptions speakerOf(const SharedOptions& options) {
  SpeakerOptions wanted = options.speaker;
  if (isUsersDefault("--voice")) {
    wanted.usual_voice = std::exchange(wanted.voice, {});
  } else if (!wanted.voice.empty() && isUsersDefault("--language")) {
    wanted.language.clear();
  }
  return wanted;
}

std::string givingWay(const SpeakerOptions& options) {
  SpeakerOptions settled = options;
  const Language& language = languageFor(settled);
  if (!settled.usual_voice.empty() || options.usual_voice == SpeakerOptions().usual_voice) return "";
  try {
    return fmt::format("{} speaks no {}: {} does", options.usual_voice, language.name, voiceFor(language));
  } catch (const InputError&) {  // nobody does: told of the lines that are to be spoken
    return "";
  }
}

bool needsFace(const SpeakerOptions& options, const std::vector<std::filesystem::path>& files) {
  return std::any_of(files.begin(), files.end(), [&](const std::filesystem::path& file) {
    std::error_code error;
    if (!file.has_filename() || std::filesystem::is_directory(file, error))
      throw InputError(file.string(), "",
                       "names a folder; expected a file, as in folder/talk.glb (--out takes a folder)");
    const Format& format = formatOf(file);
    return format.needs_face || (format.has_arkit && !options.face.empty());
  });
}

FilesRead filesReadBy(const SpeakerOptions& options) {
  const Manner& manner = options.manner;
  FilesRead read;
  const std::vector<std::pair<const std::filesystem::path&, const char*>> named{
      {options.corpus, "--corpus"},       {options.face, "--face"},           {options.lexicon, "--lexicon"},
      {manner.edits, "--edits"},          {manner.ma.file, "--ma"},           {manner.ps.file, "--ps"},
      {manner.ja.file, "--ja"},           {manner.li.file, "--li"},           {manner.strength.file, "--strength"},
      {manner.jaw.file, "--jaw"},         {manner.lips.file, "--lips"},       {manner.hold.file, "--hold"},
      {manner.lead_ms.file, "--lead-ms"}, {manner.smooth_ms.file, "--smooth"}};
  for (const auto& [file, option] : named) read.add(file, option);
  constexpr std::string_view kWeights = ".json";  // a strength may stand behind it
  if (const std::size_t at = manner.mood.rfind(kWeights); at != std::string::npos)
    read.add(manner.mood.substr(0, at + kWeights.size()), "--mood");
  return read;
}

void addSharedOptions(CLI::App& app, SharedOptions& options) {
  SpeakerOptions& speaker = options.speaker;
  Manner& manner = speaker.manner;
  app.add_option(
      "--corpus", speaker.corpus,
      "Corpus to learn and take the movements from (default: sample, the sample corpus; clock: its 55 sentences of the "
      "paper's grammar alone)");
  app.add_option("--face", speaker.face, "Face to move, made by `retarget fit` (default: the sample face)");
  std::string voices;
  for (const std::string& name : voiceNames()) voices += (voices.empty() ? "" : " ") + name;
  app.add_option("--voice", speaker.voice, voices)->default_str(speaker.usual_voice);
  app.add_option(
      "--language", speaker.language,
      "Language of the text, the recording, its labels and the lexicon, as BCP 47: de, es, fr, it, pt, pt-BR, "
      "pl, nl, ja, zh, or any other of eSpeak NG's (default: the voice's)");
  app.add_option("--rate", speaker.rate,
                 "With --voice corpus: speaking rate, 1 as fast as Festival would speak (default: as it was recorded)")
      ->check(CLI::Range(0.4, 2.5));
  app.add_option("--lexicon", speaker.lexicon,
                 "Pronunciations that go before the voice's own: words in ARPAbet, IPA or X-SAMPA");
  using Hear = SpeakerOptions::Hear;
  addChoice(app, "--hear", speaker.hear, {{"auto", Hear::kAuto}, {"words", Hear::kWords}, {"phones", Hear::kPhones}},
            "A recording without its words: recognise words of US English, phones of any language, or words where they "
            "fit what is heard and phones elsewhere (default: auto; of sound that is streamed auto is phones). One "
            "with its words: with `phones` they are "
            "believed by their phones alone, several times as fast");
  app.add_option("--fps", manner.frame_rate_hz, "Frames a second, 23.976 to 240")->capture_default_str();
  using Method = Manner::Method;
  addChoice(
      app, "--method", manner.method,
      {{"guided", Method::kGuided}, {"greedy", Method::kGreedy}, {"edge", Method::kEdge}, {"curves", Method::kCurves}},
      "What moves the face. guided: a movement predicted by what the corpus taught, with the fast detail of "
      "captured fragments on it and lips brought to touch; greedy: captured fragments, the longest each time; "
      "edge: captured fragments as EDGE (2004) has it, nothing else; curves: VOCAL's curves alone (default: "
      "guided)");
  addChoice(app, "--select", manner.method, {{"greedy", Method::kGreedy}, {"viterbi", Method::kGuided}},
            "An earlier name of --method; viterbi is guided");
  addChoice(app, "--units", manner.units, {{"any", Manner::Units::kAny}, {"paper", Manner::Units::kPaper}},
            "any: every fragment; paper: sentences, words, syllables and diphones (default: any; of --method edge "
            "always paper)");
  addChoice(app, "--blend", manner.blend,
            {{"smooth", Manner::Blend::kSmooth},
             {"linear", Manner::Blend::kLinear},
             {"cosine", Manner::Blend::kCosine},
             {"exponential", Manner::Blend::kExponential}},
            "How neighbours fade into each other (default: smooth)");
  app.add_option("--overlap-ms", manner.overlap_ms, "Blend between two fragments; guided takes up to twice that")
      ->capture_default_str();
  addChoice(
      app, "--backoff", manner.backoff,
      {{"vocal", Manner::Backoff::kVocal}, {"viseme", Manner::Backoff::kViseme}, {"none", Manner::Backoff::kNone}},
      "A phone pair the corpus lacks: vocal takes the nearest pair by viseme class, moved to where the corpus "
      "predicts the lips, and draws VOCAL's curves where there is none or with --method greedy; viseme takes "
      "the nearest pair as it is; none refuses (default: vocal)");
  addChoice(app, "--style", manner.style, {{"speech", Manner::Style::kSpeech}, {"sing", Manner::Style::kSing}},
            "Make all of the motion from curves, as spoken or as sung (default: what --method says)");
  addStyleParameter(app, "--ma", manner.ma, {0, 1}, true, "Melodic accent, 0 to 1, auto, or a file of time_s,value");
  addStyleParameter(app, "--ps", manner.ps, {0, 1}, true, "Pitch sensitivity, 0 to 1, auto, or a file of time_s,value");
  addStyleParameter(app, "--ja", manner.ja, {0, 2}, false, "Jaw, 0 to 2 (1 as the actor), or a file of time_s,value");
  addStyleParameter(app, "--li", manner.li, {0, 2}, false, "Lips, 0 to 2 (1 as the actor), or a file of time_s,value");
  addStyleParameter(app, "--strength", manner.strength, {0, 2}, false,
                    "All movement of the mouth, 0 to 2 (1 as it is), or a file of time_s,value");
  addStyleParameter(app, "--jaw", manner.jaw, {0, 2}, false, "Of it what goes with the jaw, likewise");
  addStyleParameter(app, "--lips", manner.lips, {0, 2}, false, "Of it the rest, likewise");
  addStyleParameter(app, "--hold", manner.hold, {0, 1}, false,
                    "How long the pose of each phone is held, 0 (as it is) to 1, or a file");
  addStyleParameter(app, "--lead-ms", manner.lead_ms, {-200, 200}, false,
                    "How much earlier than the sound the mouth moves, -200 to 200, or a file");
  addStyleParameter(app, "--smooth", manner.smooth_ms, {0, 200}, false,
                    "Smoothing in time, 0 to 200 ms (a Gaussian's standard deviation), or a file");
  using UpperFace = Manner::UpperFace;
  addChoice(app, "--upper-face", manner.upper_face,
            {{"mouth", UpperFace::kMouth},
             {"best", UpperFace::kBest},
             {"captured", UpperFace::kCaptured},
             {"rules", UpperFace::kRules}},
            "What moves lids and brows. mouth: brows by the fragments that move the mouth, lids at rest; captured: "
            "stretches of the capture "
            "chosen for them by stress, phrase and pause; rules: blinks and brows drawn at random; best: captured "
            "where the corpus' lids move, else rules (default: mouth)");
  app.add_flag("--gaze", manner.gaze, "The eyes move");
  app.add_flag("--head-motion", manner.head_motion, "The head sways and nods");
  app.add_option("--mood", manner.mood,
                 "A pose over all of the line, the lips' contacts kept: anger, contempt, disgust, joy, sadness or "
                 "surprise, or a file of ARKit's weights (.json); :0.5 after it for half of it");
  app.add_option("--seed", manner.seed, "Of blinks, brows, gaze and head: another number, another draw")
      ->capture_default_str();
  app.add_option("--edits", manner.edits,
                 "An animator's changes: edits.json, as the page saves it, or curves.json handed back");
  addJsonFlag(app, options.json);
}

}  // namespace mouthpiece
