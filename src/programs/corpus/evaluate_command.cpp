#include "base/files.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kHoldOutSeed = 1;

struct EvaluateArguments {
  bool quiet = false, json = false, ablation = false;
  std::filesystem::path corpus, takes, lexicon, html, truth;
  std::size_t jobs = 0, folds = 0;
  double hold_out = 0;
  std::vector<std::size_t> learning_curve;
};

std::vector<CorpusTake> otherTakes(const EvaluateArguments& given, const Corpus& corpus) {
  BuildOptions options;
  options.lexicon = lexiconFrom(given.lexicon);
  options.jobs = given.jobs;
  CallbackBar bar("reading", given.quiet);
  CleanTakes clean = readTakesInto(corpus, given.takes, options, std::ref(bar));
  noteLeftOut(clean.left_out, given.quiet);
  return std::move(clean.takes);
}

Evaluation evaluate(const EvaluateArguments& given, Corpus corpus) {
  const EvaluationMethods methods = given.ablation ? ablationMethods : evaluationMethods;
  std::vector<CorpusTake> captured;
  if (!given.takes.empty()) captured = otherTakes(given, corpus);
  EvaluationOptions options;
  options.keep_curves = !given.html.empty();
  if (!given.truth.empty()) options.truth = readTruth(corpus, given.truth);
  CallbackBar bar("evaluating", given.quiet);
  options.progress = std::ref(bar);
  if (!given.learning_curve.empty()) {
    return learningCurve(corpus, given.learning_curve, selectionMethods, options);
  }
  if (given.folds > 0) return crossValidate(corpus, given.folds, methods, options);
  if (captured.empty()) captured = holdOut(corpus, given.hold_out, kHoldOutSeed);
  return evaluateCorpus(corpus, captured, methods, options);
}

int runEvaluate(const EvaluateArguments& given) {
  const Evaluation evaluation = evaluate(given, readCorpus(given.corpus));
  if (!given.html.empty()) writeFileAtomically(given.html, evaluationHtml(evaluation));
  printText(given.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
  return kExitDone;
}

void addOptions(CLI::App& command, EvaluateArguments& options) {
  addCorpusArgument(command, options.corpus);
  CLI::Option_group& which = *command.add_option_group("takes to compare with", "One of");
  which.add_option("--takes", options.takes, "Folder of takes that the corpus does not hold");
  which.add_option("--hold-out", options.hold_out, "Take this share of the takes out of the corpus (in memory)");
  which.add_option("--folds", options.folds, "Hold out every take once, in that many parts")
      ->check(CLI::Range(2, 1'000'000));
  which
      .add_option("--learning-curve", options.learning_curve,
                  "Every fifth take, by the material of that many others (10,25,50)")
      ->delimiter(',');
  which.require_option(1);
  command.add_flag("--ablation", options.ablation, "Viterbi with each cost and each trick off, one at a time");
  command.add_option("--html", options.html, "Also write a page with the curves of all takes over each other");
  command
      .add_option("--truth", options.truth,
                  "Folder of NAME.c3d: compare with this clean motion, not the corpus' takes (corpus sample --truth)")
      ->excludes("--takes");
  addLexiconOption(command, options.lexicon);
  addJobsOption(command, options.jobs);
  addJsonFlag(command, options.json);
}

}  // namespace

Command evaluateCommand() {
  return makeCommand("evaluate", "Resynthesise takes that are not in the corpus and compare with the capture",
                     "corpus evaluate mine.corpus --hold-out 0.1", addOptions, runEvaluate);
}

}  // namespace mouthpiece
