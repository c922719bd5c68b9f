#pragma once

#include <string>
#include <vector>

#include "motion/formats/c3d_file.h"
#include "motion/motion_clip.h"
#include "phonetics/language/phone.h"
#include "units/file/corpus.h"

namespace mouthpiece {

struct ReportOptions {
  /// Pronunciations of a language's words: what is missing is judged by them. Empty: not judged.
  std::vector<std::vector<Phone>> language;
  /// Trajectories beyond this are left out of the page, takes at the end first.
  std::size_t most_trajectory_bytes = std::size_t{24} << 20U;
};

/// A page by itself (no other file, no network) to look at a corpus: coverage of phones, phone pairs, syllables and
/// words; durations; the trajectories of any take over its labels; gaps and noise by marker and take; doubtful labels;
/// what is missing to speak the language, worst first. The corpus has its motion loaded.
std::string corpusReportHtml(const Corpus& corpus, const ReportOptions& options = {});

/// The same facts as JSON, without the trajectories.
std::string corpusReportJson(const Corpus& corpus, const ReportOptions& options = {});

/// What `corpus info take.c3d` prints: rate, frames, markers with the share of frames they were seen in, events.
std::string motionFactsText(const MotionClip& clip, const std::vector<MotionEvent>& events);
std::string motionFactsJson(const MotionClip& clip, const std::vector<MotionEvent>& events);

}  // namespace mouthpiece
