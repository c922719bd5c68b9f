#pragma once

#include <CLI/CLI.hpp>

#include "mouthpiece/speaker.h"
#include "programs/program.h"

namespace mouthpiece {

/// What `synth` and `synth batch` share: how to speak, but not what.
struct SharedOptions {
  SpeakerOptions speaker;
  bool quiet = false;
  bool json = false;
};
void addSharedOptions(CLI::App& app, SharedOptions& options);

/// Whether any of the files shows the face, or is fitted to one that was asked for.
bool needsFace(const SpeakerOptions& options, const std::vector<std::filesystem::path>& files);

Command speakCommand();
Command batchCommand();
Command serveCommand();
Command streamCommand();
Command mergeCommand();

}  // namespace mouthpiece
