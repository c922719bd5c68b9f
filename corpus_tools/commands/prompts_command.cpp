#include "corpus_tools/commands/command_support.h"
#include "corpus_tools/sample_sentences.h"

namespace mouthpiece {
namespace {

struct PromptsCommand {
  bool quiet = false;
  std::size_t count = 55;
};

int runPrompts(const PromptsCommand& command) {
  for (const TimeSentence& sentence : chooseTimeSentences(command.count)) printText(sentence.text() + "\n");
  return kExitDone;
}

}  // namespace

void addPromptsCommand(CLI::App& app, ChosenAction& chosen) {
  const auto options = std::make_shared<PromptsCommand>();
  CLI::App& prompts = addCommand(app, chosen, "prompts", "Sentences of the time grammar to record, chosen for coverage",
                                 "corpus prompts --count 55", options, runPrompts);
  prompts.add_option("--count", options->count, "How many")->capture_default_str()->check(CLI::Range(1, 2880));
}

}  // namespace mouthpiece
