#include "corpus_tools/commands/command_support.h"
#include "motion/motion_file.h"

namespace mouthpiece {
namespace {

struct ConvertCommand {
  bool quiet = false;
  std::filesystem::path input, output;
};

int runConvert(const ConvertCommand& command) {
  writeMotion(command.output, readMotion(command.input));
  return kExitDone;
}

}  // namespace

void addConvertCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<ConvertCommand>();
  CLI::App& convert =
      addCommand(app, chosen, "convert", "Motion from one format to another, by the names' endings (c3d csv trc)",
                 "corpus convert take.c3d take.csv", options, runConvert);
  convert.add_option("in", options->input, "Motion to read")->required();
  convert.add_option("out", options->output, "Motion to write")->required();
}

}  // namespace mouthpiece
