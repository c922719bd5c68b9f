// synth: a line in, a moving face out.
#include "programs/synth/commands.h"

int main(int argc, char** argv) {
  using namespace mouthpiece;
  return runProgram(speakCommand(), {batchCommand(), serveCommand()}, argc, argv);
}
