#include "programs/outputs.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "base/errors.h"
#include "phonetics/labels/label_files.h"
#include "retarget/rig/face_file.h"
#include "units/file/corpus.h"

namespace mouthpiece {
namespace {

namespace fs = std::filesystem;

/// Options whose values are words, not files.
constexpr std::array<std::string_view, 8> kWords{"--hint",   "--language",   "--lyrics-text", "--name",
                                                 "--object", "--transcript", "--unseen",      "--voice"};

/// The command's options and arguments, those of its groups among them; none whose values are words.
std::vector<const CLI::Option*> optionsOf(const CLI::App& command) {
  std::vector<const CLI::Option*> options = command.get_options();
  for (const CLI::App* group : command.get_subcommands(nullptr)) {
    if (!group->get_name().empty()) continue;
    const std::vector<const CLI::Option*> more = group->get_options();
    options.insert(options.end(), more.begin(), more.end());
  }
  std::erase_if(options, [](const CLI::Option* option) {
    return std::ranges::any_of(kWords, [&](std::string_view name) { return option->check_name(std::string(name)); });
  });
  return options;
}

/// What a file holds at its beginning, enough to know a face or a corpus by; nothing where none is.
std::string beginningOf(const fs::path& file) {
  std::string bytes(100, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(bytes.data(), std::ssize(bytes));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

/// Without links and dots; "" where a file system does not tell.
fs::path realPath(const fs::path& file) {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(file, error), error);
  return error ? fs::path() : real;
}

void checkOutput(const CLI::App& command, const CLI::Option& option, OutputKind kind, const std::string& file) {
  const auto refuse = [&](std::string_view what) { throw InputError(file, option.get_name(), what); };
  for (const CLI::Option* other : optionsOf(command)) {
    if (other == &option) continue;
    for (const std::string& theirs : other->results()) {
      if (isSameFile(file, theirs))
        refuse(fmt::format("is what {} names, too; expected another name", other->get_name()));
    }
  }
  std::error_code error;
  if (kind != OutputKind::kFileOrFolder && fs::is_directory(file, error)) refuse("is a folder; expected a file name");
  if (kind == OutputKind::kPage && fs::path(file).extension() != ".html" && fs::path(file).extension() != ".htm")
    refuse("is to be a page; expected a name that ends in .html");
  if (kind == OutputKind::kLabels && !isLabelFileName(file))
    refuse("has another ending; expected .TextGrid .lab .phn .ctm or .txt");
  const bool has_kind = kind == OutputKind::kFace || kind == OutputKind::kCorpus;
  if (const std::string begins = has_kind ? beginningOf(file) : ""; !begins.empty()) {
    const bool is_face = kind == OutputKind::kFace;
    if (is_face ? !beginsAsFace(begins) : !beginsAsCorpus(begins))
      refuse(fmt::format("is there and no {0}; expected a new name, or a {0} to replace", is_face ? "face" : "corpus"));
  }
}

}  // namespace

void checkOutputs(CLI::App& command, const std::vector<Output>& outputs) {
  for (const Output& output : outputs) {
    CLI::Option* option = command.get_option(output.option);
    // CLI11 asks when it has read the whole command line.
    option->check([&command, option, kind = output.kind](const std::string& file) {
      checkOutput(command, *option, kind, file);
      return std::string();
    });
  }
}

void expectWritable(const fs::path& folder) {
  std::error_code error;
  fs::path there = fs::absolute(folder).lexically_normal();
  while (!fs::exists(there, error) && there.has_relative_path()) there = there.parent_path();
  if (!fs::is_directory(there, error))
    throw InputError(folder.string(), "", fmt::format("cannot be made: {} is no folder", there.string()));
  std::string trial = (there / ".mouthpiece-XXXXXX").string();
  if (::mkdtemp(trial.data()) == nullptr)
    throw InputError(folder.string(), "", fmt::format("cannot be written: {}", std::strerror(errno)));
  fs::remove(trial, error);
}

bool isSameFile(const fs::path& a, const fs::path& b) {
  const fs::path real = realPath(a);
  return !real.empty() && real == realPath(b);
}

void FilesRead::add(const fs::path& file, const std::string& by) {
  if (!file.empty() && file != "-") files_.emplace(realPath(file), by);
}

void FilesRead::expectNot(const fs::path& output, const std::string& option) const {
  const auto found = files_.find(realPath(output));
  if (found != files_.end() && !found->first.empty())
    throw InputError(output.string(), option,
                     fmt::format("is what {} names, too; expected another name or folder", found->second));
}

}  // namespace mouthpiece
