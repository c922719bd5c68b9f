#include "base/files.h"
#include "programs/corpus/command_support.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kHoldOutSeed = 1;

struct EvaluateCommand {
  bool quiet = false, json = false, ablation = false;
  std::filesystem::path corpus, takes, lexicon, html, truth;
  std::size_t jobs = 0, folds = 0;
  double hold_out = 0;
  std::vector<std::size_t> learning_curve;
};

std::vector<CorpusTake> otherTakes(const EvaluateCommand& command, const Corpus& corpus) {
  BuildOptions options;
  options.lexicon = lexiconFrom(command.lexicon);
  options.jobs = command.jobs;
  CallbackBar bar("reading", command.quiet);
  CleanTakes clean = readTakesInto(corpus, command.takes, options, std::ref(bar));
  noteLeftOut(clean.left_out, command.quiet);
  return std::move(clean.takes);
}

Evaluation evaluate(const EvaluateCommand& command, Corpus corpus) {
  const EvaluationMethods methods = command.ablation ? ablationMethods : evaluationMethods;
  std::vector<CorpusTake> captured;
  if (!command.takes.empty()) captured = otherTakes(command, corpus);
  EvaluationOptions options;
  options.keep_curves = !command.html.empty();
  if (!command.truth.empty()) options.truth = readTruth(corpus, command.truth);
  CallbackBar bar("evaluating", command.quiet);
  options.progress = std::ref(bar);
  if (!command.learning_curve.empty()) {
    return learningCurve(corpus, command.learning_curve, selectionMethods, options);
  }
  if (command.folds > 0) return crossValidate(corpus, command.folds, methods, options);
  if (captured.empty()) captured = holdOut(corpus, command.hold_out, kHoldOutSeed);
  return evaluateCorpus(corpus, captured, methods, options);
}

int runEvaluate(const EvaluateCommand& command) {
  const Evaluation evaluation = evaluate(command, readCorpus(command.corpus));
  if (!command.html.empty()) writeFileAtomically(command.html, evaluationHtml(evaluation));
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
  which.add_option("--folds", options->folds, "Hold out every take once, in that many parts")
      ->check(CLI::Range(2, 1'000'000));
  which
      .add_option("--learning-curve", options->learning_curve,
                  "Every fifth take, by the material of that many others (10,25,50)")
      ->delimiter(',');
  which.require_option(1);
  evaluate.add_flag("--ablation", options->ablation, "Viterbi with each cost and each trick off, one at a time");
  evaluate.add_option("--html", options->html, "Also write a page with the curves of all takes over each other");
  evaluate
      .add_option("--truth", options->truth,
                  "Folder of NAME.c3d: compare with this clean motion, not the corpus' takes (corpus sample --truth)")
      ->excludes("--takes");
  addLexiconOption(evaluate, options->lexicon);
  addJobsOption(evaluate, options->jobs);
  addJsonFlag(evaluate, options->json);
}

}  // namespace mouthpiece
