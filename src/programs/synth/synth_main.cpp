// synth: a line in, a moving face out.
#include <algorithm>
#include <string_view>
#include <vector>

#include "programs/synth/commands.h"

namespace mouthpiece {
namespace {

int run(int argc, const char* const* argv) {
  // `synth --stream ...` is `synth stream ...`.
  std::vector<const char*> arguments(argv, argv + argc);
  const auto flag = std::find(arguments.begin(), arguments.end(), std::string_view("--stream"));
  if (flag != arguments.end()) {
    arguments.erase(flag);
    arguments.insert(arguments.begin() + 1, "stream");
  }
  return runProgram(speakCommand(), {batchCommand(), mergeCommand(), serveCommand(), streamCommand()}, argc,
                    arguments.data());
}

}  // namespace
}  // namespace mouthpiece

int main(int argc, char** argv) { return mouthpiece::caught(argc, argv, mouthpiece::run); }
