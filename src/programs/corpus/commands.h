#pragma once

#include "programs/program.h"

namespace mouthpiece {

// One source file a subcommand of `corpus`.
Command adaptCommand();
Command alignCommand();
Command buildCommand();
Command checkCommand();
Command cleanCommand();
Command convertCommand();
Command evaluateCommand();
Command infoCommand();
Command promptsCommand();
Command reportCommand();
Command sampleCommand();
Command studioCommand();
Command tagCommand();
Command trackCommand();
Command tuneCommand();

}  // namespace mouthpiece
