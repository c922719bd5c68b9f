#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace mouthpiece {

/// A default that the user has written down (docs/guides/config.md).
struct ConfigEntry {
  std::size_t line = 0;
  std::size_t section_line = 0;
  std::string section;  ///< "synth", or "synth batch" for one command
  std::string key;      ///< the option's name without its dashes
  std::string value;
};

/// The user's file: what MOUTHPIECE_CONFIG names, else `mouthpiece` in XDG_CONFIG_HOME or ~/.config; "" where there is
/// neither. Throws InputError where MOUTHPIECE_CONFIG names nothing that is there.
std::filesystem::path configPath();

/// `[section]` lines and `key = value` lines; a value may stand in quotes. Lines that begin with # or ; are comments,
/// and so is what stands behind a value after a blank and #. Nothing for a file that is not there, and of a device.
/// Throws InputError with the line for anything else, and for a folder.
std::vector<ConfigEntry> readConfig(const std::filesystem::path& path);

}  // namespace mouthpiece
