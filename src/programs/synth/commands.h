#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>

#include "base/errors.h"
#include "mouthpiece/speaker.h"
#include "programs/outputs.h"
#include "programs/program.h"

namespace mouthpiece {

/// An option whose value is one of a few names.
template <typename Value>
void addChoice(CLI::App& app, const std::string& option, Value& value, const std::map<std::string, Value>& names,
               const std::string& help) {
  std::string known;
  for (const auto& [name, unused] : names) known += (known.empty() ? "" : "|") + name;
  app.add_option_function<std::string>(
         option,
         [&value, names, option, known](const std::string& name) {
           const auto found = names.find(name);
           if (found == names.end())
             throw CLI::ValidationError(option, "found '" + printable(name, 120) + "'; expected " + known);
           value = found->second;
         },
         help)
      ->type_name(known);
}

/// What `synth` and `synth batch` share: how to speak, but not what.
struct SharedOptions {
  SpeakerOptions speaker;
  bool quiet = false;
  bool json = false;
};
void addSharedOptions(CLI::App& app, SharedOptions& options);

/// The speaker that is asked for: what the user's config file alone has as voice or language gives way to what the
/// command line has of either.
SpeakerOptions speakerOf(const SharedOptions& options);
/// "flite:slt speaks no German: espeak:de does" where a usual voice that is not the program's gives way; else "".
std::string givingWay(const SpeakerOptions& options);

/// Whether any of the files shows the face, or is fitted to one that was asked for.
bool needsFace(const SpeakerOptions& options, const std::vector<std::filesystem::path>& files);

/// The files that `options` name, by their options; not the head that the face was fitted to.
FilesRead filesReadBy(const SpeakerOptions& options);

Command speakCommand();
Command batchCommand();
Command serveCommand();
Command streamCommand();
Command mergeCommand();

}  // namespace mouthpiece
