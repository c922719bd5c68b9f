#include <fmt/format.h>

#include "base/errors.h"
#include "corpus_tools/building/corpus_facts.h"
#include "programs/corpus/command_support.h"

namespace mouthpiece {
namespace {

struct CheckCommand {
  bool quiet = false;
  std::filesystem::path corpus;
};

int runCheck(const CheckCommand& command) {
  // The file first, row by row: reading it whole would stop at the first damage.
  const std::vector<std::string> damage = checkCorpus(command.corpus);
  if (damage.size() == 1) throw InputError(damage.front());
  for (const std::string& row : damage) printText("damage: " + row + "\n");
  if (!damage.empty()) {
    throw InputError(command.corpus.string(), "", fmt::format("found {} damaged places; expected none", damage.size()));
  }
  const CorpusCheck check = checkCorpus(readCorpus(command.corpus, CorpusAudio::kLoad));
  for (const std::string& problem : check.problems) printText("problem: " + problem + "\n");
  if (!command.quiet) {
    for (const std::string& remark : check.remarks) printText("remark: " + remark + "\n");
  }
  if (!check.problems.empty()) {
    throw InputError(command.corpus.string(), "",
                     fmt::format("found {} problems; expected none", check.problems.size()));
  }
  if (!command.quiet) printText(fmt::format("{}: sound\n", command.corpus.string()));
  return kExitDone;
}

}  // namespace

void addCheckCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<CheckCommand>();
  addCorpusArgument(addCommand(app, chosen, "check", "Read everything in a corpus and name what is suspicious",
                               "corpus check mine.corpus", options, runCheck),
                    options->corpus);
}

}  // namespace mouthpiece
