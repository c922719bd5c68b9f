#include <fmt/format.h>

#include <optional>

#include "programs/corpus/command_support.h"
#include "corpus_tools/research/tuning/voice_tuning.h"
#include "corpus_tools/research/tuning/weight_tuning.h"

namespace mouthpiece {
namespace {

struct TuneCommand {
  bool quiet = false;
  std::filesystem::path corpus, output;
  TuningOptions tuning;
  bool voice = false;
  std::optional<std::size_t> folds;  ///< none: as many as is usual for what is tuned
};

std::string tuneVoice(Corpus& corpus, const TuneCommand& command) {
  TuningOptions options = kVoiceTuning;
  options.folds = command.folds.value_or(options.folds);
  options.always = command.tuning.always;
  options.jobs = command.tuning.jobs;
  CallbackBar bar("tuning", command.quiet);
  const TunedVoice tuned = tuneCorpusVoice(corpus, options, std::ref(bar));
  storeTuning(corpus, tuned);
  return "voice weights " + describeTuning(tuned) + "\n";
}

std::string tuneSelection(Corpus& corpus, const TuneCommand& command) {
  TuningOptions options = command.tuning;
  options.folds = command.folds.value_or(options.folds);
  CallbackBar bar("tuning", command.quiet);
  const TunedWeights tuned = tuneLatticeWeights(corpus, options, std::ref(bar));
  storeTuning(corpus, tuned);
  return "selection weights " + describeTuning(tuned) + "\n";
}

int runTune(const TuneCommand& command) {
  Corpus corpus = readCorpus(command.corpus, CorpusAudio::kLoad);
  const std::string found = command.voice ? tuneVoice(corpus, command) : tuneSelection(corpus, command);
  writeCorpus(command.output.empty() ? command.corpus : command.output, corpus);
  if (!command.quiet) printText(found);
  return kExitDone;
}

}  // namespace

void addTuneCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<TuneCommand>();
  CLI::App& tune = addCommand(app, chosen, "tune", "Learn the weights of the selection on the corpus' own takes",
                              "corpus tune mine.corpus --out tuned.corpus", options, runTune);
  addCorpusArgument(tune, options->corpus);
  tune.add_option("--out,-o", options->output, "The corpus to write; default: the same file");
  tune.add_option("--folds", options->folds,
                  "Parts to hold takes out in; half of them search, half judge; default: 6, with --voice 4");
  tune.add_flag("--voice", options->voice, "The weights of the corpus voice's cuts, in place of the selection's");
  tune.add_flag("--always", options->tuning.always, "Take the best found even where its gain may be chance");
  addJobsOption(tune, options->tuning.jobs);
}

}  // namespace mouthpiece
