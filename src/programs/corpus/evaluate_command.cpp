#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"
#include "corpus_tools/research/evaluation/evaluation.h"
#include "corpus_tools/research/evaluation/evaluation_methods.h"
#include "corpus_tools/research/evaluation/hearing_trials.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kHoldOutSeed = 1;

struct EvaluateArguments {
  bool quiet = false, json = false, ablation = false, hear = false, align = false;
  std::filesystem::path corpus, takes, lexicon, html, truth, adapted;
  std::size_t jobs = 0, folds = 0;
  double hold_out = 0;
  std::vector<std::size_t> learning_curve;
  std::uint64_t draw = 1;
  std::vector<std::string> rows;
  std::string unseen, hint, part, within, language = "en";
};

/// Of `methods` those that were asked for; all when none was.
EvaluationMethods onlyRows(const EvaluationMethods& methods, const std::vector<std::string>& rows) {
  if (rows.empty()) return methods;
  return [=](const Corpus& corpus, const UnitDatabase& database) {
    std::vector<EvaluationMethod> kept;
    for (EvaluationMethod& method : methods(corpus, database)) {
      const bool wanted =
          std::any_of(rows.begin(), rows.end(), [&](const std::string& row) { return method.name.starts_with(row); });
      if (wanted) kept.push_back(std::move(method));
    }
    if (kept.empty()) throw InputError("--rows", "", "names no row of the table");
    return kept;
  };
}

std::vector<CorpusTake> otherTakes(const EvaluateArguments& given, const Corpus& corpus) {
  BuildOptions options;
  options.language = &languageOf(given.language);
  options.lexicon = lexiconFrom(given.lexicon, *options.language);
  options.jobs = given.jobs;
  CallbackBar bar("reading", given.quiet);
  CleanTakes clean = readTakesInto(corpus, given.takes, options, std::ref(bar));
  noteLeftOut(clean.left_out, given.quiet);
  return std::move(clean.takes);
}

Unseen unseenOf(const std::string& what) {
  return what == "words" ? Unseen::kWords : what == "pairs" ? Unseen::kPairs : Unseen::kPhones;
}

/// "I/N".
UnseenOptions partOf(const std::string& text) {
  UnseenOptions limits;
  if (text.empty()) return limits;
  const std::size_t slash = text.find('/');
  const auto part = parseNumber(text.substr(0, slash));
  const auto parts = slash == std::string::npos ? std::nullopt : parseNumber(text.substr(slash + 1));
  constexpr double kMostParts = 1000;
  const bool is_one = part && parts && *part >= 1 && *part <= *parts && *parts <= kMostParts &&
                      *part == std::floor(*part) && *parts == std::floor(*parts);
  if (!is_one) throw InputError("--part", "", fmt::format("found {}; expected I/N, as 1/2", printable(text)));
  limits.part = static_cast<std::size_t>(*part) - 1;
  limits.parts = static_cast<std::size_t>(*parts);
  return limits;
}

/// The silences of a take, or what lies between them.
MeasuredStretches stretchesWithin(const CorpusTake& take, bool silence) {
  MeasuredStretches stretches;
  for (const LabelledPhone& phone : take.labels.phones) {
    if ((phone.phone == Phone::kSil) == silence) stretches.push_back(phone.span);
  }
  return stretches;
}

Evaluation evaluate(const EvaluateArguments& given, Corpus corpus, std::vector<HearingScore>& heard) {
  const EvaluationMethods all = given.hear             ? hearingMethods(heard, given.hint, sharedWordNetwork())
                                : given.ablation       ? ablationMethods
                                : given.unseen.empty() ? evaluationMethods
                                                       : backoffMethods;
  const EvaluationMethods methods = onlyRows(all, given.rows);
  std::vector<CorpusTake> captured;
  if (!given.takes.empty()) captured = otherTakes(given, corpus);
  EvaluationOptions options;
  options.keep_curves = !given.html.empty();
  if (!given.truth.empty()) options.truth = readTruth(corpus, given.truth);
  if (!given.within.empty()) {
    options.stretches = [silence = given.within == "silence"](const CorpusTake& take) {
      return stretchesWithin(take, silence);
    };
  }
  CallbackBar bar("evaluating", given.quiet);
  options.progress = std::ref(bar);
  if (!given.learning_curve.empty()) {
    options.draw = given.draw;
    std::optional<Corpus> large;
    if (!given.adapted.empty()) options.adapted_from = &large.emplace(readCorpus(given.adapted));
    return learningCurve(corpus, given.learning_curve, selectionMethods, options);
  }
  if (!given.unseen.empty())
    return evaluateUnseen(corpus, unseenOf(given.unseen), methods, options, partOf(given.part));
  if (given.folds > 0) return crossValidate(corpus, given.folds, methods, options);
  if (captured.empty()) captured = holdOut(corpus, given.hold_out, kHoldOutSeed);
  return evaluateCorpus(corpus, captured, methods, options);
}

