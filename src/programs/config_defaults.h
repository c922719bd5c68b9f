#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "programs/config_file.h"

namespace CLI {  // NOLINT(readability-identifier-naming): not ours
class App;
}

namespace mouthpiece {

/// Those of the user's defaults (docs/guides/config.md) that count in a run of a program.
class ConfigDefaults {
 public:
  /// None.
  ConfigDefaults() = default;
  /// Of the options of the command that `arguments` begin with: what they neither give nor exclude, and what needs
  /// nothing that they do not give. Throws InputError for a file that cannot be used, a section of no command, and a
  /// key that no command of its section has.
  ConfigDefaults(const CLI::App& app, const std::vector<std::string>& arguments);

  /// `arguments` and these as options of their command.
  [[nodiscard]] std::vector<std::string> before(std::vector<std::string> arguments) const;
  /// Whether this is one of them: the name of an option with its dashes.
  [[nodiscard]] bool has(std::string_view option) const;
  /// An error's words, with file and line where it is of one of them: of its option, or of its value.
  [[nodiscard]] std::string placed(const std::string& message) const;

 private:
  std::filesystem::path file_;
  bool has_command_ = false;
  std::vector<ConfigEntry> entries_;
};

}  // namespace mouthpiece
