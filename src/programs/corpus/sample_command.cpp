#include <fmt/format.h>

#include "corpus_tools/sample/sample_corpus.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"

namespace mouthpiece {
namespace {

struct SampleArguments {
  bool quiet = false;
  std::filesystem::path folder, truth, sentences;
  SampleOptions sample;
};

int runSample(const SampleArguments& given) {
  SampleOptions sample = given.sample;
  if (!given.truth.empty()) sample.truth_folder = given.truth;
  if (!given.sentences.empty()) sample.sentences = readSentences(given.sentences);
  SampleSummary summary;
  {
    CallbackBar bar("performing", given.quiet);
    summary = writeSampleCorpus(given.folder, sample, std::ref(bar));
  }
  if (!summary.notice.empty()) printNotice(summary.notice, given.quiet);
  if (!given.quiet) {
    printText(fmt::format("{} takes, {:.1f} s, {:.2f} % of the samples hidden: {}\n", summary.takes, summary.speech_s,
                          100 * summary.missing_share, given.folder.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, SampleArguments& options) {
  command.add_option("folder", options.folder, "Where the takes go")->required();
  command.add_option("--truth", options.truth, "Folder for the clean motion, head still");
  command.add_option("--sentences", options.sentences,
                     "What to say, one sentence a line; default: 55 of the time grammar");
  command.add_option("--seed", options.sample.seed, "Of head motion, noise and gaps")->capture_default_str();
  command.add_option("--voice", options.sample.voice, "Who speaks")->capture_default_str();
  addJobsOption(command, options.sample.jobs);
}

}  // namespace

Command sampleCommand() {
  return makeCommand("sample", "Perform the sample corpus: C3D, WAV, text and labels",
                     "corpus sample takes --truth truth", addOptions, runSample);
}

}  // namespace mouthpiece