int runAlignmentTrial(const EvaluateArguments& given) {
  CallbackBar bar("aligning", given.quiet);
  const std::shared_ptr<WordNetwork> network = sharedWordNetwork();
  const AlignmentTrial trial = tryAlignment(readCorpus(given.corpus, CorpusAudio::kLoad),
                                            {.jobs = given.jobs, .network = network.get(), .progress = std::ref(bar)});
  printText(given.json ? alignmentJson(trial) : alignmentTable(trial));
  return kExitDone;
}

int runEvaluate(const EvaluateArguments& given) {
  if (given.align) return runAlignmentTrial(given);
  std::vector<HearingScore> heard;
  const Evaluation evaluation = evaluate(given, readCorpus(given.corpus, CorpusAudio::kLoad), heard);
  if (!given.html.empty()) writeFileAtomically(given.html, evaluationHtml(evaluation));
  if (given.json && given.hear) {
    printText("{\"evaluation\": " + evaluationJson(evaluation) + ", \"hearing\": " + hearingJson(heard) + "}\n");
  } else {
    printText(given.json ? evaluationJson(evaluation) : evaluationTable(evaluation));
    if (given.hear) printText(hearingTable(heard));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, EvaluateArguments& options) {
  addCorpusArgument(command, options.corpus);
  CLI::Option_group& which = *command.add_option_group("takes to compare with", "One of");
  which.add_option("--takes", options.takes, "Folder of takes that the corpus does not hold");
  which.add_option("--hold-out", options.hold_out, "Take this share of the takes out of the corpus (in memory)");
  which.add_option("--folds", options.folds, "Hold out every take once, in that many parts")
      ->check(CLI::Range(2, 1'000'000));
  auto* curve = which
                    .add_option("--learning-curve", options.learning_curve,
                                "Every fifth take, by the material of that many others (10,25,50)")
                    ->delimiter(',');
  command.add_option("--draw", options.draw, "With --learning-curve: another random choice of those others")
      ->needs(curve)
      ->check(CLI::Range(1, 1'000'000));
  auto* unseen =
      which
          .add_option(
              "--unseen", options.unseen,
              "words|pairs|phones: take whole words, phones or pairs of them out, with all takes that say them, and "
              "measure the stretches that do")
          ->check(CLI::IsMember({"words", "pairs", "phones"}));
  which.add_flag("--align", options.align,
                 "No face: how well the takes' own words are found in their sound with noise under it, and how often a "
                 "text is doubted that is said, or is not");
  which.require_option(1);
  command
      .add_option("--adapt", options.adapted,
                  "With --learning-curve: this large corpus alone, too, and adapted to each size")
      ->needs(curve);
  command.add_flag("--ablation", options.ablation,
                   "From EDGE as published to the default one change a row, then the default with each cost and each "
                   "trick off");
  auto* hear = command.add_flag("--hear", options.hear,
                                "From what is heard in the takes' sound alone, beside their labels: the face, and the "
                                "errors of phones, visemes and words");
  hear->excludes("--ablation");
  command
      .add_option("--part", options.part,
                  "I/N: with --unseen only that part of them, so that what is chosen on one is judged on another")
      ->needs(unseen);
  command.add_option("--within", options.within, "silence|speech: measure only the frames of those stretches")
      ->check(CLI::IsMember({"silence", "speech"}))
      ->excludes(unseen);
  command.add_option("--hint", options.hint, "With --hear: words and phrases that are likely")->needs(hear);
  command.add_option("--rows", options.rows, "Only the rows whose names begin so (guided,EDGE)")->delimiter(',');
  command.add_option("--html", options.html, "Also write a page with the curves of all takes over each other");
  checkOutputs(command, {{"--html", OutputKind::kPage}});
  command
      .add_option("--truth", options.truth,
                  "Folder of NAME.c3d: compare with this clean motion, not the corpus' takes (corpus sample --truth)")
      ->excludes("--takes");
  addLexiconOption(command, options.lexicon);
  addLanguageOption(command, options.language);
  addJobsOption(command, options.jobs);
  addJsonFlag(command, options.json);
}

}  // namespace

Command evaluateCommand() {
  return makeCommand("evaluate", "Resynthesise takes that are not in the corpus and compare with the capture",
                     "corpus evaluate mine.corpus --hold-out 0.1", addOptions, runEvaluate);
}

}  // namespace mouthpiece
