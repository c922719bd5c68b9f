#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "corpus_tools/takes/cleaning.h"
#include "corpus_tools/takes/take_files.h"
#include "corpus_tools/takes/take_report.h"
#include "motion/marker_layout.h"
#include "phonetics/text/lexicon.h"
#include "units/file/corpus.h"

namespace mouthpiece {

struct BuildOptions {
  MarkerLayout layout = defaultLayout();
  Lexicon lexicon;
  const Language* language = &english();  ///< of what is said, and of the labels
  MarkerNameMap marker_names;             ///< of the files, where they are not the layout's
  std::size_t jobs = 0;                   ///< takes at once; 0: one per core. The result does not depend on it
  bool strict = false;                    ///< the first take that cannot be used stops the build
  CleaningOptions cleaning;
  /// Asked about words that are in doubt; they are told, the labels stay.
  std::shared_ptr<WordNetwork> word_network = {};
  bool align_takes = true;  ///< captures without a jig: see alignTakesByPhones()
};

struct BuildResult {
  Corpus corpus;  ///< without motion and sound: those are in the file alone
  std::vector<TakeReport> takes;
  std::vector<LeftOutTake> left_out;
  std::string network_fault;   ///< why the word network could not be asked; else ""
  std::size_t kept_takes = 0;  ///< that were done before and not done again
};

/// Called from one thread at a time.
using BuildProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Takes -> cleaned, labelled corpus in the file `output`: labels found where there are none, head motion removed, one
/// frame and size for all takes, short gaps filled, neutral pose, the face's own axes. The file is replaced when all is
/// done, so it is whole at any moment. Takes already in it (by the content of their files and the options) are not done
/// again, and the others come into its frame and neutral pose; takes done by a run that was interrupted are taken up
/// from the folder `output`.parts. Throws InputError when the folder has no usable take; with `strict`, for any that
/// cannot be used.
BuildResult buildCorpusFile(const std::filesystem::path& folder, const std::filesystem::path& output,
                            const BuildOptions& options, const BuildProgress& progress = {});

struct CleanTakes {
  std::vector<CorpusTake> takes;
  std::vector<LeftOutTake> left_out;
};

/// The takes of another folder, cleaned into the frame of `corpus` (its own head reference, from its build log).
CleanTakes readTakesInto(const Corpus& corpus, const std::filesystem::path& folder, const BuildOptions& options,
                         const BuildProgress& progress = {});

}  // namespace mouthpiece
