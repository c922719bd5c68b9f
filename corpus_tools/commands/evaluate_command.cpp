#include "corpus_tools/commands/command_support.h"
#include "corpus_tools/evaluation.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kHoldOutSeed = 1;

struct EvaluateCommand {
  bool quiet = false, json = false;
  std::filesystem::path corpus, takes, lexicon;
  std::size_t jobs = 0;
  double hold_out = 0;
};

int runEvaluate(const EvaluateCommand& command) {
  Corpus corpus = readCorpus(command.corpus);
  std::vector<CorpusTake> captured;
  if (!command.takes.empty()) {
    BuildOptions options;
    options.lexicon = lexiconFrom(command.lexicon);
    options.jobs = command.jobs;
    CallbackBar bar("reading", command.quiet);
    CleanTakes clean = readTakesInto(corpus, command.takes, options, std::ref(bar));
    noteLeftOut(clean.left_out, command.quiet);
    captured = std::move(clean.takes);
  } else {
    captured = holdOut(corpus, command.hold_out, kHoldOutSeed);
  }
  Evaluation evaluation;
  {
    CallbackBar bar("evaluating", command.quiet);
    evaluation = evaluateCorpus(corpus, captured, std::ref(bar));
  }
  printText(command.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return kExitDone;
}

}  // namespace

void addEvaluateCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<EvaluateCommand>();
  CLI::App& evaluate =
      addCommand(app, chosen, "evaluate", "Resynthesise takes that are not in the corpus and compare with the capture",
                 "corpus evaluate mine.corpus --hold-out 0.1", options, runEvaluate);
  addCorpusArgument(evaluate, options->corpus);
  CLI::Option_group& which = *evaluate.add_option_group("takes to compare with", "One of");
  which.add_option("--takes", options->takes, "Folder of takes that the corpus does not hold");
  which.add_option("--hold-out", options->hold_out, "Take this share of the takes out of the corpus (in memory)");
  which.require_option(1);
  addLexiconOption(evaluate, options->lexicon);
  addJobsOption(evaluate, options->jobs);
  addJsonFlag(evaluate, options->json);
}

}  // namespace mouthpiece
