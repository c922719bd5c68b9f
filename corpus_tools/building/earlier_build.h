#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "corpus_tools/building/corpus_builder.h"
#include "corpus_tools/takes/take_report.h"
#include "units/file/corpus.h"

namespace mouthpiece {

/// What a take's cleaning and labels depend on besides its files and the head reference.
std::string settingsOf(const BuildOptions& options);

/// What EarlierBuild::find() asks for. `takes`: the reports of all takes of the corpus, in its order.
void logForNextBuild(Corpus& corpus, const std::vector<TakeReport>& takes, const std::string& settings);

/// A corpus that takes are added to: its takes by key.
struct EarlierBuild {
  Corpus corpus;
  std::map<std::string, TakeReport> reports;
  std::map<std::string, std::size_t> takes;

  /// nullopt when there is none at `output`, or it was made with other settings, or is damaged, or shares no take.
  static std::optional<EarlierBuild> find(const std::filesystem::path& output, const std::string& settings,
                                          const std::vector<std::string>& keys);
};

}  // namespace mouthpiece
