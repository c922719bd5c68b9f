#pragma once

#include <functional>

namespace CLI {  // NOLINT(readability-identifier-naming): not ours
class App;
}

namespace mouthpiece {

/// What the program does once the command line is read; set by the subcommand that it names.
using ChosenAction = std::function<int()>;

/// One function and one source file a subcommand of `corpus`. `chosen` outlives `app`.
void addAlignCommand(CLI::App& app, ChosenAction& chosen);
void addBuildCommand(CLI::App& app, ChosenAction& chosen);
void addCheckCommand(CLI::App& app, ChosenAction& chosen);
void addCleanCommand(CLI::App& app, ChosenAction& chosen);
void addConvertCommand(CLI::App& app, ChosenAction& chosen);
void addEvaluateCommand(CLI::App& app, ChosenAction& chosen);
void addInfoCommand(CLI::App& app, ChosenAction& chosen);
void addPromptsCommand(CLI::App& app, ChosenAction& chosen);
void addReportCommand(CLI::App& app, ChosenAction& chosen);
void addSampleCommand(CLI::App& app, ChosenAction& chosen);
void addTagCommand(CLI::App& app, ChosenAction& chosen);
void addTuneCommand(CLI::App& app, ChosenAction& chosen);

}  // namespace mouthpiece
