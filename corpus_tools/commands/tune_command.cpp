#include <fmt/format.h>

#include "corpus_tools/commands/command_support.h"
#include "corpus_tools/evaluation/weight_tuning.h"

namespace mouthpiece {
namespace {

struct TuneCommand {
  bool quiet = false;
  std::filesystem::path corpus, output;
  TuningOptions tuning;
};

int runTune(const TuneCommand& command) {
  Corpus corpus = readCorpus(command.corpus, CorpusAudio::kLoad);
  TunedWeights tuned;
  {
    CallbackBar bar("tuning", command.quiet);
    tuned = tuneLatticeWeights(corpus, command.tuning, std::ref(bar));
  }
  storeTuning(corpus, tuned);
  writeCorpus(command.output.empty() ? command.corpus : command.output, corpus);
  if (!command.quiet) printText("selection weights " + describeTuning(tuned) + "\n");
  return kExitDone;
}

}  // namespace

void addTuneCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<TuneCommand>();
  CLI::App& tune = addCommand(app, chosen, "tune", "Learn the weights of the selection on the corpus' own takes",
                              "corpus tune mine.corpus --out tuned.corpus", options, runTune);
  addCorpusArgument(tune, options->corpus);
  tune.add_option("--out,-o", options->output, "The corpus to write; default: the same file");
  tune.add_option("--folds", options->tuning.folds, "Parts to hold takes out in; half of them search, half judge")
      ->capture_default_str();
  tune.add_flag("--always", options->tuning.always, "Take the best found even where its gain may be chance");
  addJobsOption(tune, options->tuning.jobs);
}

}  // namespace mouthpiece
