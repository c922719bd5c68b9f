// Where the files of a batch go.
#include <fmt/format.h>

#include <algorithm>

#include "base/errors.h"
#include "base/text_encoding.h"
#include "base/text_numbers.h"
#include "programs/synth/batch_input.h"
#include "programs/synth/commands.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

void replaceAll(std::string& text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
}

/// A name that any file system takes.
std::string fileName(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || std::string_view("/\\:*?\"<>|").find(c) != std::string_view::npos)
      c = '_';
  }
  if (!text.empty() && (text.back() == '.' || text.back() == ' ')) text.back() = '_';
  return text.empty() || text.front() == '.' || text.front() == '-' || isDeviceName(text) ? "_" + text : text;
}

}  // namespace

std::vector<std::string> filePatterns(std::span<const std::string> formats, std::vector<std::string> patterns) {
  for (const std::string& format : formats) {
    std::string pattern = fmt::format("{{id}}.{}", trimmed(format));
    if (std::find(patterns.begin(), patterns.end(), pattern) == patterns.end()) patterns.push_back(std::move(pattern));
  }
  if (patterns.empty()) {
    for (const fs::path& file : usualFiles("{id}")) patterns.push_back(file.string());
  }
  for (const std::string& pattern : patterns) {
    const fs::path path(pattern);
    if (pattern.find("{id}") == std::string::npos)
      throw InputError("-o", "", fmt::format("found '{}'; expected {{id}} in the name", printable(pattern)));
    for (std::size_t at = pattern.find('{'); at != std::string::npos; at = pattern.find('{', at + 1)) {
      const std::string_view place = std::string_view(pattern).substr(at, pattern.find('}', at) - at + 1);
      if (place != "{id}" && place != "{language}" && place != "{speaker}")
        throw InputError("-o", "",
                         fmt::format("found '{}'; expected {{id}}, {{language}} or {{speaker}}", printable(place)));
    }
    if (path.is_absolute() || std::find(path.begin(), path.end(), "..") != path.end())
      throw InputError("-o", "", fmt::format("found '{}'; expected a name inside of --out", printable(pattern)));
    formatOf(path);
  }
  return patterns;
}

std::vector<std::string> filesOfLine(const BatchLine& line, std::span<const std::string> patterns) {
  std::vector<std::string> files;
  for (std::string name : patterns) {
    const bool has_language = name.find("{language}") != std::string::npos;
    replaceAll(name, "{id}", has_language ? line.id : line.key);
    replaceAll(name, "{language}", fileName(line.language));
    replaceAll(name, "{speaker}", fileName(line.speaker));
    files.push_back(std::move(name));
  }
  return files;
}

}  // namespace mouthpiece
