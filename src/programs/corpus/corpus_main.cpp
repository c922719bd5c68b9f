// corpus: performs, builds, inspects and evaluates corpora.
#include "programs/corpus/commands.h"

namespace mouthpiece {
namespace {

int run(int argc, const char* const* argv) {
  return runProgram({"corpus",
                     "Performs, builds, inspects and evaluates corpora of captured speech",
                     "corpus build takes --out mine.corpus\ncorpus info mine.corpus\ncorpus build --help",
                     {}},
                    {sampleCommand(), buildCommand(), adaptCommand(), alignCommand(), tagCommand(), infoCommand(),
                     checkCommand(), convertCommand(), cleanCommand(), tuneCommand(), evaluateCommand(),
                     reportCommand(), trackCommand(), studioCommand(), promptsCommand()},
                    argc, argv);
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) { return mouthpiece::caught(argc, argv, mouthpiece::run); }
