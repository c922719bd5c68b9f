#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/sound_sync.h"
#include "programs/program.h"

namespace mouthpiece {

/// A progress bar that a library's callback moves.
class CallbackBar {
 public:
  CallbackBar(std::string label, bool quiet) : label_(std::move(label)), quiet_(quiet) {}
  void operator()(std::size_t done, std::size_t total) {
    if (!bar_) bar_.emplace(label_, total, quiet_);
    bar_->setDone(done);
  }

 private:
  std::string label_;
  bool quiet_;
  std::optional<ProgressBar> bar_;
};

void addCorpusArgument(CLI::App& command, std::filesystem::path& corpus);
void addLayoutOption(CLI::App& command, std::filesystem::path& layout);
void addLexiconOption(CLI::App& command, std::filesystem::path& lexicon);
/// The tag of a language, for languageOf(); "en" to begin with.
void addLanguageOption(CLI::App& command, std::string& language);
void addJobsOption(CLI::App& command, std::size_t& jobs);
/// --no-swaps, --no-spikes, ...: each switches a step of the cleaning off.
void addCleaningOptions(CLI::App& command, CleaningOptions& cleaning);

/// --map OLD=NEW, repeatable.
void addMarkerMapOption(CLI::App& command, std::vector<std::string>& renamed);
/// These, and the labels that the layout's file gives its markers. Throws InputError for what is not OLD=NEW.
MarkerNameMap markerMapFrom(const std::vector<std::string>& renamed, const std::filesystem::path& layout = {});

/// The layout in a JSON file; the default one for an empty path.
MarkerLayout layoutFrom(const std::filesystem::path& file);
/// The lexicon in a file; an empty one for an empty path.
Lexicon lexiconFrom(const std::filesystem::path& file, const Language& language = english());

/// Writes `clip`, made from the motion in `source`; events go along from C3D to C3D.
void writeMotionWithEvents(const std::filesystem::path& path, const MotionClip& clip,
                           const std::filesystem::path& source);
bool isC3dFileName(const std::filesystem::path& path);

/// What is said of a recorder's clock beside its place, with a comma before it; nothing where none is seen to drift.
std::string tellDrift(const SoundPlace& place);

/// One line a take on stderr.
void noteLeftOut(const std::vector<LeftOutTake>& left_out, bool quiet);

}  // namespace mouthpiece
