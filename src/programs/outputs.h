#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace CLI {  // NOLINT(readability-identifier-naming): not ours
class App;
}

namespace mouthpiece {

/// What a command writes under the name that an option gives.
enum class OutputKind {
  kFile,
  kFileOrFolder,
  kPage,    ///< a name that ends in .html
  kLabels,  ///< an ending that writeLabels() knows
  kFace,    ///< replaces a face only
  kCorpus,  ///< replaces a corpus only
};
struct Output {
  const char* option;
  OutputKind kind = OutputKind::kFile;
};

/// Has the names that these options of `command` are given looked at before it runs, so that neither hours of work nor
/// a file of the user's is lost: InputError is thrown for one that another option or argument of it has, too, for a
/// folder's where a file is to be, for another ending than the kind's, and for a file of another kind.
void checkOutputs(CLI::App& command, const std::vector<Output>& outputs);

/// Throws InputError for a folder in which nothing can be written, or which cannot be made; nothing is left in it.
void expectWritable(const std::filesystem::path& folder);

/// Whether both are names of one file or folder, which may be there or not.
bool isSameFile(const std::filesystem::path& a, const std::filesystem::path& b);

/// The files that a command reads, for outputs whose names no option gives by themselves: those of a folder, of a list.
class FilesRead {
 public:
  /// `by`: what names the file, as an error is to tell it. "" and "-" are no files.
  void add(const std::filesystem::path& file, const std::string& by);
  /// Throws InputError, with `option` as its place, for an output that is one of them.
  void expectNot(const std::filesystem::path& output, const std::string& option) const;

 private:
  std::map<std::filesystem::path, std::string> files_;  ///< their real paths, and what names each
};

}  // namespace mouthpiece
