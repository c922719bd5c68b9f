#include "corpus_tools/building/corpus_facts.h"
#include "corpus_tools/report/corpus_report.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_file.h"
#include "programs/corpus/command_support.h"
#include "programs/corpus/commands.h"

namespace mouthpiece {
namespace {

struct InfoArguments {
  bool quiet = false, json = false;
  std::filesystem::path corpus;
};

int runInfo(const InfoArguments& given) {
  if (isMotionFileName(given.corpus)) {
    const MotionClip clip = readMotion(given.corpus);
    const auto events = isC3dFileName(given.corpus) ? readC3dEvents(given.corpus) : std::vector<MotionEvent>();
    printText(given.json ? motionFactsJson(clip, events) : motionFactsText(clip, events));
    return kExitDone;
  }
  const Corpus corpus = readCorpus(given.corpus);
  printText(given.json ? corpusFactsJson(corpus) : corpusFactsText(corpus));
  return kExitDone;
}

void addOptions(CLI::App& command, InfoArguments& options) {
  command.add_option("file", options.corpus, "X.corpus, or motion")->required();
  addJsonFlag(command, options.json);
}

}  // namespace

Command infoCommand() {
  return makeCommand("info", "What a corpus or a motion file (c3d csv trc) holds",
                     "corpus info mine.corpus --json\ncorpus info take.c3d", addOptions, runInfo);
}

}  // namespace mouthpiece
