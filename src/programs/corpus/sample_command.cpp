#include <fmt/format.h>

#include "base/counted.h"
#include "corpus_tools/sample/sample_corpus.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct SampleArguments {
  bool quiet = false;
  std::filesystem::path folder, truth, sentences;
  std::string prompts = "clock";
  SampleOptions sample;
};

int runSample(const SampleArguments& given) {
  SampleOptions sample = given.sample;
  if (!given.truth.empty()) sample.truth_folder = given.truth;
  sample.sentences = given.sentences.empty()
                         ? sampleSentences(given.prompts == "rich" ? SamplePrompts::kRich : SamplePrompts::kClock)
                         : readSentences(given.sentences);
  SampleSummary summary;
  {
    CallbackBar bar("performing", given.quiet);
    summary = writeSampleCorpus(given.folder, sample, std::ref(bar));
  }
  if (!summary.notice.empty()) printNotice(summary.notice, given.quiet);
  if (!given.quiet) {
    printText(fmt::format("{}, {:.1f} s, {:.2f} % of the samples hidden: {}\n", counted(summary.takes, "take"),
                          summary.speech_s, 100 * summary.missing_share, given.folder.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, SampleArguments& options) {
  command.add_option("folder", options.folder, "Where the takes go")->required();
  command.add_option("--truth", options.truth, "Folder for the clean motion, head still");
  checkOutputs(command, {{"--truth", OutputKind::kFileOrFolder}});
  auto* prompts = command
                      .add_option("--prompts", options.prompts,
                                  "clock: the 55 of the paper's time grammar; rich: these and 250 that hold the phone "
                                  "pairs of running English")
                      ->check(CLI::IsMember({"clock", "rich"}))
                      ->capture_default_str();
  command.add_option("--sentences", options.sentences, "What to say instead, one sentence a line")->excludes(prompts);
  command.add_option("--seed", options.sample.seed, "Of head motion, noise and gaps")->capture_default_str();
  command.add_option("--voice", options.sample.voice, "Who speaks")->capture_default_str();
  addJobsOption(command, options.sample.jobs);
}

}  // namespace

Command sampleCommand() {
  return makeCommand("sample", "Perform the sample corpus: C3D, WAV, text and labels",
                     "corpus sample takes --prompts rich\ncorpus sample takes --truth truth", addOptions, runSample);
}

}  // namespace mouthpiece
