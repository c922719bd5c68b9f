// corpus: performs, builds, inspects and evaluates corpora.
#include <CLI/CLI.hpp>

#include "programs/corpus/commands.h"
#include "programs/program.h"

int main(int argc, char** argv) {
  mouthpiece::ChosenAction chosen;
  CLI::App app{"Performs, builds, inspects and evaluates corpora of captured speech", "corpus"};
  app.require_subcommand(1);
  mouthpiece::setExample(app, "corpus build takes --out mine.corpus\ncorpus info mine.corpus\ncorpus build --help");
  mouthpiece::addSampleCommand(app, chosen);
  mouthpiece::addBuildCommand(app, chosen);
  mouthpiece::addAlignCommand(app, chosen);
  mouthpiece::addTagCommand(app, chosen);
  mouthpiece::addInfoCommand(app, chosen);
  mouthpiece::addCheckCommand(app, chosen);
  mouthpiece::addConvertCommand(app, chosen);
  mouthpiece::addCleanCommand(app, chosen);
  mouthpiece::addTuneCommand(app, chosen);
  mouthpiece::addEvaluateCommand(app, chosen);
  mouthpiece::addReportCommand(app, chosen);
  mouthpiece::addPromptsCommand(app, chosen);
  return mouthpiece::runProgram(app, argc, argv, [&chosen] { return chosen(); });
}
