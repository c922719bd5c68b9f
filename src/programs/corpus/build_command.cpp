#include <fmt/format.h>

#include "programs/corpus/command_support.h"

namespace mouthpiece {
namespace {

struct BuildCommand {
  bool quiet = false, strict = false;
  std::filesystem::path folder, output, lexicon, layout;
  std::size_t jobs = 0;
  CleaningOptions cleaning;
  std::vector<std::string> renamed;
};

/// A line a take: the aligner is not sure that these words are said there.
void noteDoubtfulWords(const std::vector<TakeReport>& takes, bool quiet) {
  for (const TakeReport& take : takes) {
    std::string words;
    for (const DoubtfulWord& word : take.doubtful)
      words += fmt::format(" '{}' at {:.2f} s", word.text, word.span.start);
    if (!words.empty()) printNotice(fmt::format("doubtful labels in {}:{}", take.name, words), quiet);
  }
}

int runBuild(const BuildCommand& command) {
  BuildOptions options;
  options.layout = layoutFrom(command.layout);
  options.lexicon = lexiconFrom(command.lexicon);
  options.marker_names = markerMapFrom(command.renamed, command.layout);
  options.jobs = command.jobs;
  options.strict = command.strict;
  options.cleaning = command.cleaning;
  BuildResult result;
  {
    CallbackBar bar("building", command.quiet);
    result = buildCorpusFile(command.folder, command.output, options, std::ref(bar));
  }
  noteLeftOut(result.left_out, command.quiet);
  noteDoubtfulWords(result.takes, command.quiet);
  if (!command.quiet) {
    printText(fmt::format("{} takes used, {} left out ({} done before): {}\n", result.takes.size(),
                          result.left_out.size(), result.kept_takes, command.output.string()));
  }
  return kExitDone;
}

}  // namespace

void addBuildCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<BuildCommand>();
  CLI::App& build = addCommand(app, chosen, "build", "Takes -> cleaned, labelled, indexed corpus",
                               "corpus build takes --out mine.corpus --lexicon lexicon.txt", options, runBuild);
  build
      .add_option("folder", options->folder,
                  "NAME.c3d (.trc .csv), NAME.wav (.flac), NAME.txt, NAME.TextGrid (.lab .phn .ctm; without: aligned)")
      ->required();
  build.add_option("--out,-o", options->output, "The corpus to write")->required();
  addLexiconOption(build, options->lexicon);
  addLayoutOption(build, options->layout);
  addMarkerMapOption(build, options->renamed);
  addJobsOption(build, options->jobs);
  addCleaningOptions(build, options->cleaning);
  build.add_flag("--strict", options->strict, "Stop at a take that cannot be used");
}

}  // namespace mouthpiece
