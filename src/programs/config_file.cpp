#include "programs/config_file.h"

#include <fmt/format.h>

#include <cstdlib>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"

namespace mouthpiece {

std::filesystem::path configPath() {
  const auto given = [](const char* variable) {
    const char* value = std::getenv(variable);
    return value == nullptr ? std::filesystem::path() : std::filesystem::path(value);
  };
  if (const auto file = given("MOUTHPIECE_CONFIG"); !file.empty()) return file;
  if (const auto folder = given("XDG_CONFIG_HOME"); !folder.empty()) return folder / "mouthpiece";
  const auto home = given("HOME");
  return home.empty() ? home : home / ".config" / "mouthpiece";
}

std::vector<ConfigEntry> readConfig(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = 1 << 20;
  std::vector<ConfigEntry> entries;
  std::error_code error;
  if (path.empty() || !std::filesystem::is_regular_file(path, error)) return entries;
  const std::string text = readFile(path, kMostBytes);
  LineReader lines(text);
  std::string section;
  std::string_view line;
  while (lines.next(line)) {
    const std::string_view bare = trimmed(line);
    if (bare.empty() || bare.front() == '#') continue;
    if (bare.front() == '[' && bare.back() == ']') {
      section = trimmed(bare.substr(1, bare.size() - 2));
      continue;
    }
    const std::size_t equals = bare.find('=');
    const std::string_view key = trimmed(bare.substr(0, equals));
    if (equals == std::string_view::npos || key.empty() || section.empty())
      throw InputError(
          path.string(), std::to_string(lines.lineNumber()),
          fmt::format("found '{}'; expected KEY = VALUE below a [synth], [corpus] or [retarget]", printable(bare)));
    entries.push_back({lines.lineNumber(), section, std::string(key), std::string(trimmed(bare.substr(equals + 1)))});
  }
  return entries;
}

}  // namespace mouthpiece
