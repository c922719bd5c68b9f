#include <fmt/format.h>

#include "corpus_tools/commands/command_support.h"

namespace mouthpiece {
namespace {

struct BuildCommand {
  bool quiet = false, strict = false;
  std::filesystem::path folder, output, lexicon, layout;
  std::size_t jobs = 0;
};

int runBuild(const BuildCommand& command) {
  BuildOptions options;
  options.layout = layoutFrom(command.layout);
  options.lexicon = lexiconFrom(command.lexicon);
  options.jobs = command.jobs;
  options.strict = command.strict;
  BuildResult result;
  {
    CallbackBar bar("building", command.quiet);
    result = buildCorpus(command.folder, options, std::ref(bar));
  }
  result.corpus.name = command.output.stem().string();
  noteLeftOut(result.left_out, command.quiet);
  writeCorpus(command.output, result.corpus);
  if (!command.quiet) {
    printText(fmt::format("{} takes used, {} left out: {}\n", result.takes.size(), result.left_out.size(),
                          command.output.string()));
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
                  "NAME.c3d (.trc .csv), NAME.wav (.flac), NAME.txt, NAME.TextGrid (.lab .phn)")
      ->required();
  build.add_option("--out,-o", options->output, "The corpus to write")->required();
  addLexiconOption(build, options->lexicon);
  addLayoutOption(build, options->layout);
  addJobsOption(build, options->jobs);
  build.add_flag("--strict", options->strict, "Stop at a take that cannot be used");
}

}  // namespace mouthpiece
