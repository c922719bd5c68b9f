#include <fmt/format.h>

#include "corpus_tools/building/corpus_adapting.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

struct AdaptArguments {
  bool quiet = false;
  std::filesystem::path corpus, own, output;
  std::size_t jobs = 0;
};

int runAdapt(const AdaptArguments& given) {
  const Corpus large = readCorpus(corpusFile(given.corpus), CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  const Corpus own = readCorpus(given.own, CorpusAudio::kSkip, CorpusMotion::kOnDemand);
  const Corpus adapted = adaptCorpus(large, own, given.jobs);
  writeCorpus(given.output, adapted);
  if (!given.quiet) printText(fmt::format("{}: {}\n", given.output.string(), adapted.build_log.at("adapted")));
  return kExitDone;
}

void addOptions(CLI::App& command, AdaptArguments& options) {
  addCorpusArgument(command, options.corpus);
  command.add_option("--to", options.own, "The small corpus of the person that it shall speak as")->required();
  command.add_option("--out,-o", options.output, "The corpus to write")->required();
  checkOutputs(command, {{"--out", OutputKind::kCorpus}});
  addJobsOption(command, options.jobs);
}

}  // namespace

Command adaptCommand() {
  return makeCommand("adapt", "A large corpus brought to a person of whom there are a few takes",
                     "corpus adapt sample.corpus --to mine.corpus --out adapted.corpus", addOptions, runAdapt);
}

}  // namespace mouthpiece
