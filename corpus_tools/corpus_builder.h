#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "corpus_tools/head_tracking.h"
#include "corpus_tools/take_files.h"
#include "motion/gaps.h"
#include "motion/marker_layout.h"
#include "phonetics/lexicon.h"
#include "units/corpus.h"

namespace mouthpiece {

struct CleaningOptions {
  HeadTrackingOptions head;
  GapFillOptions gaps;
  /// Captures at this rate or above: marker noise taken off by smoothMotion(). Below, lips move as fast as the noise
  /// does and closures would be lost (docs/theory/head_motion.md).
  double smoothed_from_hz = 60;
};

struct BuildOptions {
  MarkerLayout layout = defaultLayout();
  Lexicon lexicon;
  std::size_t jobs = 0;  ///< takes at once; 0: one per core. The result does not depend on it
  bool strict = false;   ///< the first take that cannot be used stops the build
  CleaningOptions cleaning;
  bool align_takes = true;  ///< captures without a jig: see alignTakesByPhones()
};

/// What was done to a take.
struct TakeReport {
  std::string name;
  std::size_t frames = 0;
  std::size_t jig_frames = 0, skin_frames = 0, bridged_frames = 0;  ///< see HeadTrack
  double scale = 1;
  double head_residual_mm = 0;
  std::size_t filled_samples = 0;   ///< marker samples in gaps short enough to fill
  std::size_t missing_samples = 0;  ///< marker samples still missing
  double aligned_mm = 0;            ///< largest move by alignTakesByPhones()
};

struct BuildResult {
  Corpus corpus;
  std::vector<TakeReport> takes;
  std::vector<LeftOutTake> left_out;
};

/// Called from one thread at a time.
using BuildProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Takes -> cleaned, labelled corpus: head motion removed, one frame and size for all takes, short gaps filled, neutral
/// pose, the face's own axes. Throws InputError when the folder has no usable take; with `strict`, for any unusable
/// one.
BuildResult buildCorpus(const std::filesystem::path& folder, const BuildOptions& options,
                        const BuildProgress& progress = {});

struct CleanTakes {
  std::vector<CorpusTake> takes;
  std::vector<LeftOutTake> left_out;
};

/// The takes of another folder, cleaned into the frame of `corpus` (its own head reference, from its build log).
CleanTakes readTakesInto(const Corpus& corpus, const std::filesystem::path& folder, const BuildOptions& options,
                         const BuildProgress& progress = {});

/// One clip by itself: head still, in the face's own axes, short gaps filled; the layout's markers. `file` is for
/// messages.
struct CleanClip {
  MotionClip motion;
  TakeReport report;
};
CleanClip cleanClip(const MotionClip& clip, const MarkerLayout& layout, const std::string& file,
                    const CleaningOptions& options = {});

}  // namespace mouthpiece
