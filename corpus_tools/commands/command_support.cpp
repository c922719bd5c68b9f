#include "corpus_tools/commands/command_support.h"

#include <fmt/format.h>

#include "base/files.h"

namespace mouthpiece {
namespace {

constexpr std::uint64_t kMaxLayoutBytes = 16 << 20;

}  // namespace

void addCorpusArgument(CLI::App& command, std::filesystem::path& corpus) {
  command.add_option("corpus", corpus, "X.corpus")->required();
}

void addLayoutOption(CLI::App& command, std::filesystem::path& layout) {
  command.add_option("--layout", layout, "Marker layout (JSON); default: face66");
}

void addLexiconOption(CLI::App& command, std::filesystem::path& lexicon) {
  command.add_option("--lexicon", lexicon, "Pronunciations of words (WORD PHONES..., one a line)");
}

void addJobsOption(CLI::App& command, std::size_t& jobs) {
  command.add_option("--jobs", jobs, "Takes at once; default: one per core")->check(CLI::Range(1, 1024));
}

MarkerLayout layoutFrom(const std::filesystem::path& file) {
  return file.empty() ? defaultLayout() : parseLayout(readFile(file, kMaxLayoutBytes), file.string());
}

Lexicon lexiconFrom(const std::filesystem::path& file) { return file.empty() ? Lexicon() : Lexicon::read(file); }

void noteLeftOut(const std::vector<LeftOutTake>& left_out, bool quiet) {
  for (const LeftOutTake& take : left_out) printNotice(fmt::format("left out {}: {}", take.name, take.reason), quiet);
}

}  // namespace mouthpiece
