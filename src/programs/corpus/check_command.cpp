#include <fmt/format.h>

#include "base/counted.h"
#include "base/errors.h"
#include "corpus_tools/building/corpus_facts.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"

namespace mouthpiece {
namespace {

struct CheckArguments {
  bool quiet = false;
  std::filesystem::path corpus;
};

int runCheck(const CheckArguments& given) {
  // The file first, row by row: reading it whole would stop at the first damage.
  const std::vector<std::string> damage = checkCorpus(given.corpus);
  if (damage.size() == 1) throw InputError(damage.front());
  for (const std::string& row : damage) printText("damage: " + row + "\n");
  if (!damage.empty()) {
    throw InputError(given.corpus.string(), "", fmt::format("found {} damaged places; expected none", damage.size()));
  }
  const CorpusCheck check = checkCorpus(readCorpus(given.corpus, CorpusAudio::kLoad));
  for (const std::string& problem : check.problems) printText("problem: " + problem + "\n");
  if (!given.quiet) {
    for (const std::string& remark : check.remarks) printText("remark: " + remark + "\n");
  }
  if (!check.problems.empty()) {
    throw InputError(given.corpus.string(), "",
                     fmt::format("found {}; expected none", counted(check.problems.size(), "problem")));
  }
  if (!given.quiet) printText(fmt::format("{}: sound\n", given.corpus.string()));
  return kExitDone;
}

void addOptions(CLI::App& command, CheckArguments& options) { addCorpusArgument(command, options.corpus); }

}  // namespace

Command checkCommand() {
  return makeCommand("check", "Read everything in a corpus and name what is suspicious", "corpus check mine.corpus",
                     addOptions, runCheck);
}

}  // namespace mouthpiece
