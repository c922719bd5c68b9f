// retarget: fits a face mesh to an actor's markers, moves it with motion, judges the fit, makes the sample face.
#include "programs/retarget/commands.h"

namespace mouthpiece {
namespace {

int run(int argc, const char* const* argv) {
  return runProgram({"retarget",
                     "Puts captured marker motion on a face mesh.",
                     "retarget fit --mesh head.obj --anchors head.anchors.json --corpus sample.corpus --out head.face\n"
                     "retarget apply --face head.face --motion motion.c3d --out talk.glb\nretarget check head.face",
                     {}},
                    {fitCommand(), ownCommand(), pickCommand(), anchorsCommand(), cutCommand(), applyCommand(),
                     checkCommand(), sampleCommand(), shapesCommand()},
                    argc, argv);
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) { return mouthpiece::caught(argc, argv, mouthpiece::run); }
