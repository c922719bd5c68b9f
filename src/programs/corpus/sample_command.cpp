#include <fmt/format.h>

#include "corpus_tools/sample/sample_corpus.h"
#include "corpus_tools/sample/sample_sentences.h"
#include "programs/corpus/command_support.h"

namespace mouthpiece {
namespace {

struct SampleCommand {
  bool quiet = false;
  std::filesystem::path folder, truth, sentences;
  SampleOptions sample;
};

int runSample(const SampleCommand& command) {
  SampleOptions sample = command.sample;
  if (!command.truth.empty()) sample.truth_folder = command.truth;
  if (!command.sentences.empty()) sample.sentences = readSentences(command.sentences);
  SampleSummary summary;
  {
    CallbackBar bar("performing", command.quiet);
    summary = writeSampleCorpus(command.folder, sample, std::ref(bar));
  }
  if (!summary.notice.empty()) printNotice(summary.notice, command.quiet);
  if (!command.quiet) {
    printText(fmt::format("{} takes, {:.1f} s, {:.2f} % of the samples hidden: {}\n", summary.takes, summary.speech_s,
                          100 * summary.missing_share, command.folder.string()));
  }
  return kExitDone;
}

}  // namespace

void addSampleCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<SampleCommand>();
  CLI::App& sample = addCommand(app, chosen, "sample", "Perform the sample corpus: C3D, WAV, text and labels",
                                "corpus sample takes --truth truth", options, runSample);
  sample.add_option("folder", options->folder, "Where the takes go")->required();
  sample.add_option("--truth", options->truth, "Folder for the clean motion, head still");
  sample.add_option("--sentences", options->sentences,
                    "What to say, one sentence a line; default: 55 of the time grammar");
  sample.add_option("--seed", options->sample.seed, "Of head motion, noise and gaps")->capture_default_str();
  sample.add_option("--voice", options->sample.voice, "Who speaks")->capture_default_str();
  addJobsOption(sample, options->sample.jobs);
}

}  // namespace mouthpiece
