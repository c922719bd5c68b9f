#include "corpus_tools/building/corpus_facts.h"
#include "programs/corpus/command_support.h"
#include "corpus_tools/report/motion_facts.h"
#include "motion/formats/c3d_file.h"
#include "motion/formats/motion_file.h"

namespace mouthpiece {
namespace {

struct InfoCommand {
  bool quiet = false, json = false;
  std::filesystem::path corpus;
};

int runInfo(const InfoCommand& command) {
  if (isMotionFileName(command.corpus)) {
    const MotionClip clip = readMotion(command.corpus);
    const auto events = isC3dFileName(command.corpus) ? readC3dEvents(command.corpus) : std::vector<MotionEvent>();
    printText(command.json ? motionFactsJson(clip, events) : motionFactsText(clip, events));
    return kExitDone;
  }
  const Corpus corpus = readCorpus(command.corpus);
  printText(command.json ? corpusFactsJson(corpus) : corpusFactsText(corpus));
  return kExitDone;
}

}  // namespace

void addInfoCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<InfoCommand>();
  CLI::App& info = addCommand(app, chosen, "info", "What a corpus or a motion file (c3d csv trc) holds",
                              "corpus info mine.corpus --json\ncorpus info take.c3d", options, runInfo);
  info.add_option("file", options->corpus, "X.corpus, or motion")->required();
  addJsonFlag(info, options->json);
}

}  // namespace mouthpiece
