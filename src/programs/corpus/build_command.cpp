#include <fmt/format.h>

#include <algorithm>

#include "base/counted.h"
#include "base/errors.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"
#include "speaker/shared_files.h"

namespace mouthpiece {
namespace {

struct BuildArguments {
  bool quiet = false, strict = false;
  std::filesystem::path folder, output, lexicon, layout;
  std::string language = "en";
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

/// Throws InputError where --map names a marker that the layout has not: what goes by it would be left out.
void expectLayoutMarkers(const BuildOptions& options) {
  std::vector<std::string> known = options.layout.markerNames();
  known.insert(known.end(), options.layout.jig_names.begin(), options.layout.jig_names.end());
  for (const auto& [name, marker] : options.marker_names) {
    if (std::find(known.begin(), known.end(), marker) == known.end())
      throw InputError("--map", "",
                       fmt::format("found {0}={1}; the layout {2} has no marker {1}", printable(name),
                                   printable(marker), options.layout.name));
  }
}

int runBuild(const BuildArguments& given) {
  BuildOptions options;
  options.layout = layoutFrom(given.layout);
  options.language = &languageOf(given.language);
  options.lexicon = lexiconFrom(given.lexicon, *options.language);
  options.marker_names = markerMapFrom(given.renamed, given.layout);
  expectLayoutMarkers(options);
  options.word_network = sharedWordNetwork();
  options.jobs = given.jobs;
  options.strict = given.strict;
  options.cleaning = given.cleaning;
  BuildResult result;
  {
    CallbackBar bar("building", given.quiet);
    result = buildCorpusFile(given.folder, given.output, options, std::ref(bar));
  }
  noteLeftOut(result.left_out, given.quiet);
  noteDoubtfulWords(result.takes, given.quiet);
  if (!result.network_fault.empty()) printNotice(result.network_fault, given.quiet);
  if (result.corpus.viseme_poses.empty())
    printNotice("no viseme poses: songs, --style and stretches without capture cannot be drawn by curves", given.quiet);
  if (!given.quiet) {
    printText(fmt::format("{} used, {} left out ({} done before): {}\n", counted(result.takes.size(), "take"),
                          result.left_out.size(), result.kept_takes, given.output.string()));
  }
  return kExitDone;
}

void addOptions(CLI::App& command, BuildArguments& options) {
  command
      .add_option("folder", options.folder,
                  "NAME.c3d (.trc .csv), NAME.wav (.flac), NAME.txt, NAME.TextGrid (.lab .phn .ctm; without: aligned)")
      ->required();
  command.add_option("--out,-o", options.output, "The corpus to write")->required();
  checkOutputs(command, {{"--out", OutputKind::kCorpus}});
  addLexiconOption(command, options.lexicon);
  addLanguageOption(command, options.language);
  addLayoutOption(command, options.layout);
  addMarkerMapOption(command, options.renamed);
  addJobsOption(command, options.jobs);
  addCleaningOptions(command, options.cleaning);
  command.add_flag("--strict", options.strict, "Stop at a take that cannot be used");
}

}  // namespace

Command buildCommand() {
  return makeCommand("build", "Takes -> cleaned, labelled, indexed corpus",
                     "corpus build takes --out mine.corpus --lexicon lexicon.txt", addOptions, runBuild);
}

}  // namespace mouthpiece
