#include "programs/config_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "base/errors.h"
#include "base/files.h"
#include "base/text_numbers.h"

namespace mouthpiece {
namespace {

/// What a value's text says: without its quotes, or up to a comment. nullopt for quotes that do not close at its end.
std::optional<std::string> valueOf(std::string_view text) {
  const bool is_quoted = text.starts_with('"') || text.starts_with('\'');
  const std::size_t end = is_quoted ? text.find(text.front(), 1) : text.size();
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view rest = trimmed(text.substr(is_quoted ? end + 1 : end));
  if (!rest.empty() && rest.front() != '#') return std::nullopt;
  if (is_quoted) return std::string(text.substr(1, end - 1));
  const std::size_t comment = std::min(text.find(" #"), text.find("\t#"));
  return std::string(text.front() == '#' ? "" : trimmed(text.substr(0, comment)));
}

}  // namespace

std::filesystem::path configPath() {
  const auto given = [](const char* variable) {
    const char* value = std::getenv(variable);
    return value == nullptr ? std::filesystem::path() : std::filesystem::path(value);
  };
  if (const auto file = given("MOUTHPIECE_CONFIG"); !file.empty()) {
    std::error_code error;
    if (!std::filesystem::exists(file, error))
      throw InputError(file.string(), "", "is not there; expected the file that MOUTHPIECE_CONFIG names");
    return file;
  }
  if (const auto folder = given("XDG_CONFIG_HOME"); !folder.empty()) return folder / "mouthpiece";
  const auto home = given("HOME");
  return home.empty() ? home : home / ".config" / "mouthpiece";
}

std::vector<ConfigEntry> readConfig(const std::filesystem::path& path) {
  constexpr std::uint64_t kMostBytes = 1 << 20;
  std::vector<ConfigEntry> entries;
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw InputError(path.string(), "", "is a folder; expected a file of defaults (docs/guides/config.md)");
  if (path.empty() || !std::filesystem::is_regular_file(path, error)) return entries;
  const std::string text = readFile(path, kMostBytes);
  LineReader lines(text);
  std::string section;
  std::size_t section_line = 0;
  std::string_view line;
  while (lines.next(line)) {
    const std::string_view bare = trimmed(line);
    if (bare.empty() || bare.front() == '#' || bare.front() == ';') continue;
    const auto refuse = [&](const std::string& what) {
      throw InputError(path.string(), std::to_string(lines.lineNumber()), what);
    };
    if (bare.front() == '[' && bare.back() == ']') {
      section = trimmed(bare.substr(1, bare.size() - 2));
      section_line = lines.lineNumber();
      continue;
    }
    const std::size_t equals = bare.find('=');
    const std::string_view key = trimmed(bare.substr(0, equals));
    if (equals == std::string_view::npos || key.empty() || section.empty())
      refuse(fmt::format("found '{}'; expected KEY = VALUE below a [synth], [corpus] or [retarget]", printable(bare)));
    const std::string_view given = trimmed(bare.substr(equals + 1));
    const std::optional<std::string> value = given.empty() ? std::string() : valueOf(given);
    if (!value) refuse(fmt::format("found {}; expected a quote at its end, and nothing behind it", printable(given)));
    if (value->empty()) refuse(fmt::format("found no value for '{}'; expected one, or no such line", printable(key)));
    entries.push_back({lines.lineNumber(), section_line, section, std::string(key), *value});
  }
  return entries;
}

}  // namespace mouthpiece
