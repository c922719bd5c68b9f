#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "corpus_tools/report/prompts.h"
#include "corpus_tools/sample/sample_corpus.h"
#include "hearing/alignment/pronouncer.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/corpus/prompt_sentences.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct PromptsArguments {
  bool quiet = false;
  std::size_t count = 55;
  std::filesystem::path grammar, text, running, pairs, lexicon, curve;
  std::string language = "en";
};

std::vector<Prompt> promptsFor(const std::vector<std::string>& sentences, const PromptsArguments& given) {
  const Language& language = languageOf(given.language);
  const Lexicon lexicon = lexiconFrom(given.lexicon, language);
  const Pronouncer pronouncer(&lexicon, language);
  ProgressBar bar("reading", sentences.size(), given.quiet);
  std::vector<Prompt> prompts;
  for (const std::string& sentence : sentences) {
    prompts.push_back(promptOf(sentence, pronouncer));
    bar.advance();
  }
  return prompts;
}

/// Of a table made by --pairs, or counted in text.
PairShares runningShares(const PromptsArguments& given) {
  if (given.running.extension() == ".csv") {
    if (!given.pairs.empty()) throw InputError("--pairs", "", "is written of text; --running is such a table already");
    return parsePairShares(readFile(given.running, kMostPromptBytes), given.running.string());
  }
  const PairShares shares = pairShares(promptsFor(sentencesOf(given.running, false), given));
  if (!given.pairs.empty()) writeFileAtomically(given.pairs, pairSharesToCsv(shares));
  return shares;
}

void writeCurve(const ChosenPrompts& chosen, const std::filesystem::path& file) {
  std::string text = chosen.shares.empty() ? "sentences,pairs,share\n" : "sentences,pairs,share,running share\n";
  for (std::size_t i = 0; i < chosen.pairs.size(); ++i) {
    text +=
        fmt::format("{},{},{:.4f}", i + 1, chosen.pairs[i], asReal(chosen.pairs[i]) / asReal(chosen.possible_pairs));
    text += chosen.shares.empty() ? "\n" : fmt::format(",{:.5f}\n", chosen.shares[i]);
  }
  writeFileAtomically(file, text);
}

/// The curve at a few counts, and a bar for each.
void noteCurve(const ChosenPrompts& chosen, bool quiet) {
  printNotice(fmt::format("phone pairs held, of {} in all sentences:", chosen.possible_pairs), quiet);
  const std::size_t last = chosen.pairs.size();
  for (std::size_t step = 1; step <= 10; ++step) {
    const std::size_t count = std::max<std::size_t>(1, step * last / 10);
    if (step > 1 && count == std::max<std::size_t>(1, (step - 1) * last / 10)) continue;
    const double share = asReal(chosen.pairs[count - 1]) / asReal(chosen.possible_pairs);
    const std::string running =
        chosen.shares.empty() ? "" : fmt::format("{:6.2f} % of running speech ", 100 * chosen.shares[count - 1]);
    printNotice(fmt::format("{:6} sentences {:5} {:5.1f} % {}{}", count, chosen.pairs[count - 1], 100 * share, running,
                            std::string(40 * chosen.pairs[count - 1] / chosen.possible_pairs, '#')),
                quiet);
  }
}

int runPrompts(const PromptsArguments& given) {
  if (given.grammar.empty() && given.text.empty()) {
    for (const auto& [option, file] : {std::pair("--running", &given.running), std::pair("--curve", &given.curve),
                                       std::pair("--lexicon", &given.lexicon)}) {
      if (!file->empty()) throw InputError(option, "", "needs --text or --grammar: sentences to choose from");
    }
    for (const TimeSentence& sentence : chooseTimeSentences(given.count)) printText(sentence.text() + "\n");
    return kExitDone;
  }
  const bool is_grammar = !given.grammar.empty();
  const std::vector<Prompt> prompts =
      promptsFor(sentencesOf(is_grammar ? given.grammar : given.text, is_grammar), given);
  std::optional<PairShares> weights;
  if (!given.running.empty()) weights = runningShares(given);
  const ChosenPrompts chosen = choosePrompts(prompts, given.count, weights ? &*weights : nullptr);
  for (const std::size_t sentence : chosen.sentences)
    printText(printable(prompts[sentence].text, kMostPromptBytes) + "\n");
  noteCurve(chosen, given.quiet);
  if (!given.curve.empty()) writeCurve(chosen, given.curve);
  return kExitDone;
}

void addOptions(CLI::App& command, PromptsArguments& options) {
  command.add_option("--count", options.count, "How many")->capture_default_str()->check(CLI::Range(1, 200000));
  auto* grammar = command.add_option("--grammar", options.grammar, "Choose from all sentences of a grammar file");
  command.add_option("--text", options.text, "Choose from a file with a sentence a line")->excludes(grammar);
  auto* running = command.add_option(
      "--running", options.running,
      "Running speech, a sentence a line, or a table of --pairs (.csv): a pair counts as often as it is met");
  command.add_option("--pairs", options.pairs, "Write how often each pair is met in --running (CSV)")->needs(running);
  command.add_option("--curve", options.curve, "Write the coverage curve (CSV)");
  checkOutputs(command, {{"--pairs"}, {"--curve"}});
  addLexiconOption(command, options.lexicon);
  addLanguageOption(command, options.language);
}

}  // namespace

Command promptsCommand() {
  return makeCommand("prompts",
                     "Sentences to record, chosen for the phone pairs they hold (default: of the time grammar)",
                     "corpus prompts --count 55\ncorpus prompts --text book.txt --count 200 --curve curve.csv",
                     addOptions, runPrompts);
}

}  // namespace mouthpiece
