#include <fmt/format.h>

#include <optional>

#include "corpus_tools/research/tuning/tuning.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct TuneArguments {
  bool quiet = false;
  std::filesystem::path corpus, output;
  TuningOptions tuning;
  bool voice = false;
  std::optional<std::size_t> folds;  ///< none: as many as is usual for what is tuned
};

std::string tuneVoice(Corpus& corpus, const TuneArguments& given) {
  TuningOptions options = kVoiceTuning;
  options.folds = given.folds.value_or(options.folds);
  options.always = given.tuning.always;
  options.jobs = given.tuning.jobs;
  CallbackBar bar("tuning", given.quiet);
  const TunedVoice tuned = tuneCorpusVoice(corpus, options, std::ref(bar));
  storeTuning(corpus, tuned);
  return "voice weights " + describeTuning(tuned) + "\n";
}

std::string tuneSelection(Corpus& corpus, const TuneArguments& given) {
  TuningOptions options = given.tuning;
  options.folds = given.folds.value_or(options.folds);
  CallbackBar bar("tuning", given.quiet);
  const TunedWeights tuned = tuneLatticeWeights(corpus, options, std::ref(bar));
  storeTuning(corpus, tuned);
  return "selection weights " + describeTuning(tuned) + "\n";
}

int runTune(const TuneArguments& given) {
  Corpus corpus = readCorpus(given.corpus, CorpusAudio::kLoad);
  const std::string found = given.voice ? tuneVoice(corpus, given) : tuneSelection(corpus, given);
  writeCorpus(given.output.empty() ? given.corpus : given.output, corpus);
  if (!given.quiet) printText(found);
  return kExitDone;
}

void addOptions(CLI::App& command, TuneArguments& options) {
  addCorpusArgument(command, options.corpus);
  command.add_option("--out,-o", options.output, "The corpus to write; default: the same file");
  checkOutputs(command, {{"--out", OutputKind::kCorpus}});
  command.add_option("--folds", options.folds,
                     "Parts to hold takes out in; half of them search, half judge; default: 6, with --voice 4");
  command.add_flag("--voice", options.voice, "The weights of the corpus voice's cuts, in place of the selection's");
  command.add_flag("--always", options.tuning.always, "Take the best found even where its gain may be chance");
  addJobsOption(command, options.tuning.jobs);
}

}  // namespace

Command tuneCommand() {
  return makeCommand("tune", "Learn the weights of the selection on the corpus' own takes",
                     "corpus tune mine.corpus --out tuned.corpus", addOptions, runTune);
}

}  // namespace mouthpiece
