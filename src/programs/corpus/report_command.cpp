#include <fmt/format.h>

#include "base/files.h"
#include "corpus_tools/report/corpus_report.h"
#include "hearing/alignment/pronouncer.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"
#include "programs/outputs.h"

namespace mouthpiece {
namespace {

struct ReportArguments {
  bool quiet = false, json = false;
  std::filesystem::path corpus, output;
};

int runReport(const ReportArguments& given) {
  const Corpus corpus = readCorpus(given.corpus);
  const ReportOptions options{.language = dictionaryWords()};
  if (given.json) printText(corpusReportJson(corpus, options));
  writeFileAtomically(given.output, corpusReportHtml(corpus, options));
  if (!given.quiet && !given.json) printText(fmt::format("{}\n", given.output.string()));
  return kExitDone;
}

void addOptions(CLI::App& command, ReportArguments& options) {
  addCorpusArgument(command, options.corpus);
  command.add_option("--out,-o", options.output, "The page (HTML) to write")->required();
  checkOutputs(command, {{"--out", OutputKind::kPage}});
  addJsonFlag(command, options.json);
}

}  // namespace

Command reportCommand() {
  return makeCommand("report", "A page that shows what a corpus holds, lacks and doubts",
                     "corpus report mine.corpus --out report.html", addOptions, runReport);
}

}  // namespace mouthpiece
