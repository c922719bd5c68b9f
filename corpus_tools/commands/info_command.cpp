#include "corpus_tools/commands/command_support.h"
#include "corpus_tools/corpus_facts.h"

namespace mouthpiece {
namespace {

struct InfoCommand {
  bool quiet = false, json = false;
  std::filesystem::path corpus;
};

int runInfo(const InfoCommand& command) {
  const Corpus corpus = readCorpus(command.corpus);
  printText(command.json ? corpusFactsJson(corpus) : corpusFactsText(corpus));
  return kExitDone;
}

}  // namespace

void addInfoCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& info =
      addCommand(app, chosen, "info", "What a corpus holds", "corpus info mine.corpus --json", options, runInfo);
  addCorpusArgument(info, options->corpus);
  addJsonFlag(info, options->json);
}

}  // namespace mouthpiece
