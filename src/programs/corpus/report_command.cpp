#include <fmt/format.h>

#include "base/files.h"
#include "programs/corpus/command_support.h"
#include "corpus_tools/report/corpus_report.h"
#include "hearing/alignment/pronouncer.h"

namespace mouthpiece {
namespace {

struct ReportCommand {
  bool quiet = false, json = false;
  std::filesystem::path corpus, output;
};

int runReport(const ReportCommand& command) {
  const Corpus corpus = readCorpus(command.corpus);
  const ReportOptions options{.language = dictionaryWords()};
  if (command.json) printText(corpusReportJson(corpus, options));
  writeFileAtomically(command.output, corpusReportHtml(corpus, options));
  if (!command.quiet && !command.json) printText(fmt::format("{}\n", command.output.string()));
  return kExitDone;
}

}  // namespace

void addReportCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<ReportCommand>();
  CLI::App& report = addCommand(app, chosen, "report", "A page that shows what a corpus holds, lacks and doubts",
                                "corpus report mine.corpus --out report.html", options, runReport);
  addCorpusArgument(report, options->corpus);
  report.add_option("--out,-o", options->output, "The page (HTML) to write")->required();
  addJsonFlag(report, options->json);
}

}  // namespace mouthpiece
